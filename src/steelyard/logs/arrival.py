"""Stamps of arrival: rows that wait in a buffer are stamped late, never early, and then come together.

Whatever else is late or lost, a row of a steady rate was sampled a step or more before the next one. So a stamp less a
step per row bounds when each earlier row was sampled, and the least bound is the time of all that waited: the lower
envelope of one-way clock filters (Zhang, Liu, Xia 2002), by a suffix minimum, which rows that were lost leave true.
"""

from __future__ import annotations

import numpy as np

from steelyard.check import Array, Mask
from steelyard.logs.runs import runs

# Steps are told by stretches of so many rows, anew in so long [s] and so many; where the median step is so much shorter
# than these say, most rows waited.
_STRETCH, _ANEW_S, _ANEW, _MOSTLY = 100, 5.0, 300, 0.9
# A step is taken for shorter by so much, in rounds: one that is too long would draw a whole log together.
_SHORTER = (0.02, 0.005, 0.001)
# Rows are late together where they are by more than so many steps. They waited where one is late by so many; that must
# be most of all that rows are late by, else stamps jitter.
_BESIDE, _LATE, _MOST = 0.5, 1.5, 0.5
# What waited comes together: so much of what rows catch up by is made up in steps of so little of one. Rows of a rate
# that is not steady, whose stamps are right, catch up in longer ones as well.
_QUICK, _QUICKLY = 0.3, 0.8


def when_sampled(time: Array) -> tuple[Array, Array] | None:
    """Return stamps (N,) [s] without what rows waited for: of these rows alone, and with others as prompt as the best.

    None where rows do not look as if they had waited.

    time  (N,) [s], rising, of some hundred rows or more
    """
    step = _step(time, np.ones(len(time) - 1), median=True)
    for shorter in _SHORTER:
        bound = _bound(time, (1 - shorter) * step)
        step = _step(bound, np.maximum(np.round(np.diff(bound) / step), 1.0))
    waited = _waited(time, bound, step)
    if not waited.any():
        return None
    # Others are late as well, by what they jitter.
    usual = float(np.median((time - bound)[~waited]))
    return np.where(waited, np.minimum(bound + usual, time), time), bound


def _step(time: Array, counts: Array, median: bool = False) -> Array:
    """Return the local step (N - 1,) [s] of stamps (N,) whose steps are so many (N - 1,), or a little less.

    median  take the median step where it is not far from what stretches say
    """
    index = np.concatenate([[0.0], np.cumsum(counts)])
    ahead = min(_STRETCH, len(time) // 4)
    long = (time[ahead:] - time[:-ahead]) / (index[ahead:] - index[:-ahead])
    pieces = max(min(int((time[-1] - time[0]) / _ANEW_S), len(long) // _ANEW), 1)
    found = np.array([np.median(part) for part in np.array_split(long, pieces)])
    if median:
        short = np.array([np.median(part) for part in np.array_split(np.diff(time), pieces)])
        found = np.where(short > _MOSTLY * found, np.minimum(short, found), found)
    beside = np.concatenate([found[:1], found, found[-1:]])
    least = np.minimum(np.minimum(beside[:-2], beside[2:]), found)
    return np.repeat(least, [len(part) for part in np.array_split(counts, pieces)])


def _bound(time: Array, step: Array) -> Array:
    """Return the latest time (N,) [s] at which each row was sampled, by all later stamps and the steps (N - 1,)."""
    since = np.concatenate([[0.0], np.cumsum(step)])
    return np.asarray(np.minimum.accumulate((time - since)[::-1])[::-1] + since)


def _waited(time: Array, bound: Array, step: Array) -> Mask:
    """Return which rows (N,) waited; none unless most that are late come together, close behind one another."""
    late = np.append((time - bound) / np.append(step, step[-1]), 0.0)
    together = runs(late > _BESIDE)
    none = np.zeros(len(time), np.bool_)
    if not len(together):
        return none
    waited = np.maximum.reduceat(late, together.ravel())[::2] > _LATE
    total = np.add.reduceat(late, together.ravel())[::2]
    if not total[waited].sum() > _MOST * total.sum():
        return none
    rows = none.copy()
    rows[late[:-1] > _BESIDE] = np.repeat(waited, np.ptp(together, axis=1))
    steps = np.append(np.diff(time) / step, 1.0)[rows]
    caught = np.maximum(1 - steps, 0.0)
    return rows if caught[steps < _QUICK].sum() > _QUICKLY * caught.sum() else none
