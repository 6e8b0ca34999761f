"""Single rows that are wrong: away from the rows before them for a few rows, and back where those were."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from steelyard.check import Array, Integers, Mask

# So many rows at most are away, by more than a leap and so many times what lies between the rows beside.
LONGEST, BACK = 4, 5.0
# Where more than this share of the rows leap they are read wrongly, or were recorded one by one.
MOST = 0.1

Apart = Callable[[Integers, Integers], Array]


def strays(rows: int, apart: Apart) -> Mask:
    """Return which of so many rows (N,) are away from those on both sides, which agree; none where rows leap often.

    Of the first and last rows those are that a leap parts from all others.

    apart  says how far two rows each (K,), (K,) are apart, in leaps (K,)
    """
    row, away = np.arange(rows), np.zeros(rows, np.bool_)
    steps = apart(row[:-1], row[1:])
    leaps = steps > 1
    if not leaps.any() or leaps.sum() > MOST * len(steps):
        return away
    for length in range(1, LONGEST + 1):
        before = np.flatnonzero(leaps[:-length] & leaps[length:])
        smaller = np.minimum(steps[before], steps[before + length])
        found = before[smaller > BACK * apart(before, before + length + 1)]
        away[(found[:, None] + 1 + np.arange(length)).ravel()] = True
    # Those at the ends have rows to agree with on one side alone.
    alone = np.flatnonzero(leaps & ~away[:-1] & ~away[1:])
    away[: alone[alone < LONGEST].max(initial=-1) + 1] = True
    away[alone[alone >= rows - 1 - LONGEST].min(initial=rows) + 1 :] = True
    return away
