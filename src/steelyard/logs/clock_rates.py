"""Clocks that run fast or slow beside the wrench's: a delay that grows along the log.

The fit starts in the middle, where one delay still holds, and grows outward, so that a clock may be off by far more at
the ends than a motion lasts.
Source: own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array
from steelyard.logs.clock_fit import LEFT, ROWS, SURE, ClockCourse, holding, settled, share_left
from steelyard.logs.delays import Question
from steelyard.logs.recording import Recording
from steelyard.logs.runs import picked

# A clock that is called is off at the ends by so much [s], and by no more than a clock or a noted rate may be [s/s].
LEAST_S, LARGEST = 5e-5, 0.05
# The first stretch is at least this long on either side of the middle [s]; each is twice as long as the one before.
_FIRST_S = 4.0
# Rows that a stretch must have.
_FEWEST = 100


@dataclass(frozen=True)
class ClockRate(ClockCourse):
    """Stamps that are late by `late` [s] at `middle` [s], and from there by a rate `more` [s/s] more."""

    WIDTH = 0.02

    def course(self, time: Array) -> Array:
        """Return the time (N,) [s] since the middle."""
        return np.asarray(time - self.middle)

    def right(self, stamps: Array) -> Array:
        """Return stamps (N,) [s] as a clock of the right rate had given them, as late as this one was at the first."""
        true = self.middle + (stamps - self.late - self.middle) / (1 + self.more)
        return np.asarray(true + self.at(true[:1]))


def clock_rates(question: Question, delays: Mapping[str, float]) -> dict[str, ClockRate]:
    """Return the clocks of streams that surely run fast or slow beside the wrench's, by stream.

    delays  [s] of every stream, as one delay for the whole log; the question says which were sought
    """
    names = question.others
    time = question.time
    middle, full = 0.5 * float(time[0] + time[-1]), 0.5 * float(time[-1] - time[0])
    if not names or full <= 0:
        return {}
    start = {n: ClockRate(delays[n], 0.0, middle) for n in names}
    found, half = start, full
    while half > 2 * _FIRST_S:
        half /= 2
    while half <= full:
        rows = np.flatnonzero(np.abs(time - middle) <= half * (1 + 1e-9)).astype(np.int64)
        if len(rows) >= _FEWEST:
            found = settled(question.rows(rows[picked(len(rows), ROWS)]), start, found)
        half *= 2
    every = question.thinned(ROWS)
    if not share_left(every, start, found) < LEFT:
        return {}
    least = LEAST_S / full
    sure = {n: f for n, f in found.items() if max(SURE * f.more_std, least) < abs(f.more) < LARGEST}
    if not sure:
        return {}
    return holding(every, start, found, sure)


def put_right(recording: Recording, rates: Mapping[str, ClockRate]) -> Recording:
    """Return the recording with the stamps of these streams put right; they stay as late as they begin."""
    return recording.changed(lambda s: replace(s, time=rates[s.name].right(s.stamps)) if s.name in rates else s)
