"""What robots push that no rigid payload needs: far more than their sensors' noise, though the fit took it for noise.

Noise is judged band by band from what the fit leaves, so that a dead sensor, a wrong gain or wrong axes make wide bars
and no misfit. But noise of sensors is much the same at all frequencies, and what a wrong force leaves moves as slowly
as the payload: the highest band tells the one from the other.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding, quoted
from steelyard.logs.recording import ROUNDED_GRAVITY
from steelyard.team.misread.forces import likely_factor
from steelyard.team.misread.signs import torque_factor, with_torque_sensor
from steelyard.team.payload.fit import PayloadFit
from steelyard.team.payload.model import Group, scatter, weight

# What is left counts from this share of the payload's weight, and from so many times the noise of the highest band;
# noise below 2 Hz has less than three times it. Less is enough where one robot explains it.
SHARE, COLOURED, OF_ONE = 0.03, 4.5, 3.0
# A robot carries nothing where its forces are hardly slower than noise, while those of another are.
FLAT, SLOW = 1.5, 5.0
# A factor nearer to one than this explains nothing; a small turn that goes with it may.
UNLIKE = 0.05
# Rows of a band that show its noise.
FEWEST = 20
# [m] No team holds a payload by grasps so near their middle: lengths are in another unit than was said.
NEAR = 0.01


def unexplained(fit: PayloadFit, D: Array, names: Sequence[str], placed: bool) -> Iterator[Finding]:
    """Yield wrench-unexplained where forces or moments leave so much; names whoever explains it.

    D  (6, 6 N) sums the pushes at B     placed  whether it is known where all grasps are: if not, moments say nothing
    """
    size = float(fit.scale[1] / fit.scale[0])
    for found in list(_forces(fit, D, names)) or (_moments(fit, D, names) if placed else ()):
        yield _with_lengths(found, size) if size < NEAR else found


def _with_lengths(found: Finding, size: float) -> Finding:
    """Return the finding with the doubt that lengths are in another unit, for a team of `size` [m]."""
    text = f"The grasps lie within {1e3 * size:.2g} mm of their middle. {found.message}"
    remedy = (
        'Check the unit of lengths first: are the positions of all robots in "m" where "mm" is said? If grasps are as '
        f"near as that: {found.remedy}"
    )
    return Finding(found.code, text, remedy)


def covariance_of_unexplained(fit: PayloadFit, D: Array, names: Sequence[str], forces: bool) -> Array:
    """Return the covariance (10, 10) that what no payload explains adds: any of the parameters may be made of it.

    The fit takes it for noise, which many rows average out; what is wrong in a force averages to nothing known. But no
    force sensor makes moments alone wrong: below gimbals that is their friction, another in every recording.

    forces  whether it is known that forces are wrong
    """
    size = float(fit.scale[1] / fit.scale[0])
    forces = forces or bool(with_torque_sensor(scatter(fit.groups)).size or list(_forces(fit, D, names)))
    if not forces:
        mass, first = 0.0, _friction(fit.groups) / ROUNDED_GRAVITY
    else:
        left = (_worst(fit.groups, axes)[1:] for axes in (slice(3, 6), slice(0, 3)))
        # What the highest band has as well is noise.
        force, moment = (rms * np.sqrt(max(1 - coloured**-2.0, 0.0)) for rms, coloured in left)
        mass, first = force / ROUNDED_GRAVITY, (force * size + moment) / ROUNDED_GRAVITY
    return np.asarray(np.diag(np.repeat([mass, first, first * size], [1, 3, 6])) ** 2)


def _friction(groups: Sequence[Group]) -> float:
    """Return what a mean of all recordings may keep of the moment about an axis that is left beyond noise [N m].

    Of slow moments only the lowest frequencies hold any, so that they count over all samples, not over those.
    """
    kinds = []
    for group in groups:
        rows = np.sum([part.rows for part in group.parts], axis=0)
        power = group.wrench_noise[:, :3].mean(1)
        kinds.append(float(rows @ np.maximum(power - power[-1], 0.0)) / sum(part.samples for part in group.parts))
    return float(np.sqrt(max(kinds) / sum(len(group.parts) for group in groups)))


def _forces(fit: PayloadFit, D: Array, names: Sequence[str]) -> Iterator[Finding]:
    heavy = weight(fit.parameters)
    group, rms, coloured = _worst(fit.groups, slice(3, 6))
    if rms < SHARE * heavy or coloured < OF_ONE:
        return
    silent = [name for name, flat in zip(names, _flat(group, len(names)), strict=True) if flat]
    factor = None if silent else likely_factor(fit.groups, D)
    suspects = silent or ([] if factor is None else [names[factor[0]]])
    if not suspects and coloured < COLOURED:
        return
    why = ""
    if silent:
        why = f"What {quoted(silent)} measures is noise alone, as if nothing were carried there. "
    elif factor is not None and abs(factor[1] - 1) > UNLIKE:
        why = f"It falls where what {quoted(suspects)} says is taken {factor[1]:.2g} times. "
    elif factor is not None:
        why = f"What {quoted(suspects)} says does not go with the others, as where it is turned by some degrees. "
    text = (
        f"What the robots push {_when(group)} leaves {rms:.2g} N rms that no "
        f"rigid payload explains, {100 * rms / heavy:.0f} % of its weight, and too slow for noise of the sensors. "
        f"{why}The answer is not to be trusted."
    )
    if suspects:
        where, beside = f"the force sensor of {quoted(suspects)}", ""
    else:
        where, beside = (
            "each robot's force sensor",
            " Does gravity point where the bases say? Did anything touch the payload?",
        )
    remedy = f"Check {where}: does it live, and are unit, frame, order and signs of its columns right?{beside}"
    yield Finding("wrench-unexplained", text, remedy)


def _moments(fit: PayloadFit, D: Array, names: Sequence[str]) -> Iterator[Finding]:
    size = float(fit.scale[1] / fit.scale[0])
    lever = weight(fit.parameters) * size
    group, rms, coloured = _worst(fit.groups, slice(0, 3))
    if rms < SHARE * lever or coloured < COLOURED:
        return
    factor = torque_factor(fit.groups, D)
    who, why = "each robot", ""
    if factor is not None:
        who = f"'{names[factor[0]]}'"
        why = f"They fall where the torques of {who} are taken {factor[1]:.2g} times. "
    share = f"{rms / lever:.0f} times" if rms > 10 * lever else f"{100 * rms / lever:.0f} % of"
    text = (
        f"What the robots push {_when(group)} leaves moments of {rms:.2g} N m rms that no rigid payload explains, "
        f"{share} its weight at {size:.2g} m, and too slow for noise of the sensors. {why}"
        "Centre of mass and inertia are not to be trusted."
    )
    remedy = f"Check unit, order and signs of the torque columns of {who}, and where its sensor sits beside its grasp."
    if not with_torque_sensor(scatter(fit.groups)).size:
        remedy = "Check the gimbals for friction, and cables that pull on the payload; bars hold what friction may do."
    yield Finding("wrench-unexplained", text, remedy)


def _when(group: Group) -> str:
    return "at rest" if group.parts[0].still else "in motion"


def _worst(groups: Sequence[Group], axes: slice) -> tuple[Group, float, float]:
    """Return the recordings of the kind that leaves most of these axes of the wrench, and what `_left` says of them."""
    left = [_left(group, axes) for group in groups]
    worst = int(np.argmax([rms for rms, _ in left]))
    return groups[worst], *left[worst]


def _left(group: Group, axes: slice) -> tuple[float, float]:
    """Return the rms of what is left of these axes per row, and that over what the highest band has."""
    rows = np.sum([part.rows for part in group.parts], axis=0)
    power = group.wrench_noise[:, axes].sum(1)
    told = np.flatnonzero(rows >= FEWEST)
    if len(told) < 2:
        return 0.0, 1.0
    rms = float(np.sqrt((power * rows).sum() / rows.sum()))
    return rms, rms / float(np.sqrt(power[told[-1]]))


def _flat(group: Group, count: int) -> Array:
    """Return of which robots (count,) the forces are noise alone, while those of others are not."""
    rows = np.sum([part.rows for part in group.parts], axis=0)
    told = np.flatnonzero(rows >= FEWEST)
    squares = np.sum([np.einsum("kii->ki", part.scatter[:, 12:-1, 12:-1]) for part in group.parts], axis=0)
    forces = squares.reshape(len(rows), count, 6)[..., 3:].sum(2)
    # The lowest band holds the bias.
    power = forces[told] / rows[told, None]
    colour = np.sqrt(power[:-1].max(0) / np.maximum(power[-1], 1e-300))
    return np.asarray((colour < FLAT) & (colour.max() > SLOW))
