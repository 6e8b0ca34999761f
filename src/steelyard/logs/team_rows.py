"""TeamRows: a recording of a team on one even clock, robots stacked, with masks of what was measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from steelyard.check import Array, Mask, frozen
from steelyard.errors import BadValue
from steelyard.logs.curve import BRIDGED, Curve
from steelyard.logs.middles import median
from steelyard.logs.team_log import TeamRecording
from steelyard.logs.team_track import Track
from steelyard.spatial import Rotation

_EVEN = 0.01  # a step that differs from the median by less than this share is jitter of the stamps


@dataclass(frozen=True, eq=False)
class TeamRows:
    """Rows (T,) at one even clock for robots (N,), in the order of `names`.

    twist                body twists (N, T, 6) [rad/s, m/s] of the grasp
    twist_rate           their derivative, component by component (N, T, 6) [rad/s^2, m/s^2]
    gravity              (N, T, 3) [m/s^2] in the grasp's axes
    wrench               (N, T, 6) [N m, N] applied to the payload at the grasp
    carries              (N, T) False where a robot is known to hold nothing
    has_twist, has_rate, has_gravity, has_wrench   (N, T) what was measured; values elsewhere mean nothing
    """

    names: tuple[str, ...]
    time: Array
    twist: Array
    twist_rate: Array
    gravity: Array
    wrench: Array
    carries: Mask
    has_twist: Mask
    has_rate: Mask
    has_gravity: Mask
    has_wrench: Mask

    def __post_init__(self) -> None:
        for name in ("time", "twist", "twist_rate", "gravity", "wrench"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    @property
    def carried_wrench(self) -> Array:
        """The wrenches (N, T, 6), zero where a robot is known to hold nothing: what it reads is no push."""
        return self.wrench * self.carries[..., None]

    def complete_wrench(self) -> Mask:
        """Return the rows (T,) in which somebody carries and every robot that does has a wrench: a sum is not short."""
        return np.asarray((self.has_wrench | ~self.carries).all(0) & self.carries.any(0))

    def index(self, name: str) -> int:
        """Return the place of a robot along the first axis."""
        return self.names.index(name)

    def trimmed(self, seconds: float) -> TeamRows:
        """Return the rows without the first and last `seconds`; raises BadValue where nothing is left."""
        keep = (self.time >= self.time[0] + seconds) & (self.time <= self.time[-1] - seconds)
        if not keep.any():
            raise BadValue(f"a recording must be longer than twice the {seconds:g} s cut from its ends.")
        parts = {n: getattr(self, n)[:, keep] for n in self.__dataclass_fields__ if n not in ("names", "time")}
        return TeamRows(self.names, self.time[keep], **parts)


def common_time(recording: TeamRecording, names: Sequence[str]) -> Array:
    """Return the even clock (T,) [s] of the robots in `names` that have a track.

    The stamps themselves where all agree and are even; else even steps of the median rate over the time that all cover.
    """
    tracks = [recording.tracks[name] for name in names if name in recording.tracks]
    first = tracks[0].time
    if len(first) > 1 and recording.synchronised:
        steps, usual = np.diff(first), median(np.diff(first))
        if np.abs(steps - usual).max() < _EVEN * usual:
            return first
    begin, end = recording.span
    rates = [1 / t.step for t in tracks if len(t) > 1]
    if not rates or end <= begin:
        raise BadValue(f"'{recording.name}' needs at least two samples of every robot in the time that all cover.")
    return begin + np.arange(int((end - begin) * max(rates) * (1 + 1e-9)) + 1) / max(rates)


def mean_rotation(track: Track) -> Rotation:
    """Return the rotation nearest to the mean of the measured ones."""
    return Rotation.nearest(track.channels["rotation"][track.mask("rotation")].mean(0))


def channel_at(track: Track, name: str, time: Array) -> tuple[Array, Mask]:
    """Return a channel (M, 3) at `time` (M,), and where (M,) it was measured.

    A rotation is returned as rotation vectors in G, away from `mean_rotation`. Samples at the very stamps are taken
    as they are; between them, and over missing rows, a curve without overshoot stands in.
    """
    values, good = _vectors(track, name), track.valid[name]
    same = track.stamped_at(time)
    if good.all() and same:
        return values, good
    known = track.time[good]
    if len(known) < 2:
        return np.zeros((len(time), 3)), np.zeros(len(time), np.bool_)
    step = track.step
    return Curve.through(known, values[good]).at(time), good if same else near_samples(known, time, step)


def _vectors(track: Track, name: str) -> Array:
    if name != "rotation":
        return track.channels[name]
    return (mean_rotation(track).inverse() @ Rotation(track.channels["rotation"])).log()


def near_samples(known: Array, time: Array, step: float) -> Mask:
    """Return which of `time` (N,) lie between two samples `known` (K,) that few of the usual `step` [s] part."""
    after = np.clip(np.searchsorted(known, time - 1e-6), 0, len(known) - 1)
    before = np.clip(np.searchsorted(known, time + 1e-6, "right") - 1, 0, len(known) - 1)
    return within(known, time) & (known[after] - known[before] <= BRIDGED * step)


def within(known: Array, time: Array) -> Mask:
    """Return which of `time` (N,) lie between the first and the last of samples `known` (K,)."""
    return np.asarray((time >= known[0] - 1e-6) & (time <= known[-1] + 1e-6))
