"""What lasts in a residual: means over a second, in which white noise hardly shows.

Errors of a sensor or an arm that come back with the motion, as of hysteresis, fall on any column of a fit a little, and
alike in all stretches of a log, so that leaving these out does not show it. But their cause leaves little of them.
"""

from __future__ import annotations

import numpy as np

from steelyard.check import Array, Integers

_SMALLEST = 1e-9


def lasting(miss: Array, at: Integers) -> float:
    """Return the sum of squares of residuals (N, k) in means over the rows of each number in `at` (N,)."""
    total = np.zeros((int(at.max()) + 1, miss.shape[1]))
    np.add.at(total, at, miss)
    return float((total**2 / np.maximum(np.bincount(at), 1)[:, None]).sum())


def clear(plain: Array, fitted: Array, at: Integers, free: float = 1.0) -> float:
    """Return how many times as much a fit explains of what lasts as it leaves, white noise left out of account.

    What it leaves is told from white noise no better than by what chance makes of that: a standard deviation of it.

    plain, fitted  residuals (N, k) without what may be the cause, and with it
    at             (N,) the second that each row is in
    free           share of the rows that are independent where noise is white
    """
    left, seconds = lasting(fitted, at), int(at.max()) + 1
    white = float((fitted**2).sum()) * seconds / (free * len(at))
    chance = white * float(np.sqrt(2 / (fitted.shape[1] * seconds)))
    return (lasting(plain, at) - left) / max(left - white, chance, _SMALLEST * left, 1e-300)
