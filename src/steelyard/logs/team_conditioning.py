"""Conditioning of a team's recording: low-pass, twists by central differences, their derivatives likewise.

Source: "Cooperative Payload Estimation by a Team of Mocobots", IV-B: a fourth-order Butterworth filter on encoders and
torques alike, here run forwards and backwards and on poses, then central differences.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from steelyard.check import Array, Mask
from steelyard.logs.conditioning import lowpass
from steelyard.logs.runs import runs
from steelyard.logs.team_log import TeamLog, TeamRecording
from steelyard.logs.team_rows import TeamRows, channel_at, common_time, mean_rotation
from steelyard.spatial import Pose, Rotation, cross
from steelyard.spatial.screws import log_pose

_MEASURED = ("twist", "rate", "gravity", "wrench")
_BRIDGED = 0.25  # of the cut-off's period: a shorter gap is filled as well as the filter sees
_SPREAD = 0.5  # of the cut-off's period: how far the filter carries what was filled into a longer gap, or past an end


def condition(log: TeamLog, recording: TeamRecording, cutoff_hz: float | None = 3.0) -> TeamRows:
    """Return the recording of all robots on one even clock, low-passed at `cutoff_hz` (None = not), with twists.

    Twists and their derivatives come from the poses where the base stands still and poses were measured, else from
    measured velocities and accelerations. Rows near gaps, which the filter fills, count as not measured; so do, of
    every difference, rows near the ends, where the filter goes on beyond the data. A robot without a track has no
    measured row. Raises BadValue for clocks too short to filter.
    """
    names = log.names
    time = common_time(recording, names)
    smooth = _smoothed(recording, time, cutoff_hz)
    empty = _Columns(len(time))
    columns = [_columns(log, name, time, smooth[name]) if name in smooth else empty for name in names]
    if cutoff_hz is not None:
        _forget_ends(columns, time, _SPREAD / cutoff_hz)
    parts = ("twist", "twist_rate", "gravity", "wrench")
    stacked: dict[str, Any] = {part: np.stack([getattr(c, part) for c in columns]) for part in parts}
    masks: dict[str, Any] = {f"has_{part}": np.stack([c.has[part] for c in columns]) for part in _MEASURED}
    carries = np.stack([recording.carries(name, time) for name in names])
    return TeamRows(names=names, time=time, carries=carries, **stacked, **masks)


def all_conditioned(log: TeamLog, recordings: Sequence[TeamRecording], cutoff_hz: float | None) -> tuple[TeamRows, ...]:
    """Return every recording conditioned alike."""
    return tuple(condition(log, recording, cutoff_hz) for recording in recordings)


@dataclass(frozen=True, eq=False)
class _Smooth:
    """A channel (T, 3) on the common clock, and where it was measured; rotations are vectors away from `middle`."""

    values: Array
    good: Mask
    middle: Rotation


_Channels = dict[str, _Smooth]


class _Columns:
    """One robot's rows while they are made."""

    def __init__(self, rows: int) -> None:
        self.twist: Array = np.zeros((rows, 6))
        self.twist_rate: Array = np.zeros((rows, 6))
        self.gravity: Array = np.zeros((rows, 3))
        self.wrench: Array = np.zeros((rows, 6))
        self.has: dict[str, Mask] = {part: np.zeros(rows, np.bool_) for part in _MEASURED}


def _columns(log: TeamLog, name: str, time: Array, smooth: _Channels) -> _Columns:
    robot, out, posed = log.robot(name), _Columns(len(time)), np.zeros(len(time), np.bool_)
    if "rotation" in smooth:
        rotation, turned = smooth["rotation"].middle @ Rotation.exp(smooth["rotation"].values), smooth["rotation"].good
        if robot.gravity is not None:
            out.gravity, out.has["gravity"] = rotation.inverse().apply(robot.gravity), turned
        if "position" in smooth:
            posed = turned & smooth["position"].good
    if "gravity" in smooth:
        out.gravity, out.has["gravity"] = smooth["gravity"].values, smooth["gravity"].good
    if posed.any() and robot.base == "still":
        _difference_poses(out, time, Pose(rotation, smooth["position"].values), posed)
    elif {"angular_velocity", "linear_velocity"} <= smooth.keys():
        _measured_motion(out, time, smooth)
    if "force" in smooth:
        force = smooth["force"].values
        moment = smooth["torque"].values if "torque" in smooth else np.zeros_like(force)
        out.wrench, out.has["wrench"] = np.concatenate([moment, force], 1), smooth["force"].good
    return out


def _difference_poses(out: _Columns, time: Array, path: Pose, posed: Mask) -> None:
    """Set twist and its derivative: the screw of two steps, T(t-1)^-1 T(t+1), over their time, and its difference."""
    turn, place = path.rotation.matrix, path.position
    back = np.swapaxes(turn[:-2], 1, 2)
    step = Pose(Rotation(back @ turn[2:]), np.einsum("tij,tj->ti", back, place[2:] - place[:-2]))
    out.twist[1:-1] = log_pose(step) / (time[2:] - time[:-2])[:, None]
    out.has["twist"] = _inner(posed)
    _difference_twists(out, time)


def _difference_twists(out: _Columns, time: Array) -> None:
    out.twist_rate[1:-1] = (out.twist[2:] - out.twist[:-2]) / (time[2:] - time[:-2])[:, None]
    out.has["rate"] = _inner(out.has["twist"])


def _measured_motion(out: _Columns, time: Array, smooth: _Channels) -> None:
    """Set twist and its derivative from measured velocities and, where there are any, accelerations."""
    turning, moving = smooth["angular_velocity"], smooth["linear_velocity"]
    out.twist, out.has["twist"] = np.concatenate([turning.values, moving.values], 1), turning.good & moving.good
    if {"angular_acceleration", "linear_acceleration"} <= smooth.keys():
        alpha, acceleration = smooth["angular_acceleration"], smooth["linear_acceleration"]
        sideways = cross(turning.values, moving.values)
        out.twist_rate = np.concatenate([alpha.values, acceleration.values - sideways], 1)
        out.has["rate"] = out.has["twist"] & alpha.good & acceleration.good
    else:
        _difference_twists(out, time)


def _smoothed(recording: TeamRecording, time: Array, cutoff_hz: float | None) -> dict[str, _Channels]:
    """Return every robot's channels at `time` through the filter, all in one pass."""
    sampled = {
        (robot, channel): channel_at(track, channel, time)
        for robot, track in recording.tracks.items()
        for channel in track.channels
        if track.has(channel)
    }
    stacked = np.concatenate([values for values, _ in sampled.values()], axis=1)
    rate = (len(time) - 1) / (time[-1] - time[0]) if len(time) > 1 else 0.0
    if cutoff_hz is not None and rate:
        stacked = lowpass(stacked, cutoff_hz, rate)
    out: dict[str, _Channels] = {robot: {} for robot in recording.tracks}
    for k, ((robot, channel), (_, good)) in enumerate(sampled.items()):
        if cutoff_hz is not None:
            good = good & ~_near_gaps(good, _BRIDGED * rate / cutoff_hz, _SPREAD * rate / cutoff_hz)
        middle = mean_rotation(recording.tracks[robot]) if channel == "rotation" else Rotation.identity()
        out[robot][channel] = _Smooth(stacked[:, 3 * k : 3 * k + 3], good, middle)
    return out


def _forget_ends(columns: Sequence[_Columns], time: Array, seconds: float) -> None:
    """Call twists near the ends not measured: there the filter rests on what it made up beyond the data."""
    inside = (time >= time[0] + seconds) & (time <= time[-1] - seconds)
    for column in columns:
        column.has["twist"], column.has["rate"] = column.has["twist"] & inside, column.has["rate"] & inside


def _near_gaps(good: Mask, bridged: float, spread: float) -> Mask:
    """Return rows within `spread` rows of a gap longer than `bridged` rows."""
    near = np.zeros(len(good), np.bool_)
    for start, stop in runs(~good):
        if stop - start > bridged:
            near[max(start - int(spread), 0) : stop + int(spread)] = True
    return near


def _inner(good: Mask) -> Mask:
    """Return rows whose neighbours on both sides are good."""
    inner = np.zeros_like(good)
    inner[1:-1] = good[:-2] & good[1:-1] & good[2:]
    return inner
