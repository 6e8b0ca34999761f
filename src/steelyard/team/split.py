"""Whether the payload is one rigid body: groups of grasps that move as one, and the hinge between two groups.

On a rigid body every grasp's twist is a fixed linear map of any other's. Where that leaves much of a twist unexplained,
the two are on different bodies. What the second body does beyond the first, y_2 - M y_1, is then, for a hinge, one
screw times the rate of its angle. The angle bends M; it is integrated and taken out, a few times.
Source: own; the paper names jointed payloads as future work.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from steelyard.check import Array, Integers, Mask
from steelyard.findings import Finding, quoted
from steelyard.logs.conditioning import lowpass
from steelyard.spatial import Pose
from steelyard.team.adjoint import adjoint, exp
from steelyard.team.stacked import Stretch

# [Hz] above which twists from poses are mostly noise.
CUTOFF_HZ = 2.0
# [s] between the poses whose difference makes a twist: shorter is louder, longer smooths the motion, of all alike.
SPAN = 0.1
# Two grasps are on one body where less than this share of the twist's power is left, each part in its own size.
RIGID = 0.05
# One screw explains at least this share of what the second body does beyond the first.
ONE_SCREW = 0.9
ROUNDS = 8
# What is left counts from so many times the power of the noise.
LOUD = 5.0
PARTS = (slice(0, 3), slice(3, 6))
# Why bodies are not weighed.
UNSHOWN = (
    "The motion shows too little of it to weigh the bodies: what is given is for the payload as if it were one. Open "
    "and close the hinge while tilting the payload about two axes."
)
UNPLACED = "Two bodies are weighed from poses only: let the bases stand and log poses, or hold the hinge fast."
# Rows that must be there.
FEWEST = 200
# Gaps up to so long [s] are bridged: half a period of the fastest motion that is kept.
BRIDGED_S = 0.5 / CUTOFF_HZ


def moving_twists(parts: Sequence[Stretch]) -> tuple[Array, Array, float]:
    """Return low-passed twists (T, N, 6) of the longest recording in motion, and what `smoothed` says of them."""
    part = max((p for p in parts if p.kind != "still"), key=len, default=parts[0])
    every = [differenced(part.poses[:, i], part.seen[:, i], part.rate) for i in range(part.seen.shape[1])]
    return smoothed(np.stack([v for v, _ in every], axis=1), np.all([seen for _, seen in every], axis=0), part.rate)


def smoothed(twist: Array, seen: Mask, rate: float) -> tuple[Array, Array, float]:
    """Return twists (T, N, 6) low-passed, over the longest run of rows without long gaps that all have `seen` (T,).

    Rows that some robot missed are bridged by straight lines, in the twists of all robots alike, so that what is a
    fixed linear map of another twist stays one. Also the mean square (N, 2) of what the filter took away of the rows
    that all saw, turning and moving, and the rate [Hz].
    """
    good = longest_run(np.flatnonzero(seen), round(BRIDGED_S * rate))
    if len(good) < FEWEST:
        return np.zeros((0, twist.shape[1], 6)), np.zeros((twist.shape[1], 2)), rate
    rows = np.arange(good[0], good[-1] + 1)
    bridged = np.stack([np.interp(rows, good, column) for column in twist[good].reshape(len(good), -1).T], axis=1)
    smooth = lowpass(bridged, min(CUTOFF_HZ, 0.4 * rate), rate)
    taken = ((bridged - smooth)[good - good[0]] ** 2).mean(0).reshape(-1, 2, 3).mean(2)
    return smooth.reshape(len(rows), -1, 6), taken, rate


def differenced(path: Pose, seen: Mask, rate: float) -> tuple[Array, Mask]:
    """Return body twists (T, 6) from poses (T,) at rows that have both neighbours."""
    half = max(1, round(SPAN * rate / 2))
    out, good = np.zeros((len(seen), 6)), np.zeros(len(seen), np.bool_)
    if len(seen) > 2 * half:
        before, after, here = path[: -2 * half], path[2 * half :], path[half:-half].rotation.inverse()
        out[half:-half, :3] = (before.rotation.inverse() @ after.rotation).log() * (rate / (2 * half))
        out[half:-half, 3:] = here.apply(after.position - before.position) * (rate / (2 * half))
        good[half:-half] = seen[: -2 * half] & seen[2 * half :] & seen[half:-half]
    return out, good


def longest_run(rows: Integers, bridged: int) -> Integers:
    """Return the longest of the pieces into which gaps of more than `bridged` rows cut rising row numbers."""
    return max(np.split(rows, np.flatnonzero(np.diff(rows) > bridged + 1) + 1), key=len)


def share_left(first: Array, second: Array, noise: Array) -> float:
    """Return the share of the power of `second` (T, 6) that no fixed linear map of `first` (T, 6) explains.

    What is left below LOUD times the noise (2,) of turning and of moving counts as none.
    """
    left = second - first @ np.linalg.lstsq(first, second, rcond=1e-6)[0]
    shares = [0.0]
    for k, floor in zip(PARTS, noise, strict=True):
        if (left[:, k] ** 2).mean() > LOUD * floor:
            shares.append(float((left[:, k] ** 2).sum() / max(float((second[:, k] ** 2).sum()), 1e-300)))
    return max(shares)


def bodies(twist: Array, noise: Array) -> list[tuple[int, ...]]:
    """Return the groups of robots, by number, that move as one body each.

    twist  (T, N, 6) of every robot in axes of its own, angular part first [rad/s, m/s]
    noise  (N, 2) of turning and of moving, as `share_left` takes it
    """
    groups: list[list[int]] = []
    for i in range(twist.shape[1]):
        for group in groups:
            if share_left(twist[:, group[0]], twist[:, i], noise[group[0]] + noise[i]) < RIGID:
                group.append(i)
                break
        else:
            groups.append([i])
    return [tuple(group) for group in groups]


def find_hinge(first: Array, second: Array, rate: float) -> tuple[Array, Array, float, float]:
    """Return axis, point, swing [rad] and the share of one screw, in the second grasp, from twists (T, 6) of both."""
    size = np.repeat([np.sqrt((second[:, :3] ** 2).mean()), np.sqrt((second[:, 3:] ** 2).mean())], 3)
    angle, screw, share = np.zeros(len(first)), np.zeros(6), 0.0
    for _ in range(ROUNDS):
        # Seen from where the second body is at angle zero, its twist is M y_1 + screw d angle.
        straight = np.einsum("tij,tj->ti", adjoint(exp(angle[:, None] * screw)), second) if screw.any() else second
        left = straight - first @ np.linalg.lstsq(first, straight, rcond=1e-6)[0]
        _, values, axes = np.linalg.svd(left / size, full_matrices=False)
        share = float(values[0] ** 2 / (values**2).sum())
        screw = axes[0] * size
        length = float(np.linalg.norm(screw[:3]))
        if length == 0:
            break
        screw = screw / length
        weighted = screw / size**2
        speed = left @ weighted / float(screw @ weighted)
        angle = np.cumsum(speed) / rate
        angle = angle - np.linspace(angle[0], angle[-1], len(angle))
        angle = angle - angle.mean()
    point = np.cross(screw[:3], screw[3:])
    return screw[:3], point, float(np.abs(angle).max()), share


@dataclass(frozen=True, eq=False)
class Split:
    """Grasps that are not on one body: `groups` of robots, and between two of them the hinge, if it is one.

    hinge  its axis, point and largest angle [rad] in the first grasp of the second group; None where it is no hinge
    twist  (T, N, 6) of all grasps, low-passed
    """

    groups: tuple[tuple[int, ...], ...]
    twist: Array
    hinge: tuple[Array, Array, float] | None

    @property
    def sure(self) -> bool:
        """Whether there is a hinge that no bad sensor of one robot can feign: several move alike on either side."""
        return self.hinge is not None and min(len(group) for group in self.groups) > 1


def find_split(parts: Sequence[Stretch], first: int = 0) -> Split | None:
    """Return how the grasps fall apart, the group of robot `first` before the others; None for one rigid body."""
    return split_of(*moving_twists(parts), first)


def split_of(twist: Array, noise: Array, rate: float, first: int = 0) -> Split | None:
    """Return what `find_split` does from twists (T, N, 6) as `smoothed` returns them."""
    if not len(twist):
        return None
    groups = sorted(bodies(twist, noise), key=lambda group: first not in group)
    if len(groups) == 1:
        return None
    if len(groups) == 2:
        one, two = (group[0] for group in groups)
        axis, point, swing, share = find_hinge(twist[:, one], twist[:, two], rate)
        if share > ONE_SCREW:
            return Split(tuple(groups), twist, (axis, point, swing))
    return Split(tuple(groups), twist, None)


def rigidity_findings(split: Split | None, names: Sequence[str], unweighed: str = UNSHOWN) -> list[Finding]:
    """Return payload-jointed with the hinge's axis, or payload-not-rigid, where the grasps are not on one body.

    unweighed  why the two bodies are not weighed, and what to do
    """
    if split is None:
        return []
    called = [quoted(names[i] for i in group) for group in split.groups]
    if split.hinge is not None:
        said = hinge_words(called, *split.hinge, names[split.groups[1][0]])
        return [Finding.of("payload-jointed", f"{said} {unweighed}")]
    return [
        Finding.of(
            "payload-not-rigid",
            f"The grasps do not move as on one rigid body: {'; '.join(called)} move by themselves. What is given is "
            "for the payload as if it were rigid.",
        )
    ]


def hinge_words(holders: Sequence[str], axis: Array, point: Array, swing: float, grasp: str) -> str:
    """Say who holds which body, and where the hinge between them is.

    axis, point (3,) [m] in the `grasp` named     swing  by how much it turned [rad]
    """
    about, through = ", ".join(f"{a:.3f}" for a in axis), ", ".join(f"{1e3 * a:.0f}" for a in point)
    return (
        f"{holders[0]} hold one body, {holders[1]} another: between them is a hinge about ({about}) through "
        f"({through}) mm of grasp '{grasp}', which swung by {np.rad2deg(swing):.0f} deg."
    )
