"""Stacks of small positive definite matrices, by Cholesky: a library's call costs more than such a matrix itself."""

from __future__ import annotations

import numba
import numpy as np

from steelyard.check import Array, Mask


def inverses(stack: Array) -> tuple[Array, Array]:
    """Return the inverses (..., n, n) and the logarithms of the determinants (...) of symmetric matrices (..., n, n).

    Where one is not positive definite, or not for sure, they are those of its general factors.
    """
    flat = stack.reshape(-1, *stack.shape[-2:])
    inverse, logdet = inverses_by_pivots(flat)
    doubtful = np.isnan(logdet)
    if doubtful.any():
        inverse[doubtful], logdet[doubtful] = np.linalg.inv(flat[doubtful]), np.linalg.slogdet(flat[doubtful])[1]
    return inverse.reshape(stack.shape), logdet.reshape(stack.shape[:-2])


def logarithms(stack: Array) -> Array:
    """Return the logarithms of the determinants (L,) of symmetric (L, n, n): a fifth of the work of `inverses`.

    Where one is not positive definite, or not for sure, it is that of its general factors.
    """
    logdet = logarithms_by_pivots(stack)
    doubtful = np.isnan(logdet)
    if doubtful.any():
        logdet[doubtful] = np.linalg.slogdet(stack[doubtful])[1]
    return logdet


def shown_axes(H: Array, rank: float) -> tuple[Array, Array]:
    """Return A (P, Q) and v (Q,) with A diag(1 / v) A^T the pseudoinverse of equations (P, P) that may not show all.

    rank  share of the largest eigenvalue, with a diagonal of ones, below which one is rounding
    """
    scale = 1 / np.sqrt(np.maximum(np.diag(H), 1e-300))
    values, vectors = np.linalg.eigh(H * np.outer(scale, scale))
    told = values > rank * values[-1]
    return scale[:, None] * vectors[:, told], values[told]


@numba.njit(cache=True, error_model="numpy")
def logarithms_by_pivots(stack: Array) -> Array:
    """Return the logarithms of the determinants (L,), NaN where a matrix is not definite."""
    out, root = np.zeros(len(stack)), np.empty(stack.shape[1:])
    for k in range(len(stack)):
        if not _factor(stack[k], root):
            out[k] = np.nan
            continue
        for i in range(len(root)):
            out[k] += 2 * np.log(root[i, i])
    return out


def definite(stack: Array) -> Mask:
    """Return which of symmetric matrices (L, n, n) are positive definite, by the signs of their pivots."""
    return ~np.isnan(logarithms_by_pivots(stack))


@numba.njit(cache=True, error_model="numpy")
def inverses_by_pivots(stack: Array) -> tuple[Array, Array]:
    """Return inverses (L, n, n) and logarithms of determinants (L,), both NaN where a matrix is not definite."""
    size = stack.shape[1]
    out, logdet, root = np.empty(stack.shape), np.zeros(len(stack)), np.empty((size, size))
    for k in range(len(stack)):
        if not _factor(stack[k], root):
            out[k], logdet[k] = np.nan, np.nan
            continue
        for i in range(size):
            logdet[k] += 2 * np.log(root[i, i])
        _invert(root)
        for i in range(size):
            for j in range(i + 1):
                total = 0.0
                for m in range(i, size):
                    total += root[m, i] * root[m, j]
                out[k, i, j] = out[k, j, i] = total
    return out, logdet


@numba.njit(cache=True, error_model="numpy")
def _factor(A: Array, root: Array) -> bool:
    """Write the lower factor of A = root root^T; return whether all its pivots are above zero."""
    for i in range(len(A)):
        for j in range(i + 1):
            total = A[i, j]
            for m in range(j):
                total -= root[i, m] * root[j, m]
            if i > j:
                root[i, j] = total / root[j, j]
            elif total > 0:
                root[i, i] = np.sqrt(total)
            else:
                return False
    return True


@numba.njit(cache=True, error_model="numpy")
def _invert(root: Array) -> None:
    """Put the inverse of a lower triangle in its place."""
    for j in range(len(root)):
        root[j, j] = 1 / root[j, j]
        for i in range(j + 1, len(root)):
            total = 0.0
            for m in range(j, i):
                total -= root[i, m] * root[m, j]
            root[i, j] = total / root[i, i]
