"""Weighted linear least squares from scatter matrices: the ordinary estimators and the start of the others."""

from __future__ import annotations

import numba
import numpy as np

from steelyard.check import Array
from steelyard.identify.noise_cost import inner, multiply, weight

# Directions whose information, after scaling the columns to one, is below this share of the largest are left at zero.
RANK_TOLERANCE = 1e-12


@numba.njit(cache=True)
def normal_equations(T: Array, scatter: Array, weights: Array) -> tuple[Array, Array]:
    """Return H (p, p) and g (p,) of sum r^T W r: design T (p, 6, Z), scatter (C, Z, Z), weights (C, 6, 6)."""
    size = T.shape[0]
    H, g = np.zeros((size, size)), np.zeros(size)
    wrench = np.zeros((6, T.shape[2]))
    for i in range(6):
        wrench[i, 12 + i] = 1.0
    for c in range(scatter.shape[0]):
        for p in range(size):
            WTS = multiply(weights[c], multiply(T[p], scatter[c]))
            g[p] -= inner(WTS, wrench)
            for q in range(p + 1):
                H[p, q] += inner(WTS, T[q])
    for p in range(size):
        for q in range(p):
            H[q, p] = H[p, q]
    return H, g


@numba.njit(cache=True)
def solve_scaled(H: Array, g: Array) -> Array:
    """Return the least-norm x of H x = g after scaling H to a unit diagonal."""
    scale = np.ones(H.shape[0])
    for i in range(H.shape[0]):
        if H[i, i] > 0.0:
            scale[i] = 1 / np.sqrt(H[i, i])
    values, vectors = np.linalg.eigh(H * np.outer(scale, scale))
    projected = vectors.T @ (scale * g)
    for i in range(len(values)):
        projected[i] = projected[i] / values[i] if values[i] > RANK_TOLERANCE * values[-1] else 0.0
    return scale * (vectors @ projected)


@numba.njit(cache=True)
def reweighted(T: Array, scatter: Array, acceleration: Array, wrench: Array, passes: int) -> Array:
    """Return the linear parameters (p,) of `passes` weighted solutions, W renewed from each for the next.

    The first pass knows no parameters, so that W is that of the wrench noise alone.
    """
    size, width = T.shape[0], T.shape[2]
    linear = np.zeros(size)
    weights = np.zeros((scatter.shape[0], 6, 6))
    for _ in range(passes):
        K = np.zeros((6, width))
        for p in range(size):
            if linear[p] != 0.0:
                K += linear[p] * T[p]
        for c in range(scatter.shape[0]):
            weights[c] = weight(K, acceleration[c], wrench[c])
        H, g = normal_equations(T, scatter, weights)
        linear = solve_scaled(H, g)
    return linear
