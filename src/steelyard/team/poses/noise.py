"""Noise of every robot's poses from the residuals of the joint fit."""

from __future__ import annotations

from functools import lru_cache

import numba
import numpy as np

from steelyard.check import Array
from steelyard.team.definite import inverses_by_pivots

ROUNDS = 60
# [rad], [m] what encoders resolve at best: noise is not taken below it.
LEAST = 1e-7
# Scoring ends where noise changes by less than this share: the step after would change it by about its square.
SETTLED = 1e-4
# That robots of a team err alike counts as much as so many rows.
ALIKE = 1.0


def noise_of_scatter(scatter: Array, rows: float, J: Array, noise: Array) -> Array:
    """Return the standard deviations (N, 2) of turns and places from the scatter (6 N, 6 N) of so many `rows`.

    Those of residuals of a joint fit, or of measured twists: the payload's motion takes up six combinations of them, by
    J (N, 6, 6) per motion, so that their scatter is that of (1 - J A^-1 J^T W) n. noise (N, 2) to begin with.
    Restricted maximum likelihood by Fisher scoring, with a faint belief that the robots of a team err alike: two grasps
    alone tell the sum of their noise, not who makes it.
    Source: Patterson and Thompson 1971.
    """
    count = len(noise)
    if not rows:
        return noise
    stack = np.ascontiguousarray(J).reshape(6 * count, 6)
    variance = _scored(np.ascontiguousarray(scatter), rows, stack, noise.ravel() ** 2, _likeness(count))
    return np.asarray(np.sqrt(variance).reshape(count, 2))


@lru_cache(maxsize=8)
def _likeness(count: int) -> Array:
    """Return the information (2 N, 2 N) that robots err alike, about logarithms of their variances."""
    out = np.asarray(ALIKE * np.kron(np.eye(count) - 1 / count, np.eye(2)))
    out.flags.writeable = False
    return out


@numba.njit(cache=True, error_model="numpy")
def _scored(scatter: Array, rows: float, stack: Array, variance: Array, likeness: Array) -> Array:
    """Return the variances (2 N,) where scoring from `variance` ends; stack (6 N, 6), likeness (2 N, 2 N)."""
    parts = len(variance)
    pulled, held = np.empty(stack.shape), np.empty((1, 6, 6))
    seen, size, curve = np.empty(parts), np.empty(parts), np.empty((parts, parts))
    for _ in range(ROUNDS):
        for a in range(len(stack)):
            pulled[a] = stack[a] / variance[a // 3]
        held[0] = pulled.T @ stack
        _scores(scatter, variance, pulled, pulled @ inverses_by_pivots(held)[0][0], seen, size, curve)
        slope = 0.5 * variance * (seen - rows * size) - likeness @ np.log(variance)
        for i in range(parts):
            curve[i] = 0.5 * rows * variance[i] * variance * curve[i] + likeness[i]
        ridge = 1e-9 * np.trace(curve) / parts
        for i in range(parts):
            curve[i, i] += ridge
        change = np.linalg.solve(curve, slope)
        new = np.maximum(variance * (1 + np.maximum(change, -0.9)), LEAST**2)
        moved = np.abs(np.log(new / variance)).max()
        variance = new
        if moved < SETTLED:
            break
    return variance


@numba.njit(cache=True, error_model="numpy")
def _scores(
    scatter: Array, variance: Array, pulled: Array, lever: Array, seen: Array, size: Array, squares: Array
) -> None:
    """Write, for every part of three rows, the traces of M S M (2 N,) and of M (2 N,), and the squares (2 N, 2 N) of M.

    M = W - lever pulled^T (6 N, 6 N), with W = 1 / variance on its diagonal, S the scatter. M is never made: all that
    is asked follows from six columns.
    """
    rows, parts = len(pulled), len(variance)
    shared, inner = np.zeros((6, rows)), np.zeros((6, 6))
    left, right = np.zeros((parts, 36)), np.zeros((36, parts))
    for a in range(rows):
        for k in range(6):
            share = pulled[a, k]
            for b in range(rows):
                shared[k, b] += share * scatter[a, b]
    for k in range(6):
        for b in range(rows):
            for m in range(6):
                inner[k, m] += shared[k, b] * pulled[b, m]
    seen[:], size[:], squares[:] = 0.0, 0.0, 0.0
    for a in range(rows):
        part, w = a // 3, 1 / variance[a // 3]
        along, back, twice = 0.0, 0.0, 0.0
        for k in range(6):
            along += lever[a, k] * pulled[a, k]
            back += lever[a, k] * shared[k, a]
            for m in range(6):
                twice += lever[a, k] * inner[k, m] * lever[a, m]
                left[part, 6 * k + m] += lever[a, k] * lever[a, m]
                right[6 * k + m, part] += pulled[a, k] * pulled[a, m]
        seen[part] += w * (w * scatter[a, a] - 2 * back) + twice
        size[part] += w - along
        squares[part, part] += w * (w - 2 * along)
    for i in range(parts):
        for k in range(36):
            share = left[i, k]
            for j in range(parts):
                squares[i, j] += share * right[k, j]
