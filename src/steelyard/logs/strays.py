"""Single rows that are wrong: away from the rows before them for a few rows, and back where those were.

A message that was lost and came as zeros, a tracker that jumped, a spike. How far a row leaps is judged against the
usual steps of the same numbers.
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from steelyard.check import Array, Mask
from steelyard.logs.middles import median, quantile

# A leap is so many times the step that this share of the rows do not exceed, so large a share of the range, and so many
# times the smallest step there is: what coarse numbers do at rest is none.
STEPS, USUAL, RANGE, QUANTA = 4.0, 0.75, 0.02, 4.0
# Of each step the middle one of so many around it is how things move.
AROUND = 9
# So many rows at most, and so long [s], are away, by more than a leap and so many times what lies between the rows
# beside. A single row may last longer, but for SLOWEST: an arm goes away and back in that time.
LONGEST, SECONDS, BACK, SLOWEST = 4, 0.06, 5.0, 0.25
# Where more than this share of the rows leap they are read wrongly, or were recorded one by one.
MOST = 0.1
# Rows that tell usual steps.
FEWEST = 50


def strays(values: Array, step: float, least: float = 0.0) -> Mask:
    """Return which rows of numbers (N, K), `step` [s] apart, are away from those on both sides, which agree.

    least  by how much they are away at the least, in the unit of the numbers

    Of the first and last rows those are that one leap parts from all others. None are where rows leap often, or are few
    or far apart.
    """
    rows = len(values)
    away = np.zeros(rows, np.bool_)
    if rows < FEWEST or step > SLOWEST or not _stand_out(values):
        return away
    path = _leaps(values, least)
    leaps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    far = leaps > 1
    if not far.any() or far.sum() > MOST * rows:
        return away
    longest = min(LONGEST, int(SECONDS / step))
    for length in range(1, 1 + max(1, longest)):
        before = np.flatnonzero(far[:-length] & far[length:])
        smaller = np.minimum(leaps[before], leaps[before + length])
        found = before[smaller > BACK * np.linalg.norm(path[before + length + 1] - path[before], axis=1)]
        away[(found[:, None] + 1 + np.arange(length)).ravel()] = True
    # Those at the ends have rows to agree with on one side alone: one leap parts them, and none is near.
    left = far & ~away[:-1] & ~away[1:]
    first, last = np.flatnonzero(left[:AROUND]), np.flatnonzero(left[::-1][:AROUND])
    if len(first) == 1 and first[0] < longest:
        away[: first[0] + 1] = True
    if len(last) == 1 and last[0] < longest:
        away[rows - 1 - last[0] :] = True
    return away


def _stand_out(values: Array) -> bool:
    """Return whether some row may leap: at a fraction of what it takes to tell."""
    bends = np.linalg.norm(np.diff(values, 2, axis=0), axis=1)
    return bool(bends.max() > STEPS * quantile(bends, USUAL))


def _leaps(values: Array, least: float) -> Array:
    """Return numbers (N, K) without how they move, in leaps, each `least` or more."""
    steps = np.diff(values, axis=0)
    size = np.linalg.norm(steps, axis=1)
    padded = np.pad(steps, ((AROUND // 2, AROUND // 2), (0, 0)), "reflect")
    steps = steps - median(sliding_window_view(padded, AROUND, axis=0))
    low, high = np.quantile(values, [0.02, 0.98], axis=0)
    leap = max(
        least,
        STEPS * float(quantile(np.linalg.norm(steps, axis=1), USUAL)),
        RANGE * float(np.linalg.norm(high - low)),
        QUANTA * float(size[size > 0].min()),
    )
    return np.concatenate([np.zeros_like(steps[:1]), np.cumsum(steps, axis=0)]) / leap
