"""Weighted linear least squares from scatter matrices: the ordinary estimators and the start of the others."""

from __future__ import annotations

import numba
import numpy as np

from steelyard.check import Array
from steelyard.identify.cost.dense import cholesky, eigen, inverse_of, mirror, product_transposed, times
from steelyard.identify.cost.noise_cost import add_products, entries, residual_map_of, weights_at

# Directions whose information, after scaling the columns to one, is below this share of the largest are left at zero.
RANK_TOLERANCE = 1e-12
_DIAGONAL = np.arange(10)
# Sizes [kg, m] that no held body exceeds by much: they keep what a log does not excite from running away.
HEAVIEST, LIGHTEST, FARTHEST, LOOSEST_RADIUS = 1000.0, 0.05, 2.0, 0.5


@numba.njit(cache=True)
def normal_equations(T: Array, scatter: Array, weights: Array) -> tuple[Array, Array]:
    """Return H (p, p) and g (p,) of sum r^T W r: design T (p, 6, Z), scatter (C, Z, Z), weights (C, 6, 6)."""
    size = T.shape[0]
    H = np.zeros((size, size))
    sparse = entries(T)
    for c in range(scatter.shape[0]):
        add_products(H, sparse, weights[c], scatter[c], 1.0)
    mirror(H)
    return H, right_side(T, scatter, weights)


@numba.njit(cache=True)
def right_side(T: Array, scatter: Array, weights: Array) -> Array:
    """Return g (p,) of `normal_equations`, from the same T (p, 6, Z), scatter (C, Z, Z) and weights (C, 6, 6)."""
    g = np.zeros(T.shape[0])
    start, row, column, value = entries(T)
    for c in range(scatter.shape[0]):
        for p in range(len(g)):
            for a in range(start[p], start[p + 1]):
                for i in range(6):
                    g[p] -= value[a] * weights[c, row[a], i] * scatter[c, column[a], 12 + i]
    return g


@numba.njit(cache=True)
def unit_diagonal(matrix: Array) -> tuple[Array, Array]:
    """Return a symmetric matrix scaled to a unit diagonal, and the scale (n,) of rows and columns that does so."""
    size = matrix.shape[0]
    scale, out = np.ones(size), np.empty((size, size))
    for i in range(size):
        if matrix[i, i] > 0.0:
            scale[i] = 1 / np.sqrt(matrix[i, i])
    for i in range(size):
        for j in range(size):
            out[i, j] = matrix[i, j] * scale[i] * scale[j]
    return out, scale


def solve_scaled(H: Array, g: Array) -> Array:
    """Return the least-norm x (p,) of H x = g after scaling H (p, p) to a unit diagonal."""
    return times(pseudo_inverse(H, RANK_TOLERANCE), g)


def reweighted(T: Array, scatter: Array, acceleration: Array, wrench: Array, passes: int) -> Array:
    """Return the linear parameters (p,) of `passes` weighted solutions, W renewed from each for the next.

    The data are the design T (p, 6, Z), the scatter (C, Z, Z) of every noise class, and the variances (C, 6) of its
    acceleration and its wrench, angular part and moment first. The first pass knows no parameters, so that W is that
    of the wrench noise alone.
    """
    linear = np.zeros(len(T))
    for _ in range(passes):
        H, g = normal_equations(T, scatter, weights_at(residual_map_of(T, linear), acceleration, wrench))
        linear = solve_scaled(H + loosest(linear), g)
    return linear


def loosest(linear: Array) -> Array:
    """Return the information (p, p) that keeps a body `linear` (p,) within the sizes of held ones; it hardly pulls."""
    mass = max(abs(float(linear[0])), LIGHTEST)
    out = np.zeros((len(linear), len(linear)))
    out[_DIAGONAL, _DIAGONAL] = np.repeat([HEAVIEST, mass * FARTHEST, mass * LOOSEST_RADIUS**2], [1, 3, 6]) ** -2
    return out


def fitted(H: Array, prior: Array) -> float:
    """Return how many numbers data of information H (p, p) fix beside a prior (p, p): the degrees that a fit takes.

    A column that the data leave empty (inertia at rest) takes none, however many poses there are.
    """
    return float(np.trace(inverse_scaled(H + prior) @ H))


def inverse_scaled(matrix: Array, tolerance: float = RANK_TOLERANCE) -> Array:
    """Return `pseudo_inverse`: a kernel that had a default would be compiled with it and without."""
    return pseudo_inverse(matrix, tolerance)


@numba.njit(cache=True)
def pseudo_inverse(matrix: Array, tolerance: float) -> Array:
    """Return the pseudo-inverse of a symmetric matrix (p, p) after scaling it to a unit diagonal.

    tolerance  directions with an eigenvalue below this share of the largest are left at zero
    """
    scaled, scale = unit_diagonal(matrix)
    size, trace = len(scale), 0.0
    low, positive = cholesky(scaled, tolerance)
    if positive:
        out = inverse_of(low)
        for i in range(size):
            trace += out[i, i]
            for j in range(size):
                out[i, j] *= scale[i] * scale[j]
        # No eigenvalue is below 1 / trace, none above the number of rows.
        if trace * size * tolerance < 1.0:
            return out
    values, vectors = eigen(scaled)
    left, right = np.zeros((size, size)), np.empty((size, size))
    for k in range(size):
        for i in range(size):
            right[i, k] = vectors[i, k] * scale[i]
            if values[k] > tolerance * values[-1]:
                left[i, k] = right[i, k] / values[k]
    return product_transposed(left, right)


def nonnegative(matrix: Array, reference: Array) -> Array:
    """Return a symmetric matrix (p, p), negative eigenvalues set to zero, scaled by the diagonal of `reference` (p, p).

    Noise taken out of a scatter matrix leaves directions that the log does not excite slightly below zero.
    """
    diagonal = np.diag(reference)
    scale = np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    scaled = 0.5 * (matrix + matrix.T) / (scale[:, None] * scale)
    if cholesky(scaled, RANK_TOLERANCE)[1]:
        return matrix
    values, vectors = eigen(scaled)
    if values[0] >= 0.0:
        return matrix
    right = np.ascontiguousarray(vectors * scale[:, None])
    return product_transposed(right * np.maximum(values, 0.0), right)


def without_bias(H: Array, V: Array) -> tuple[Array, Array, Array, Array]:
    """Return information and score variance (10, 10) of phi with the bias projected out, of H and V (p, p).

    Then how the bias of b = p - 10 numbers follows phi (b, 10), and its own covariance (b, b) at a given phi.
    """
    if len(H) == 10:
        return H, V, np.zeros((0, 10)), np.zeros((0, 0))
    own = inverse_scaled(H[10:, 10:].copy())
    follow = own @ H[10:, :10]
    project = np.concatenate([np.eye(10), -follow.T], 1)
    return np.ascontiguousarray((project @ H)[:, :10]), project @ V @ project.T, follow, own
