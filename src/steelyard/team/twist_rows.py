"""What robots with moving bases measure: twists of their grasps, and where down is, on one clock."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.logs.log import Mask
from steelyard.logs.team_log import TeamLog
from steelyard.logs.team_rows import channel_at
from steelyard.logs.team_track import Track
from steelyard.spatial import Pose
from steelyard.team.stacked import Stretch, bridged, rotation_at, stretches

# [s] between the poses whose difference makes a twist: shorter is louder, longer smooths the motion.
SPAN = 0.1


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
        raise CannotAnswer(
            "robots whose bases move must measure twists: give angular_velocity and linear_velocity of every grasp."
        )
    return tuple(out)


def _read(made: TwistStretch, i: int, track: Track, gravity: Array | None, moving: bool) -> None:
    """Fill in what one robot measured."""
    time = made.rows.time
    if track.has("angular_velocity", "linear_velocity"):
        for k, name in enumerate(("angular_velocity", "linear_velocity")):
            made.twist[:, i, 3 * k : 3 * k + 3], good = channel_at(track, name, time)
            made.seen[:, i] = good if k == 0 else made.seen[:, i] & good
    elif not moving and track.has("rotation", "position"):
        made.twist[:, i], made.seen[:, i] = differenced(made.rows.poses[:, i], made.rows.seen[:, i], made.rows.rate)
    made.seen[:, i] = bridged(made.seen[:, i])
    if track.has("gravity"):
        made.down[:, i], good = channel_at(track, "gravity", time)
        made.level[:, i] = bridged(good)
    elif not moving and gravity is not None and track.has("rotation"):
        turn, good = rotation_at(track, time)
        made.down[:, i], made.level[:, i] = turn.inverse().apply(gravity), bridged(good)


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
