"""Glance: a log at a few hertz, just good enough to compare conventions before anything is aligned.

Clocks are taken as they are, the wrench is averaged over a sixtieth of a second, and everything is
low-passed alike, so that a body at rest or in slow motion obeys f = m (a - g), tau = h x (a - g), each with a bias.
Nothing is read out of holes in a stream, nor out of knocks: a line across either is no measurement.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from steelyard.check import Array, Integers, Mask
from steelyard.inertia import forms
from steelyard.logs.conditioning import lowpass
from steelyard.logs.felt import Felt
from steelyard.logs.holes import holes, unknown_motion
from steelyard.logs.imu import first_mount
from steelyard.logs.intervals import inside, merged
from steelyard.logs.outliers import bursts
from steelyard.logs.recording import Recording, Stream
from steelyard.spatial import cross_matrix, lever_matrix

CUTOFF_HZ = 3.0
_RATE_HZ = 60.0
_MOST_ROWS = 20_000
_FEWEST_ROWS = 60
_BLOCKS = 12
_SMEAR_S = 0.3  # so far the low-pass carries what stands in a hole
_PARTS = ("torque", "force")

OnRows = Callable[[Stream, Array], Array]  # a channel (M, ..) as it is at the rows of a glance (N, ..)


@dataclass(frozen=True, eq=False)
class Glance:
    """Rows of a recording on one even clock, or the rows of a table.

    wrench        (N, 6) [tau (N m), f (N)] on-object, about the S origin, in S or (what `world` names) in W axes
    rotation      (N, 3, 3) S to W, averaged over a row; None without
    pull          (N, 3) [m/s^2] gravity in S from a channel, where there is no rotation
    acceleration  (N, 3) [m/s^2] of the S origin in W, without gravity; None where no channel tells it
    block         (M,) number of the stretch (or the pose) that a row which is fitted belongs to, for the jackknife
    rate          [Hz] of the rows; None for a table
    world         which of "torque" and "force" are in W axes
    accelerometer (N, 3) [m/s^2] what an accelerometer shows in its own axes, where there are rotations, too
    mirrored      (N, 3) `pull` as it would be with the wrench of the other sign, where the force itself decides how the
                  accelerometer sits; else None
    dead          channels [tau, f] of S that do not measure; their wrench is zero
    position      (N, 3) [m] of the S origin in W; None where no channel tells it
    kept          (N,) the M rows that are fitted, which lie in no hole; None where all are
    calm          (L,) rows of the wrench's stream that lie in no knock; None for a table
    """

    wrench: Array
    rotation: Array | None
    pull: Array | None
    acceleration: Array | None
    block: Integers
    rate: float | None
    world: frozenset[str] = frozenset()
    mirrored: Array | None = None
    accelerometer: Array | None = None
    dead: tuple[bool, ...] = (False,) * 6
    position: Array | None = None
    kept: Mask | None = None
    calm: Mask | None = None

    def __len__(self) -> int:
        return len(self.wrench)

    @cached_property
    def still(self) -> Glance:
        """The same as if nothing told the acceleration."""
        return replace(self, acceleration=None)

    def smooth(self, values: Array) -> Array:
        """Return values (N, k) through the common low-pass, in the rows to fit (M, k); a table's as they are."""
        if self.rate is None:
            return values
        slow = lowpass(values, CUTOFF_HZ, self.rate, order=2)
        return slow if self.kept is None else slow[self.kept]

    def in_sensor(self, part: str, values: Array, rotation: Array | None) -> Array:
        """Return values (N, 3) of a part of the wrench, in W or S as it is, in S."""
        return values if rotation is None or part not in self.world else _into_sensor(rotation, values)

    def seen(self, gravity: Array, rotation: Array | None) -> Seen:
        """Return wrench and motion in S, low-passed, for a gravity in W (3,) [m/s^2] and rotations (N, 3, 3)."""
        if rotation is None:
            pull = self.pull if self.pull is not None else np.zeros((len(self), 3))
            return Seen(self.smooth(self.wrench), self.smooth(pull), dead=self.dead)
        own = gravity if self.acceleration is None else gravity - self.acceleration
        pull = _into_sensor(rotation, np.broadcast_to(own, (len(self), 3)))
        torque, force = np.split(self.wrench, 2, 1)
        wrench = np.concatenate(
            [self.in_sensor("torque", torque, rotation), self.in_sensor("force", force, rotation)], 1
        )
        if self.rate is None:
            return Seen(wrench, pull, dead=self.dead)
        wrench, pull = np.split(self.smooth(np.concatenate([wrench, pull], 1)), [6], axis=1)
        turns = self._own_turns if rotation is self.rotation else None
        return Seen(wrench, pull, *(turns or self._turns(rotation, self.rate)), self.dead)

    @cached_property
    def _own_turns(self) -> tuple[Array, Array] | None:
        """What the own rotations add by turning: readings share it."""
        return None if self.rotation is None or self.rate is None else self._turns(self.rotation, self.rate)

    def _turns(self, rotation: Array, rate: float) -> tuple[Array, Array]:
        """Return lever (M, 3, 3) and spin (M, 3, 6) of rotations (N, 3, 3), low-passed."""
        lever, spin = _turning(rotation, rate)
        both = self.smooth(np.concatenate([lever.reshape(-1, 9), spin.reshape(-1, 18)], 1))
        return both[:, :9].reshape(-1, 3, 3), both[:, 9:].reshape(-1, 3, 6)


@dataclass(frozen=True, eq=False)
class Seen:
    """The rows of a glance that are fitted, in S under one set of conventions.

    wrench  (N, 6) [tau, f] on-object
    pull    (N, 3) gravity less acceleration [m/s^2]
    lever   (N, 3, 3) what turning adds to the force per first moment of mass; None for tables
    spin    (N, 3, 6) what turning adds to the torque per entry of the inertia
    dead    channels [tau, f] of S that do not measure; their wrench is zero
    """

    wrench: Array
    pull: Array
    lever: Array | None = None
    spin: Array | None = None
    dead: tuple[bool, ...] = (False,) * 6

    def heard(self, part: int) -> Array:
        """Return one for each axis of the torque (0) or the force (1) that measures, zero for the others, (3, 1)."""
        return np.array([[not d] for d in self.dead[3 * part : 3 * part + 3]], dtype=np.float64)


def _into_sensor(rotation: Array, vectors: Array) -> Array:
    return np.asarray(np.einsum("nji,nj->ni", rotation, vectors))


def _turning(rotation: Array, rate: float) -> tuple[Array, Array]:
    """Return lever (N, 3, 3) and spin (N, 3, 6) of rotations (N, 3, 3) sampled at `rate` [Hz]."""
    omega = angular_velocity(rotation, rate)
    alpha = np.gradient(omega, 1 / rate, axis=0)
    across = cross_matrix(omega)
    lever = lever_matrix(omega, alpha)
    spin = _by_entries(alpha) + across @ _by_entries(omega)
    return lever, spin


def _by_entries(vectors: Array) -> Array:
    """Return the derivative (N, 3, 6) of I v by the entries of the inertia, for vectors v (N, 3)."""
    entries = forms.inertia_matrix(np.eye(10)[4:])
    return np.asarray(vectors @ entries.transpose(2, 1, 0).reshape(3, 18)).reshape(-1, 3, 6)


def angular_velocity(rotation: Array, rate: float) -> Array:
    """Return the angular velocity (N, 3) [rad/s] in S of rotations (N, 3, 3) sampled at `rate` [Hz]."""
    change = np.swapaxes(rotation, 1, 2) @ np.gradient(rotation, 1 / rate, axis=0)
    return np.asarray(0.5 * np.stack([change[:, i, j] - change[:, j, i] for i, j in ((2, 1), (0, 2), (1, 0))], 1))


def glance(recording: Recording, like: Glance | None = None) -> Glance | None:
    """Return the rows, or None where the recording has no wrench, no direction of gravity, or next to no rows.

    like  what was seen of the same wrench beside other poses, or in other axes: its knocks are not sought again
    """
    stream = recording.stream_of("force", "torque")
    if stream is None:
        return None
    return _of_table(recording, stream) if stream.time is None else _of_clocks(recording, stream, like)


def _calm(stream: Stream) -> Mask:
    """Return the rows (L,) of a stream of forces and torques that lie in no knock."""
    return ~inside(stream.sampled, merged(*(bursts(stream.sampled, stream.channels[part]) for part in _PARTS)))


def in_axes(recording: Recording, world: Collection[str]) -> Recording:
    """Return the recording with those of "torque" and "force" that `world` names said to be in W, the others in S."""

    def said(stream: Stream) -> Stream:
        felt = {part: "W" if part in world else "S" for part in _PARTS if part in stream.channels}
        return replace(stream, frames={**stream.frames, **felt}) if felt else stream

    return recording.changed(said)


def resampled(time: Array, values: Array, grid: Array) -> Array:
    """Return the mean of `values` (N, k) over each step of the even `grid` (M,) [s], linear between samples."""
    flat = values.reshape(len(values), -1)
    step = float(grid[1] - grid[0])
    origin = flat.mean(0)
    area = np.cumsum(0.5 * np.diff(time)[:, None] * (flat[1:] + flat[:-1] - 2 * origin), 0)
    area = np.concatenate([np.zeros((1, flat.shape[1])), area])
    low, high = np.clip(grid - step / 2, time[0], time[-1]), np.clip(grid + step / 2, time[0], time[-1])
    edges = _area_at(time, flat - origin, area, np.concatenate([low, high]))
    width = np.maximum(high - low, 1e-12)[:, None]
    return np.asarray((edges[len(grid) :] - edges[: len(grid)]) / width + origin).reshape(len(grid), *values.shape[1:])


def _area_at(time: Array, values: Array, area: Array, at: Array) -> Array:
    """Return the integral (M, k) of the piecewise linear signal up to `at` (M,)."""
    left = np.clip(np.searchsorted(time, at, "right") - 1, 0, len(time) - 2)
    h = (at - time[left])[:, None]
    slope = (values[left + 1] - values[left]) / np.maximum(time[left + 1] - time[left], 1e-12)[:, None]
    return np.asarray(area[left] + h * values[left] + 0.5 * h**2 * slope)


def _of_table(recording: Recording, stream: Stream) -> Glance | None:
    felt = Felt.of(stream, recording.wrench_sign)
    wrench, rows = felt.values, len(stream)
    if any(len(s) != rows for s in recording.streams) or rows < 3:
        return None
    posed = _posed(recording, lambda _, values: values, wrench)
    if posed is None:
        return None
    rotation, place, pull, mirrored = posed
    return Glance(wrench, rotation, pull, None, np.arange(rows), None, felt.world, mirrored, position=place)


def _posed(
    recording: Recording, on_rows: OnRows, wrench: Array
) -> tuple[Array | None, Array | None, Array | None, Array | None] | None:
    """Return rotation, position, gravity in S and the same mirrored at the rows; None where nothing tells gravity."""
    rotation, place = (_first(recording, quantity, on_rows) for quantity in ("rotation", "position"))
    pull, mirrored = (None, None) if rotation is not None else _pulls(recording, on_rows, wrench)
    return None if rotation is None and pull is None else (rotation, place, pull, mirrored)


def _first(recording: Recording, quantity: str, on_rows: OnRows) -> Array | None:
    """Return the first channel that holds a quantity, at the rows of a glance; None where none does."""
    return next((on_rows(stream, values) for stream, _, values in recording.channels(quantity)), None)


def _pulls(recording: Recording, on_rows: OnRows, wrench: Array) -> tuple[Array | None, Array | None]:
    """Return gravity in S (N, 3) from a gravity channel, else from an accelerometer whose mount is known or found.

    Then the same with the wrench of the other sign, where the wrench itself decides how the accelerometer sits; None
    where there is neither.
    """
    found = next(recording.channels("gravity", "specific_force"), None)
    if found is None:
        return None, None
    stream, quantity, given = found
    values = on_rows(stream, given)
    if quantity == "gravity":
        return values if stream.turn is None else stream.turn.apply(values), None
    if stream.turn is not None:
        return -stream.turn.apply(values), None
    pull, mirrored = (-first_mount(values, None, sign * wrench[:, 3:]).apply(values) for sign in (1, -1))
    return pull, mirrored


def _of_clocks(recording: Recording, stream: Stream, like: Glance | None) -> Glance | None:
    timed = [s for s in recording.streams if s.time is not None and len(s) > 3]
    used = [s for s in timed if s is stream or {"rotation", "gravity", "specific_force", "position"} & set(s.channels)]
    if stream not in used:
        return None
    start, end = max(float(s.sampled[0]) for s in used), min(float(s.sampled[-1]) for s in used)
    rate = min(_RATE_HZ, _MOST_ROWS / max(end - start, 1e-9))
    rows = int((end - start) * rate)
    if rows < _FEWEST_ROWS or rate < 4 * CUTOFF_HZ:
        return None
    grid = np.asarray(start + (np.arange(rows) + 0.5) / rate, dtype=np.float64)

    def on_grid(s: Stream, values: Array) -> Array:
        return resampled(s.sampled, values, grid)

    raw = Felt.of(stream, recording.wrench_sign)
    calm = _calm(stream) if like is None or like.calm is None else like.calm
    wrench = np.where(recording.dead, 0.0, resampled(stream.sampled[calm], raw.values[calm], grid))
    seen = replace(recording, streams=tuple(used))
    posed = _posed(seen, on_grid, wrench)
    if posed is None:
        return None
    rotation, place, pull, mirrored = posed
    acceleration = _acceleration(recording, rotation, on_grid, rate)
    block = np.minimum(np.arange(rows) * _BLOCKS // rows, _BLOCKS - 1)
    kept = ~inside(grid, _unseen(stream.rows(calm), [s for s in used if s is not stream]))
    whole = bool(kept.all()) or int(kept.sum()) < _FEWEST_ROWS
    felt = None if rotation is None else _first(seen, "specific_force", on_grid)
    return Glance(
        wrench, rotation, pull, acceleration, block if whole else block[kept], rate, raw.world, mirrored, felt,
        recording.dead, place, None if whole else kept, calm,
    )  # fmt: skip


def _unseen(felt: Stream, others: list[Stream]) -> Array:
    """Return the times (K, 2) [s] in which no row of a stream is near: of the wrench, or of others in motion."""
    missing = [holes(felt) - (felt.delay or 0.0), *(unknown_motion(s) - (s.delay or 0.0) for s in others)]
    return merged(*(gaps + np.array([-_SMEAR_S, _SMEAR_S]) for gaps in missing))


def _acceleration(recording: Recording, rotation: Array | None, on_grid: OnRows, rate: float) -> Array | None:
    """Return the acceleration (N, 3) of the S origin in W from the first channel that tells it."""
    if rotation is None:
        return None
    for stream, quantity, values in recording.channels("linear_acceleration", "linear_velocity", "position"):
        if stream.time is None:
            continue
        smooth = on_grid(stream, values)
        if not stream.in_world(quantity):
            smooth = np.einsum("nij,nj->ni", rotation, smooth)
        for _ in range({"linear_acceleration": 0, "linear_velocity": 1, "position": 2}[quantity]):
            smooth = np.gradient(smooth, 1 / rate, axis=0)
        return np.asarray(smooth)
    return None
