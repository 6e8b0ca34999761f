"""Conditioning of a team's recording: low-pass, twists by central differences, their derivatives likewise.

Source: "Cooperative Payload Estimation by a Team of Mocobots", IV-B: a fourth-order Butterworth filter on encoders and
torques alike, here run forwards and backwards and on poses, then central differences.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from steelyard.check import Array
from steelyard.logs.conditioning import lowpass
from steelyard.logs.team_log import TeamLog, TeamRecording
from steelyard.logs.team_rows import TeamRows, channel_at, common_time, mean_rotation
from steelyard.logs.team_track import Mask, Track
from steelyard.spatial import Pose, Rotation, cross
from steelyard.spatial.screws import log_pose

_Smoother = Callable[[str], tuple[Array, Mask]]
_BRIDGED = 0.25  # of the cut-off's period: a shorter gap is filled as well as the filter sees
_SPREAD = 0.5  # of the cut-off's period: how far the filter carries what was filled into a longer gap


def condition(log: TeamLog, recording: TeamRecording, cutoff_hz: float | None = 3.0) -> TeamRows:
    """Return the recording of all robots on one even clock, low-passed at `cutoff_hz` (None = not), with twists.

    Twists and their derivatives come from the poses where the base stands still and poses were measured, else from
    measured velocities and accelerations. Rows near gaps, which the filter fills, count as not measured; so do the
    first and last row of every difference. A robot without a track has no measured row.
    Raises BadValue for clocks too short to filter.
    """
    names = log.names
    time = common_time(recording, names)
    empty = _Columns(len(time))
    columns = [
        _columns(log, name, recording.tracks[name], time, cutoff_hz) if name in recording.tracks else empty
        for name in names
    ]
    return TeamRows(
        names,
        time,
        *(
            np.stack([getattr(c, part) for c in columns])
            for part in ("rotation", "position", "twist", "twist_rate", "gravity", "wrench")
        ),
        np.stack([_carries(recording, name, time) for name in names]),
        *(np.stack([c.has[part] for c in columns]) for part in ("pose", "twist", "rate", "gravity", "wrench")),
    )


def all_conditioned(log: TeamLog, recordings: Sequence[TeamRecording], cutoff_hz: float | None) -> tuple[TeamRows, ...]:
    """Return every recording conditioned alike."""
    return tuple(condition(log, recording, cutoff_hz) for recording in recordings)


def _carries(recording: TeamRecording, name: str, time: Array) -> Mask:
    """Return the rows (T,) in which a robot holds the payload, or may."""
    if name in recording.away:
        return np.zeros(len(time), np.bool_)
    track = recording.tracks.get(name)
    if track is None or track.carrying is None:
        return np.ones(len(time), np.bool_)
    nearest = np.clip(
        np.searchsorted(track.time, time - 0.5 * float(np.median(np.diff(track.time)))), 0, len(track) - 1
    )
    return track.carrying[nearest]


class _Columns:
    """One robot's rows while they are made."""

    def __init__(self, rows: int) -> None:
        self.rotation: Array = np.broadcast_to(np.eye(3), (rows, 3, 3))
        self.position: Array = np.zeros((rows, 3))
        self.twist: Array = np.zeros((rows, 6))
        self.twist_rate: Array = np.zeros((rows, 6))
        self.gravity: Array = np.zeros((rows, 3))
        self.wrench: Array = np.zeros((rows, 6))
        self.has: dict[str, Mask] = {
            part: np.zeros(rows, np.bool_) for part in ("pose", "twist", "rate", "gravity", "wrench")
        }


def _columns(log: TeamLog, name: str, track: Track, time: Array, cutoff_hz: float | None) -> _Columns:
    robot, out = log.robot(name), _Columns(len(time))

    def smooth(channel: str) -> tuple[Array, Mask]:
        return _smooth(track, channel, time, cutoff_hz)

    if track.has("rotation"):
        vectors, turned = smooth("rotation")
        rotation = mean_rotation(track) @ Rotation.exp(vectors)
        out.rotation = rotation.matrix
        if robot.gravity is not None:
            out.gravity, out.has["gravity"] = rotation.inverse().apply(robot.gravity), turned
        if track.has("position"):
            out.position, placed = smooth("position")
            out.has["pose"] = turned & placed
    if track.has("gravity"):
        out.gravity, out.has["gravity"] = smooth("gravity")
    if out.has["pose"].any() and robot.base == "still":
        _difference_poses(out, time)
    elif track.has("angular_velocity", "linear_velocity"):
        _measured_motion(out, track, time, smooth)
    if track.has("force"):
        force, pushed = smooth("force")
        moment = smooth("torque")[0] if track.has("torque") else np.zeros_like(force)
        out.wrench, out.has["wrench"] = np.concatenate([moment, force], 1), pushed
    return out


def _difference_poses(out: _Columns, time: Array) -> None:
    """Set twist and its derivative: the screw of two steps, T(t-1)^-1 T(t+1), over their time, and its difference."""
    pose = Pose(Rotation(out.rotation), out.position)
    step = time[2:] - time[:-2]
    out.twist[1:-1] = log_pose(pose[:-2].inverse() @ pose[2:]) / step[:, None]
    out.has["twist"] = _inner(out.has["pose"])
    _difference_twists(out, time)


def _difference_twists(out: _Columns, time: Array) -> None:
    out.twist_rate[1:-1] = (out.twist[2:] - out.twist[:-2]) / (time[2:] - time[:-2])[:, None]
    out.has["rate"] = _inner(out.has["twist"])


def _measured_motion(out: _Columns, track: Track, time: Array, smooth: _Smoother) -> None:
    """Set twist and its derivative from measured velocities and, where there are any, accelerations."""
    (omega, turning), (velocity, moving) = smooth("angular_velocity"), smooth("linear_velocity")
    out.twist, out.has["twist"] = np.concatenate([omega, velocity], 1), turning & moving
    if track.has("angular_acceleration", "linear_acceleration"):
        (alpha, first), (acceleration, second) = smooth("angular_acceleration"), smooth("linear_acceleration")
        out.twist_rate = np.concatenate([alpha, acceleration - cross(omega, velocity)], 1)
        out.has["rate"] = out.has["twist"] & first & second
    else:
        _difference_twists(out, time)


def _smooth(track: Track, channel: str, time: Array, cutoff_hz: float | None) -> tuple[Array, Mask]:
    """Return a channel at `time` through the filter, and where it stands on measured rows."""
    values, good = channel_at(track, channel, time)
    if cutoff_hz is None or len(time) < 2:
        return values, good
    rate = (len(time) - 1) / (time[-1] - time[0])
    period = rate / cutoff_hz
    return lowpass(values, cutoff_hz, rate), good & ~_near_gaps(good, _BRIDGED * period, _SPREAD * period)


def _near_gaps(good: Mask, bridged: float, spread: float) -> Mask:
    """Return rows within `spread` rows of a gap longer than `bridged` rows."""
    edges = np.flatnonzero(np.diff(np.concatenate([[True], good, [True]]).astype(np.int8)))
    near = np.zeros(len(good), np.bool_)
    for start, end in zip(edges[::2], edges[1::2], strict=True):
        if end - start > bridged:
            near[max(start - int(spread), 0) : end + int(spread)] = True
    return near


def _inner(good: Mask) -> Mask:
    """Return rows whose neighbours on both sides are good."""
    inner = np.zeros_like(good)
    inner[1:-1] = good[:-2] & good[1:-1] & good[2:]
    return inner
