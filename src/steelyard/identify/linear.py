"""Weighted linear least squares from scatter matrices: the ordinary estimators and the start of the others."""

from __future__ import annotations

import numba
import numpy as np

from steelyard.check import Array
from steelyard.identify.noise_cost import inner, multiply, weight

# Directions whose information, after scaling the columns to one, is below this share of the largest are left at zero.
RANK_TOLERANCE = 1e-12
# Sizes [kg, m] that no held body exceeds by much: they keep what a log does not excite from running away.
HEAVIEST, LIGHTEST, FARTHEST, LOOSEST_RADIUS = 1000.0, 0.05, 2.0, 0.5


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
        mass = max(abs(linear[0]), LIGHTEST)
        H[0, 0] += HEAVIEST**-2
        for k in range(1, 4):
            H[k, k] += (mass * FARTHEST) ** -2
        for k in range(4, 10):
            H[k, k] += (mass * LOOSEST_RADIUS**2) ** -2
        linear = solve_scaled(H, g)
    return linear


@numba.njit(cache=True)
def inverse_scaled(matrix: Array) -> Array:
    """Return the pseudo-inverse of a symmetric matrix after scaling it to a unit diagonal."""
    size = matrix.shape[0]
    scale = np.ones(size)
    for i in range(size):
        if matrix[i, i] > 0.0:
            scale[i] = 1 / np.sqrt(matrix[i, i])
    values, vectors = np.linalg.eigh(matrix * np.outer(scale, scale))
    inverse = np.zeros(size)
    for i in range(size):
        if values[i] > RANK_TOLERANCE * values[-1]:
            inverse[i] = 1 / values[i]
    out: Array = (vectors * inverse) @ vectors.T * np.outer(scale, scale)
    return out


@numba.njit(cache=True)
def nonnegative(matrix: Array, reference: Array) -> Array:
    """Return a symmetric matrix with negative eigenvalues set to zero, scaled by the diagonal of `reference`.

    Noise taken out of a scatter matrix leaves directions that the log does not excite slightly below zero.
    """
    scale = np.ones(matrix.shape[0])
    for i in range(matrix.shape[0]):
        if reference[i, i] > 0.0:
            scale[i] = np.sqrt(reference[i, i])
    outer = np.outer(scale, scale)
    values, vectors = np.linalg.eigh(0.5 * (matrix + matrix.T) / outer)
    if values[0] >= 0.0:
        return matrix
    out: Array = (vectors * np.maximum(values, 0.0)) @ vectors.T * outer
    return out
