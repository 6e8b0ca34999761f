"""The recordings of a team on one clock each, robots side by side, clocks corrected: rows for the joint fit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence, Sized
from dataclasses import dataclass, replace
from itertools import pairwise
from weakref import WeakKeyDictionary

import numpy as np

from steelyard.check import Array, Mask
from steelyard.logs.curve import Curve
from steelyard.logs.team_log import TeamLog, TeamRecording
from steelyard.logs.team_rows import channel_at, common_time, mean_rotation, near_samples, within
from steelyard.logs.team_track import Track
from steelyard.spatial import Pose, Rotation
from steelyard.team.adjoint import turned_by, turns_between
from steelyard.team.clocks.errors import PUNCTUAL, ClockError, Errors, punctual

# Rows, and seconds, that a gap may last and still be filled: far below what the payload can do in that time. A curve
# through 1 Hz is off by 3e-5 of it over as long, through 3 Hz by 0.2 %.
BRIDGED, BRIEF = 3, 0.05
# Of tracks that were read between their stamps: clocks are put right several times, and the curve stays.
_CURVES: WeakKeyDictionary[Track, tuple[Rotation, Curve] | None] = WeakKeyDictionary()


@dataclass(frozen=True, eq=False)
class Stretch:
    """One recording: T rows of N robots.

    time    (T,) [s] on the reference's clock      kind  of the recording
    poses   X_HG (T, N), identity where not seen   seen  (T, N)
    wrench  (T, N, 6) [N m, N] in each grasp       felt  (T, N) where a wrench was measured
    carries (T, N) False where a robot is known to hold nothing
    """

    name: str
    kind: str
    time: Array
    poses: Pose
    seen: Mask
    wrench: Array
    felt: Mask
    carries: Mask

    def __len__(self) -> int:
        return len(self.time)

    @property
    def complete(self) -> Mask:
        """Rows (T,) in which every robot that carries has a wrench, so that the sum is not short."""
        return np.asarray((self.felt | ~self.carries).all(1) & self.carries.any(1))

    @property
    def rate(self) -> float:
        """Rows per second [Hz]."""
        return (len(self.time) - 1) / float(self.time[-1] - self.time[0])

    def thinned(self, rows: int) -> Stretch:
        """Return every k-th row, so that at least `rows` are left where there are as many."""
        k = max(1, len(self) // rows)
        names = ("time", "poses", "seen", "wrench", "felt", "carries")
        return replace(self, **{name: getattr(self, name)[::k] for name in names})


def stretches(log: TeamLog, late: Mapping[str, float]) -> tuple[Stretch, ...]:
    """Return every recording with its clocks put right by `late` [s], seconds that each robot's stamps are late.

    Rows are told by the reference's clock as it is, whatever `late` says of it. Raises BadValue where the corrected
    clocks no longer overlap.
    """
    errors = {name: ClockError(seconds) for name, seconds in late.items() if seconds}
    made = tuple(_stretch(log, recording, errors) for recording in log.recordings)
    own = late.get(log.reference, 0.0)
    return tuple(replace(part, time=part.time + own) for part in made) if own else made


def _stretch(log: TeamLog, given: TeamRecording, errors: Errors) -> Stretch:
    recording = punctual(given, errors)
    time = common_time(recording, log.names)
    rows, count = len(time), len(log.names)
    # Robot after robot while they are read: rows of many lie far apart.
    turns, place = np.empty((count, rows, 3, 3)), np.zeros((count, rows, 3))
    turns[:], wrench = np.eye(3), np.zeros((count, rows, 6))
    seen, felt = np.zeros((count, rows), np.bool_), np.zeros((count, rows), np.bool_)
    carries = np.stack([recording.carries(name, time) for name in log.names], axis=1)
    for i, name in enumerate(log.names):
        track = recording.tracks.get(name)
        if track is None:
            continue
        found = None if track.stamped_at(time) else _curve(given.tracks[name])
        if found is not None:
            own = errors.get(name, PUNCTUAL).own(time)
            turns[i], place[i], wrench[i], near = _together(given.tracks[name], *found, own)
            seen[i] = felt[i] = bridged(near, time)
            continue
        if track.has("rotation", "position"):
            turned, had = rotation_at(track, time)
            turns[i] = turned.matrix
            place[i], placed = _place_at(track, time)
            seen[i] = bridged(had & placed, time)
        if track.has("force"):
            wrench[i, :, 3:], measured = channel_at(track, "force", time)
            felt[i] = bridged(measured, time)
            if track.has("torque"):
                wrench[i, :, :3] = channel_at(track, "torque", time)[0]
    poses = Pose.trusted(Rotation.trusted(turns.swapaxes(0, 1)), place.swapaxes(0, 1))
    pushes = np.ascontiguousarray(wrench.swapaxes(0, 1))
    saw, sensed = np.ascontiguousarray(seen.T), np.ascontiguousarray(felt.T)
    return Stretch(recording.name, recording.kind, time, poses, saw, pushes, sensed, carries)


def _together(track: Track, turn: Rotation, curve: Curve, time: Array) -> tuple[Array, Array, Array, Mask]:
    """Return rotations (M, 3, 3), positions (M, 3) and wrenches (M, 6) at `time` (M,), and where near.

    turn, curve  as from `_curve`
    """
    values = curve.at(time)
    near = within(track.time, time) if curve.whole else near_samples(track.time, time, track.step)
    return turned_by(turn, values[:, :3]).matrix[:, 0], turn.turned(values[:, 3:6]), values[:, 6:], near


def _curve(track: Track) -> tuple[Rotation, Curve] | None:
    """Return a track's mean rotation, and rotation vectors from there, positions in its axes and wrenches (T, 12).

    The curve is that of `rotation_at`, `_place_at` and `channel_at` for each; None where not all of these were measured
    at every stamp.
    """
    if track not in _CURVES:
        _CURVES[track] = _curve_through(track) if _whole(track) else None
    return _CURVES[track]


def _whole(track: Track) -> bool:
    whole = all(name in track.channels and bool(track.valid[name].all()) for name in ("rotation", "position", "force"))
    return whole and len(track) > 1 and bool(track.valid.get("torque", track.valid["force"]).all())


def _curve_through(track: Track) -> tuple[Rotation, Curve]:
    turn, pose = mean_rotation(track), track.pose
    own = turns_between(turn, pose.rotation), turn.inverse().apply(pose.position)
    return turn, Curve.through(track.time, np.concatenate([*own, track.wrench()], axis=1))


def rotation_at(track: Track, time: Array) -> tuple[Rotation, Mask]:
    """Return a track's rotations at `time` (M,), and where they were measured."""
    good = track.valid["rotation"]
    if good.all() and track.stamped_at(time):
        return track.rotation, good
    vectors, turned = channel_at(track, "rotation", time)
    return mean_rotation(track) @ Rotation.exp(vectors), turned


def _place_at(track: Track, time: Array) -> tuple[Array, Mask]:
    """Return a track's positions at `time` (M,), and where they were measured.

    A curve without overshoot depends on its axes: the grasp's own on average are taken, which no home changes.
    """
    good = track.valid["position"]
    if good.all() and track.stamped_at(time):
        return track.channels["position"], good
    turn = mean_rotation(track)
    own = replace(track, channels={**track.channels, "position": turn.inverse().apply(track.channels["position"])})
    values, placed = channel_at(own, "position", time)
    return turn.apply(values), placed


def bridged(good: Mask, time: Array) -> Mask:
    """Return the mask of rows at `time` with brief gaps closed: between such neighbours a curve is as good as a row."""
    if good.all() or not good.any():
        return good
    there = np.flatnonzero(good)
    gap = np.diff(there)
    out = good.copy()
    for k in np.flatnonzero((gap > 1) & ((gap <= BRIDGED + 1) | (np.diff(time[there]) <= BRIEF))):
        out[there[k] : there[k + 1]] = True
    return out


def with_rows(parts: Sequence[Stretch]) -> Iterator[tuple[Stretch, slice]]:
    """Yield each part beside the rows that it has where all stand one after the other."""
    return zip(parts, row_slices(parts), strict=True)


def row_slices(parts: Sequence[Sized]) -> list[slice]:
    """Return which rows each part has where all stand one after the other."""
    ends = np.cumsum([0, *(len(part) for part in parts)]).tolist()
    return [slice(a, b) for a, b in pairwise(ends)]
