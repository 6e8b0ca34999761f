"""What robots with moving bases measure: twists of their grasps, and where down is, on one clock."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array, Mask
from steelyard.errors import CannotAnswer
from steelyard.findings import quoted
from steelyard.logs.team_log import TeamLog
from steelyard.logs.team_rows import channel_at
from steelyard.logs.team_track import Track
from steelyard.spatial import Pose
from steelyard.team.adjoint import turns_between
from steelyard.team.stacked import Stretch, bridged, rotation_at, stretches

# [s] of poses that make a twist, and the degree of the polynomial through them. As loud as a difference over 0.1 s, but
# that takes 1.6 % of a twist at 1 Hz: beside robots that measure their twists, it moved grasps by eight of their bars.
SPAN, DEGREE = 0.34, 9


@dataclass(frozen=True, eq=False)
class TwistStretch:
    """One recording: its rows, body twists (T, N, 6) of the grasps where `seen` (T, N), gravity where `level`.

    down  (T, N, 3) [m/s^2] in each grasp's axes
    """

    rows: Stretch
    twist: Array
    seen: Mask
    down: Array
    level: Mask

    @property
    def used(self) -> Stretch:
        """The rows, seen where twists are."""
        return replace(self.rows, seen=self.seen)

    def changed(self, used: Stretch) -> TwistStretch:
        """Return the recording with the rows that are left (`used`) of its own.

        Who lets go or slips no longer knows where down is for the payload, unless nobody else does.
        """
        level = self.level & ~(self.seen & ~used.seen)
        level[~level.any(1)] = self.level[~level.any(1)]
        return replace(self, rows=replace(used, seen=self.rows.seen), seen=used.seen, level=level)


def twist_stretches(log: TeamLog, late: Mapping[str, float]) -> tuple[TwistStretch, ...]:
    """Return every recording with its clocks put right by `late` [s]. Raises CannotAnswer where nobody has twists."""
    parts = stretches(log, late)
    out = []
    for part, recording in zip(parts, log.recordings, strict=True):
        shape = part.seen.shape
        made = TwistStretch(
            part, np.zeros((*shape, 6)), np.zeros(shape, np.bool_), np.zeros((*shape, 3)), np.zeros(shape, np.bool_)
        )
        for i, robot in enumerate(log.robots):
            track = recording.tracks.get(robot.name)
            if track is not None:
                _read(made, i, track.shifted(-late.get(robot.name, 0.0)), robot.gravity, robot.base == "moving")
        out.append(made)
    if not any(made.seen.any() for made in out):
        raise CannotAnswer(_no_twists(log))
    return tuple(out)


def _no_twists(log: TeamLog) -> str:
    """Return what to give where nobody has twists, and not all have poses in a base that stands still."""
    still = [robot.name for robot in log.robots if robot.base == "still"]
    posed = {name for name in still for _, track in log.tracks_of(name) if track.has("rotation", "position")}
    placeless = quoted((name for name in still if name not in posed), ", ")
    if placeless:
        return (
            f"no recording of {placeless} has both rotation and position: give them, or angular_velocity and "
            "linear_velocity of every grasp."
        )
    return "robots whose bases move must measure twists: give angular_velocity and linear_velocity of every grasp."


def _read(made: TwistStretch, i: int, track: Track, gravity: Array | None, moving: bool) -> None:
    """Fill in what one robot measured."""
    time = made.rows.time
    if track.has("angular_velocity", "linear_velocity"):
        for k, name in enumerate(("angular_velocity", "linear_velocity")):
            made.twist[:, i, 3 * k : 3 * k + 3], good = channel_at(track, name, time)
            made.seen[:, i] = good if k == 0 else made.seen[:, i] & good
    elif not moving and track.has("rotation", "position"):
        made.twist[:, i], made.seen[:, i] = derived(made.rows.poses[:, i], made.rows.seen[:, i], made.rows.rate)
    made.seen[:, i] = bridged(made.seen[:, i], time)
    if track.has("gravity"):
        made.down[:, i], good = channel_at(track, "gravity", time)
        made.level[:, i] = bridged(good, time)
    elif not moving and gravity is not None and track.has("rotation"):
        turn, good = rotation_at(track, time)
        made.down[:, i], made.level[:, i] = turn.inverse().apply(gravity), bridged(good, time)


def slope_shares(rate: float) -> Array:
    """Return how much the differences over 1, 2, ... steps either side have of a slope [Hz].

    They are fitted with the odd powers of a polynomial of degree DEGREE over SPAN: what is slow beside the span keeps
    its size (3e-4 off at 4 Hz), as it has in measured twists, and noise between rows does not come in.
    """
    half = max((DEGREE + 1) // 2, round(SPAN * rate / 2))
    steps = np.arange(1, half + 1) / half
    return np.asarray(np.linalg.pinv(steps[:, None] ** np.arange(1, DEGREE + 1, 2))[0] * (rate / (2 * half)))


def derived(path: Pose, seen: Mask, rate: float) -> tuple[Array, Mask]:
    """Return body twists (T, 6) from poses (T,) at rows whose neighbours within half of SPAN are all seen.

    The twist is the slope of the differences: see `slope_shares`.
    """
    shares = slope_shares(rate)
    half = len(shares)
    out, good = np.zeros((len(seen), 6)), np.zeros(len(seen), np.bool_)
    if len(seen) <= 2 * half:
        return out, good
    middle = slice(half, len(seen) - half)
    good[middle] = np.lib.stride_tricks.sliding_window_view(seen, 2 * half + 1).all(1)
    here = path[middle].rotation.inverse()
    for k, share in enumerate(shares, start=1):
        before, after = path[half - k : len(seen) - half - k], path[half + k : len(seen) - half + k]
        out[middle, :3] += share * turns_between(before.rotation, after.rotation)
        out[middle, 3:] += share * here.apply(after.position - before.position)
    return out, good
