"""Which of two states each row is in, where a state costs something and so does going from one to another."""

from __future__ import annotations

import numba
import numpy as np

from steelyard.check import Array, Integers


@numba.njit(cache=True)
def cheapest_path(step: Array, cost: Array) -> Integers:
    """Return the state, 0 or 1, of each row (N,), at costs (N, 2) and those of a step (N - 1, 2, 2) from a to b."""
    rows = len(cost)
    came, path, total = np.zeros((rows, 2), np.int64), np.zeros(rows, np.int64), cost[:1].copy().reshape(-1)
    for k in range(1, rows):
        one, other = total + step[k - 1, :, 0], total + step[k - 1, :, 1]
        came[k, 0], came[k, 1] = int(one[1] < one[0]), int(other[1] < other[0])
        total[0], total[1] = min(one[0], one[1]) + cost[k, 0], min(other[0], other[1]) + cost[k, 1]
    if rows:
        path[rows - 1] = int(total[1] < total[0])
    for k in range(rows - 1, 0, -1):
        path[k - 1] = came[k, path[k]]
    return path
