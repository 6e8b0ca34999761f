"""Least squares with each block of rows left out in turn, and what that tells of the error: the jackknife.

Source: Efron and Tibshirani 1993, chapter 11.
"""

from __future__ import annotations

import numba
import numpy as np

from steelyard.check import Array, Integers
from steelyard.identify.cost.dense import times
from steelyard.identify.cost.linear import pseudo_inverse

# Columns that hold less than this of all squares say nothing.
NOTHING = 1e-200


def block_scatter(rows: Array, block: Integers) -> Array:
    """Return the scatter (B, k, k) of the rows (N, c, k) of each block (N,), lowest number first."""
    _, index, counts = np.unique(block, return_inverse=True, return_counts=True)
    place = np.empty(len(rows), np.int64)
    place[np.argsort(index, kind="stable")] = np.arange(len(rows)) - np.repeat(np.cumsum(counts) - counts, counts)
    # Blocks are about as long as one another: with zeros behind the shorter ones one product does for all.
    filled = np.zeros((len(counts), int(counts.max()), *rows.shape[1:]))
    filled[index, place] = rows
    flat = filled.reshape(len(counts), -1, rows.shape[2])
    return np.asarray(np.swapaxes(flat, 1, 2) @ flat)


@numba.njit(cache=True)
def solutions(scatter: Array, tolerance: float, ridge: float) -> Array:
    """Return x (B, k) of least squares by scatters (B, k + 1, k + 1) of k columns and the values that these explain.

    tolerance  directions below this share of the largest are left at zero, columns scaled to one
    ridge      share of all squares that is added to the square of each column
    """
    count, size = scatter.shape[0], scatter.shape[1] - 1
    out, matrix, right = np.zeros((count, size)), np.empty((size, size)), np.empty(size)
    for b in range(count):
        whole = 0.0
        for i in range(size):
            right[i] = scatter[b, i, size]
            whole += scatter[b, i, i]
            for j in range(size):
                matrix[i, j] = scatter[b, i, j]
        if whole > NOTHING:
            for i in range(size):
                matrix[i, i] += ridge * whole
            x = times(pseudo_inverse(matrix, tolerance), right)
            for i in range(size):
                out[b, i] = x[i]
    return out


def jackknife(moved: Array) -> Array:
    """Return the covariance (k, k) that tells by how much answers move (B, k) as each of B blocks is left out."""
    return np.asarray((len(moved) - 1) / len(moved) * moved.T @ moved)
