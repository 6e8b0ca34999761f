"""What there is to know about an answer that stands on parts."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding
from steelyard.identify.estimate import Estimate
from steelyard.parts.parts import Parts

# A part is "at zero" below this share of the whole.
ZERO_SHARE = 1e-3
# A combination of part masses counts as seen where the data fix it to this share of the whole mass.
SEEN_SHARE = 0.5
# Centroids lie in a plane where their spread across it is below this share of the spread along it.
FLAT_SHARE = 0.01
# More parts than this share of rank means that the split between parts rests on the priors.
FEWEST_FOR_PLANE = 4


def part_findings(estimate: Estimate, parts: Parts, information: Array) -> list[Finding]:
    """Return findings on parts at zero mass, more parts than the data tell apart, and coplanar centroids."""
    out = []
    mass = estimate.mass
    zero = [p.label for p in estimate.parts if p.mass < ZERO_SHARE * mass]
    if zero:
        share = float(parts.volume[np.isin(parts.label, zero)].sum() / parts.volume.sum())
        names = ", ".join(map(str, zero))
        out.append(
            Finding.of(
                "part-zero-mass", f"Part {names} has less than 0.1 % of the mass but {100 * share:.2g} % of the volume."
            )
        )
    rank = seen_rank(parts, information, mass)
    if rank < len(parts):
        message = (
            f"The data tell {rank} combinations of the masses of {len(parts)} parts apart; the rest is the prior's."
        )
        out.append(Finding.of("more-parts-than-rank", message))
        if len(parts) >= FEWEST_FOR_PLANE and flat(parts.centroid):
            text = "The centroids of the parts lie in one plane: still poses cannot tell their masses apart."
            out.append(Finding.of("centroids-coplanar", text))
    return out


def seen_rank(parts: Parts, information: Array, mass: float) -> int:
    """Return how many combinations of part masses the data fix to half of the whole mass."""
    A = parts.per_mass.T @ information @ parts.per_mass
    return int((np.linalg.eigvalsh(A) > (SEEN_SHARE * mass) ** -2).sum())


def flat(centroids: Array) -> bool:
    """Say whether centroids (P, 3) lie in a plane."""
    spread = np.linalg.svd(centroids - centroids.mean(0), compute_uv=False)
    return bool(spread[2] < FLAT_SHARE * spread[0])
