"""Play of a sensor: its reading follows the load only once that has moved on by a half width; hysteresis, stiction.

While a channel's load rises the reading is too low by the half width, while it falls too high, and after a turn it
stays where it was until the load has crossed the play. In one motion that looks like a delay; over many it does not.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numba import njit

from steelyard.check import Array
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

# Half widths are sought from this share of a channel's range on, and fitted anew so often.
START, ROUNDS = 0.005, 4
# No channel plays by less than the first or more than the second share of its range.
LEAST, MOST = 5e-4, 0.05
# It is sure beyond so many standard deviations, by leaving out stretches, where it leaves so much less of what lasts
# for a second: sound, late and filtered wrenches keep 0.97 of it. From the third on it is looked for closer.
SURE, SLOWLY, MAYBE = 8.0, 0.5, 3.0
MOST_SHARE = 0.85  # of a step that the next may still be: those that follow are made at once
SETTLED = 1.0  # standard deviations: half widths that change by less are found
REMEDY = "Reach poses from either side, so that it averages out, or weigh with a sensor that has less hysteresis."


@dataclass(frozen=True, eq=False)
class Play:
    """Play of the channels of a wrench, as they are read.

    half, std  (6,) half widths and their standard deviations [tau N m, f N]
    time       (N,) [s] on the wrench clock
    behind     (N, 6) by how many half widths a reading is off
    to_sensor  (6, 6) what channels as read are in S, as applied to the object
    left       squared residual beside that without play
    slowly     squares that last for a second
    """

    half: Array
    std: Array
    time: Array
    behind: Array
    to_sensor: Array
    left: float
    slowly: float

    @property
    def shows(self) -> bool:
        """Whether a channel plays, or seems to run ahead of its load, as where a delay was found in place of play."""
        return bool((np.abs(self.half) > MAYBE * self.std).any())

    @property
    def sure(self) -> bool:
        """Whether a channel plays beyond doubt, and none runs ahead of its load."""
        times = self.half / np.maximum(self.std, 1e-300)
        return bool(times.max() > SURE and times.min() > -SURE / 2)

    def explains(self, log: MotionLog, slow: float, drift: bool) -> bool:
        """Whether it leaves far less of what lasts for a second than `slow`, which no play leaves, and less than a
        turned sensor, unlike gains or another point do in the log as it was read.
        """
        others = sensor_matrix(log, drift), misplaced(log, drift)
        best = all(other is None or self.left < other.left for other in others)
        return self.sure and self.slowly <= SLOWLY * slow and best

    def like(self, other: Play) -> bool:
        """Whether another play is the same but for what either may be off by."""
        return bool((np.abs(self.half - other.half) <= SETTLED * self.std).all())

    @property
    def width(self) -> Array:
        """The half widths (6,) without those of channels that seem to run ahead."""
        return np.maximum(self.half, 0.0)

    def moved(self, before: Array, last: Array) -> Play:
        """Return the play that two steps (6,) of its half widths lead to if all that follow fall by the same share."""
        share = float(np.clip(last @ before / max(float(before @ before), 1e-300), 0.0, MOST_SHARE))
        return replace(self, half=self.half + last * share / (1 - share))

    def put_right(self, recording: Recording) -> Recording:
        """Return the recording with a wrench that has no play."""
        wrench = recording.stream_of("force", "torque")

        def right(stream: Stream) -> Stream:
            if stream is not wrench:
                return stream
            at = self._behind_at(stream.sampled) * self.width
            torque, force = (stream.channels[name] for name in ("torque", "force"))
            return stream.with_channels(torque=torque - at[:, :3], force=force - at[:, 3:])

        return recording.changed(right)

    def back(self, log: MotionLog) -> MotionLog:
        """Return a log that was put right as it was read; one without a clock is as it was."""
        if log.time is None:
            return log
        return replace(log, wrench=np.asarray(log.wrench + self._behind_at(log.time) * self.width @ self.to_sensor.T))

    def _behind_at(self, time: Array) -> Array:
        return np.column_stack([np.interp(time, self.time, channel) for channel in self.behind.T])

    @property
    def finding(self) -> Finding:
        """What is said of it."""
        torque, force = np.split(self.width, 2)
        text = (
            "The sensor's offset hangs on which way its load last went, as with hysteresis or play: half widths of "
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
    load = -features(whole) @ np.einsum("pij,p->ji", design(True), once.solution[:16]) @ np.linalg.inv(M).T
    reach = np.ptp(load, axis=0)
    if not (reach > 0).all():
        return None
    at = np.searchsorted(whole.time, log.time[pick]).clip(max=len(load) - 1)
    half = START * reach
    for last in reversed(range(ROUNDS)):
        behind = _behind(load, half)
        columns = M * behind[at][:, None, :]
        fit = rows.solve(columns, jackknife=not last)
        found = fit.extra
        if last:
            half = np.clip(found, LEAST * reach, MOST * reach)
    return Play(found, fit.extra_std, whole.time, behind, M, fit.beside(once), _alike(rows).slowly(fit, columns))


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
