"""What there is to know about an answer that stands on parts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import gammaincinv

from steelyard.check import Array
from steelyard.findings import Finding, counted
from steelyard.identify.bars.effective import Effective
from steelyard.identify.estimate import Estimate
from steelyard.identify.masses.material_choice import Choices
from steelyard.identify.masses.placement import misplaced
from steelyard.identify.masses.shape_error import DRAWN, ShapeError
from steelyard.inertia import InertialParameters
from steelyard.parts.material import Material
from steelyard.parts.parts import Parts

# A part with more than this share of the volume is "at zero" below a hundredth of the mean density.
ZERO_SHARE, ZERO_DENSITY = 1e-3, 1e-2
# A combination of part masses counts as seen where the data fix it to this share of the whole mass.
SEEN_SHARE = 0.5
# Centroids lie in a plane where their spread across it is below this share of the spread along it.
FLAT_SHARE = 0.01
# Three centroids always lie in a plane.
FEWEST_FOR_PLANE = 4
# A right shape is called wrong this often.
MISFIT_CHANCE = 1e-5
# A scan's centre of mass that lies off by so many times what its parts usually do lies elsewhere.
FAR = 3.0


def part_findings(
    estimate: Estimate,
    body: InertialParameters,
    parts: Parts,
    data: Effective,
    choices: Choices | None,
    materials: Sequence[Material],
) -> list[Finding]:
    """Return what there is to know: parts at zero, parts not told apart, materials tied or impossible, misfit.

    body  what the shape makes of the masses, judged against the log
    """
    out = zero_masses(estimate, parts)
    rank = seen_rank(parts, data.information, estimate.mass)
    if rank < len(parts):
        message = (
            f"The data tell {counted(rank, 'combination')} of the masses of {counted(len(parts), 'part')} apart; "
            "the rest is the prior's."
        )
        out.append(Finding.of("more-parts-than-rank", message))
        if len(parts) >= FEWEST_FOR_PLANE and flat(parts.centroid):
            text = "The centroids of the parts lie in one plane: still poses cannot tell their masses apart."
            out.append(Finding.of("centroids-coplanar", text))
    if choices is not None:
        out += _material_findings(estimate, data, choices, materials)
    elif (misfit := data.misfit(body.vector)) > (limit := misfit_limit(data, len(parts))):
        text = (
            f"Homogeneous parts of this shape leave a chi-square of {misfit:.0f} that ten free numbers do not "
            f"(at most {limit:.0f} by chance): a part is not of one density, or the shape is wrong."
        )
        out.append(Finding.of("part-not-homogeneous", " ".join(filter(None, (misplaced(data, parts), text)))))
    return out


def misfit_limit(data: Effective, parts: int, chance: float = MISFIT_CHANCE) -> float:
    """Return the chi-square that a right shape exceeds with that chance: once in 100 000 logs."""
    return float(2 * gammaincinv(max(data.rank - min(parts, data.rank - 1), 1) / 2, 1 - chance))


def elsewhere(data: Effective, body: InertialParameters, parts: Parts, error: ShapeError) -> str:
    """Return a sentence where the log contradicts a scan, or its place, by more than scans are wrong; else "".

    body   what the scan makes of the masses
    error  of the scan and its place, as they say themselves
    """
    seen = data.blurred(error.at_least(DRAWN, 0.0).with_grasp(body))
    if seen.misfit(body.vector) <= misfit_limit(seen, len(parts)):
        return ""
    return misplaced(data.blurred(error.with_grasp(body)), parts, FAR * DRAWN)


def zero_masses(estimate: Estimate, parts: Parts) -> list[Finding]:
    """Return the finding on parts with next to no mass in this estimate."""
    share = parts.volume / parts.volume.sum()
    mass = np.array([part.mass for part in estimate.parts])
    zero = (share > ZERO_SHARE) & (mass < ZERO_DENSITY * share * estimate.mass)
    if not zero.any():
        return []
    names = " and ".join(map(str, parts.label[zero]))
    text = (
        f"Part {names} {'weighs' if zero.sum() == 1 else 'weigh'} {1e3 * mass[zero].sum():.2g} g: less than a "
        f"hundredth of what {100 * share[zero].sum():.2g} % of the volume would at the mean density."
    )
    return [Finding.of("part-zero-mass", text)]


def named_materials(count: int, choices: Choices | None, materials: Sequence[Material]) -> list[str | None]:
    """Return the name of each part's material, with a question mark where another one is possible."""
    if choices is None:
        return [None] * count
    best = choices.shares(len(materials)).argmax(1)
    tied = choices.possible(len(materials)).sum(1) > 1
    return [materials[b].name + ("?" if more else "") for b, more in zip(best, tied, strict=True)]


def _material_findings(
    estimate: Estimate, data: Effective, choices: Choices, materials: Sequence[Material]
) -> list[Finding]:
    """Return findings on materials that cannot be told apart, or that cannot give the wrench at all."""
    out = []
    limit = misfit_limit(data, 1)
    misfit = data.misfit(estimate.parameters.vector)
    if misfit > limit:
        text = f"No choice from the list gives this wrench: chi-square {misfit:.0f}, at most {limit:.0f} by chance."
        return [Finding.of("materials-impossible", text)]
    shares = choices.shares(len(materials))
    ties = []
    for row, can, part in zip(shares, choices.possible(len(materials)), estimate.parts, strict=True):
        named = [f"{materials[k].name} ({100 * row[k]:.0f} %)" for k in np.argsort(-row, kind="stable") if can[k]]
        if len(named) > 1:
            ties.append(f"part {part.label}: " + " or ".join(named))
    if ties:
        out.append(Finding.of("materials-tied", f"The data leave the material open of {'; '.join(ties)}."))
    return out


def seen_rank(parts: Parts, information: Array, mass: float) -> int:
    """Return how many combinations of part masses information (10, 10) fixes to half of the whole `mass` [kg]."""
    A = parts.per_mass.T @ information @ parts.per_mass
    return int((np.linalg.eigvalsh(A) > (SEEN_SHARE * mass) ** -2).sum())


def flat(centroids: Array) -> bool:
    """Say whether centroids (P, 3) lie in a plane."""
    spread = np.linalg.svd(centroids - centroids.mean(0), compute_uv=False)
    return bool(spread[2] < FLAT_SHARE * spread[0])
