"""Play of a sensor: its reading follows the load only once that has moved on by a half width; hysteresis, stiction.

While a channel's load rises the reading is too low, while it falls too high, and after a turn it stays behind until the
load has crossed the play. Real loops bend as plays of many widths in parallel do (Prandtl and Ishlinskii), each with a
share of its own that is not negative. In one motion that looks like a delay; what a delay does grows with speed, what
play does hangs on the way alone: they are fitted together.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numba import njit

from steelyard.check import Array, Mask
from steelyard.findings import Finding
from steelyard.inertia.regressor import design
from steelyard.logs.log import MotionLog
from steelyard.logs.moments import features
from steelyard.logs.recording import Recording, Stream
from steelyard.sanity.fitted.full_fit import Rows
from steelyard.sanity.fitted.misplaced import misplaced
from steelyard.sanity.fitted.sensor_matrix import sensor_matrix
from steelyard.sanity.words import shortly
from steelyard.spatial import cross_matrix

# Half widths of the plays in parallel, as shares of a channel's range.
WIDTHS = (0.0025, 0.005, 0.01, 0.02, 0.04, 0.08)
# The load that they hang on is fitted anew so often.
ROUNDS = 2
# It is sure beyond so many standard deviations, by leaving out stretches, and no delay where it leaves so much less of
# what lasts for a second: sound, late and filtered wrenches keep 0.97 of it.
SURE, SLOWLY = 4.0, 0.5
# What a loop is off by is found where it changes by less than so many standard deviations, or by this share.
SETTLED, ALIKE = 1.0, 0.02
REMEDY = "Reach poses from either side, so that it averages out, or weigh with a sensor that has less hysteresis."


@dataclass(frozen=True, eq=False)
class Play:
    """Play of the channels of a wrench, as they are read.

    half, std  (6,) what a reading is off by once all its plays are crossed, and standard deviations [tau N m, f N]
    time       (N,) [s] on the wrench clock
    off        (N, 6) what a reading is off by [tau N m, f N]
    to_sensor  (6, 6) what channels as read are in S, as applied to the object
    left       squared residual beside that without play
    slowly     squares that last for a second
    """

    half: Array
    std: Array
    time: Array
    off: Array
    to_sensor: Array
    left: float
    slowly: float

    @property
    def times(self) -> float:
        """How many standard deviations the surest channel plays by."""
        return float((self.half / np.maximum(self.std, 1e-300)).max())

    @property
    def by_channel(self) -> tuple[Play, ...]:
        """The play of each channel alone."""
        return tuple(replace(self, off=self.off * one) for one in np.eye(6))

    def told(self, log: MotionLog, drift: bool) -> bool:
        """Whether there is any, or a delay instead: it is sure, and leaves less than other causes in the log as read.

        These are a turned sensor, unlike gains, and another point.
        """
        if self.times <= SURE:
            return False
        others = sensor_matrix(log, drift), misplaced(log, drift)
        return all(other is None or self.left < other.left for other in others)

    def clear(self, slow: float) -> bool:
        """Whether it is play, no delay: it leaves far less of what lasts for a second than `slow`, left without it."""
        return self.slowly <= SLOWLY * slow

    def like(self, other: Play) -> bool:
        """Whether another play is the same but for what either may be off by."""
        return bool((np.abs(self.half - other.half) <= np.maximum(SETTLED * self.std, ALIKE * self.half)).all())

    def put_right(self, recording: Recording) -> Recording:
        """Return the recording with a wrench that has no play."""
        wrench = recording.stream_of("force", "torque")

        def right(stream: Stream) -> Stream:
            if stream is not wrench:
                return stream
            at = self._off_at(stream.sampled)
            torque, force = (stream.channels[name] for name in ("torque", "force"))
            return stream.with_channels(torque=torque - at[:, :3], force=force - at[:, 3:])

        return recording.changed(right)

    def back(self, log: MotionLog) -> MotionLog:
        """Return a log that was put right as it was read; one without a clock is as it was."""
        if log.time is None:
            return log
        return replace(log, wrench=np.asarray(log.wrench + self._off_at(log.time) @ self.to_sensor.T))

    def _off_at(self, time: Array) -> Array:
        return np.column_stack([np.interp(time, self.time, channel) for channel in self.off.T])

    @property
    def finding(self) -> Finding:
        """What is said of it."""
        torque, force = np.split(self.half, 2)
        text = (
            "The sensor's offset hangs on which way its load last went, as with hysteresis or play: half loops of "
            f"{shortly(force)} N and {shortly(torque)} N m along its x, y, z. The answer is without it, and its "
            "bars hold all that it did."
        )
        return Finding("bias-drift", text, REMEDY)


def play(log: MotionLog, whole: MotionLog, recording: Recording, drift: bool) -> Play | None:
    """Return the play that rows of `log` show; None without a clock, or where the wrench is not read in S.

    whole  all rows of which `log` has some: what a reading is off by hangs on all that went before
    """
    stream = recording.stream_of("force", "torque")
    if log.time is None or whole.time is None or stream is None or any(map(stream.in_world, ("force", "torque"))):
        return None
    rows, pick = Rows.of(log, drift)
    if not rows.split:
        return None
    M, once = _to_sensor(stream, recording.wrench_sign), rows.solve()
    at = np.searchsorted(whole.time, log.time[pick]).clip(max=len(whole) - 1)
    moved, solution = features(whole), once.solution
    for _ in range(ROUNDS):
        load = -moved @ np.einsum("pij,p->ji", design(True), solution[:16]) @ np.linalg.inv(M).T
        reach = np.ptp(load, axis=0)
        if not (reach > 0).all():
            return None
        plays = [M * _behind(load, width * reach)[at][:, None, :] for width in WIDTHS]
        late = np.gradient(load, whole.time, axis=0)[at] @ M.T
        columns = np.concatenate([*plays, late[:, :, None]], 2)
        kept = _not_negative(rows, columns)
        fit = rows.solve(columns[:, :, kept], jackknife=True)
        solution = fit.solution
    shares = np.zeros(len(kept))
    shares[kept] = fit.extra
    by_width = shares[:-1].reshape(-1, 6)
    channels = np.append(np.tile(np.eye(6), len(WIDTHS)), np.zeros((6, 1)), 1)[:, kept]
    std = np.sqrt(np.diag(channels @ fit.extra_covariance @ channels.T))
    off = np.zeros_like(load)
    for width, share in zip(WIDTHS, by_width, strict=True):
        off += _behind(load, width * reach) * share
    slowly = _alike(rows).slowly(fit, columns[:, :, kept])
    return Play(by_width.sum(0), std, whole.time, off, M, fit.beside(once), slowly)


def _not_negative(rows: Rows, columns: Array) -> Mask:
    """Return which columns (N, 6, k) stay so that no share of a play is negative; the delay, last, may be."""
    kept = np.ones(columns.shape[2], np.bool_)
    while True:
        negative = rows.solve(columns[:, :, kept]).extra < 0
        negative[-1] = False
        if not negative.any():
            return kept
        kept[np.flatnonzero(kept)[negative]] = False


def lasts(log: MotionLog, drift: bool) -> float:
    """Return the squares that last for a second of what one body with a steady bias leaves."""
    rows, _ = Rows.of(log, drift)
    return _alike(rows).slowly(rows.solve())


def _alike(rows: Rows) -> Rows:
    """Return the rows with weights that do not hang on how well they fit."""
    return replace(rows, weights=np.ones_like(rows.weights))


def _to_sensor(stream: Stream, sign: int) -> Array:
    """Return what channels as read (6,) are in S, as applied to the object (6, 6)."""
    T = np.eye(3) if stream.turn is None else stream.turn.matrix
    arm = np.zeros(3) if stream.arm is None else stream.arm
    return sign * np.block([[T, cross_matrix(arm) @ T], [np.zeros((3, 3)), T]])


@njit(cache=True)
def _behind(load, half):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Return by how many half widths (6,) of play a reading is behind loads (N, 6), where it begins in the middle."""
    out = np.zeros(load.shape)
    for c in range(load.shape[1]):
        read = load[0, c]
        for k in range(len(load)):
            read = min(max(read, load[k, c] - half[c]), load[k, c] + half[c])
            out[k, c] = (read - load[k, c]) / half[c]
    return out
