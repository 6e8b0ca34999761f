"""Which of two states each row is in, where a state costs something and so does going from one to another."""

from __future__ import annotations

import numba
import numpy as np

from steelyard.check import Array, Integers


@numba.njit(cache=True)
def cheapest_path(step: Array, cost: Array) -> Integers:
    """Return the state, 0 or 1, of each row (N,), at costs (N, 2) and those of a step (N - 1, 2, 2) from a to b."""
    rows = len(cost)
    came, path = np.empty((rows, 2), np.int64), np.empty(rows, np.int64)
    if rows == 0:
        return path
    zero, one = cost[0, 0], cost[0, 1]
    for k in range(1, rows):
        stayed, fell = zero + step[k - 1, 0, 0], one + step[k - 1, 1, 0]
        rose, held = zero + step[k - 1, 0, 1], one + step[k - 1, 1, 1]
        came[k, 0], came[k, 1] = int(fell < stayed), int(held < rose)
        zero, one = min(stayed, fell) + cost[k, 0], min(rose, held) + cost[k, 1]
    path[rows - 1] = int(one < zero)
    for k in range(rows - 1, 0, -1):
        path[k - 1] = came[k, path[k]]
    return path
