"""Small dense linear algebra for compiled kernels: plain loops over C-ordered matrices of at most some twenty rows.

A compiled function carries everything it calls, so that an array expression in one of them is paid for in all that use
it: broadcasting alone costs more to compile than a whole kernel of loops. Here each operation is compiled once, for one
kind of array, and is small enough to be carried along.
"""

from __future__ import annotations

import numba
import numpy as np

from steelyard.check import Array


@numba.njit(cache=True)
def eigen(matrix: Array) -> tuple[Array, Array]:
    """Return the eigenvalues (n,), ascending, and eigenvectors (n, n), in columns, of a symmetric matrix."""
    return np.linalg.eigh(matrix)


@numba.njit(cache=True)
def add_product(out: Array, a: Array, b: Array) -> None:
    """Add a b to `out` (n, m), with a (n, k) and b (k, m); zeros in a cost nothing."""
    for i in range(a.shape[0]):
        for k in range(a.shape[1]):
            value = a[i, k]
            if value != 0.0:
                for j in range(b.shape[1]):
                    out[i, j] += value * b[k, j]


@numba.njit(cache=True)
def product(a: Array, b: Array) -> Array:
    """Return a b (n, m) of a (n, k) and b (k, m)."""
    out = np.zeros((a.shape[0], b.shape[1]))
    add_product(out, a, b)
    return out


@numba.njit(cache=True)
def product_transposed(a: Array, b: Array) -> Array:
    """Return a b^T (n, m) of a (n, k) and b (m, k)."""
    out = np.empty((a.shape[0], b.shape[0]))
    for i in range(a.shape[0]):
        for j in range(b.shape[0]):
            total = 0.0
            for k in range(a.shape[1]):
                total += a[i, k] * b[j, k]
            out[i, j] = total
    return out


@numba.njit(cache=True)
def transposed(a: Array) -> Array:
    """Return a^T (m, n) of a (n, m), C-ordered."""
    out = np.empty((a.shape[1], a.shape[0]))
    for i in range(a.shape[0]):
        for j in range(a.shape[1]):
            out[j, i] = a[i, j]
    return out


@numba.njit(cache=True)
def times(a: Array, x: Array) -> Array:
    """Return a x (n,) of a (n, m) and x (m,)."""
    out = np.empty(a.shape[0])
    for i in range(a.shape[0]):
        total = 0.0
        for k in range(a.shape[1]):
            total += a[i, k] * x[k]
        out[i] = total
    return out


@numba.njit(cache=True)
def inner(a: Array, b: Array) -> float:
    """Return a . b of two vectors (n,)."""
    total = 0.0
    for i in range(len(a)):
        total += a[i] * b[i]
    return total


@numba.njit(cache=True)
def moved(x: Array, step: Array, share: float) -> Array:
    """Return x + share step of two vectors (n,)."""
    out = np.empty(len(x))
    for i in range(len(x)):
        out[i] = x[i] + share * step[i]
    return out


@numba.njit(cache=True)
def mirror(a: Array) -> None:
    """Copy what is below the diagonal of a (n, n) above it, in place."""
    for i in range(a.shape[0]):
        for j in range(i):
            a[j, i] = a[i, j]


@numba.njit(cache=True, error_model="numpy")
def cholesky(matrix: Array, least: float) -> tuple[Array, bool]:
    """Return L (n, n) with L L^T = matrix, and whether all squared pivots are above `least`; others count as that."""
    n = matrix.shape[0]
    low, positive = np.zeros((n, n)), True
    for i in range(n):
        for j in range(i + 1):
            total = matrix[i, j]
            for k in range(j):
                total -= low[i, k] * low[j, k]
            if i == j:
                if not total > least:
                    total, positive = least, False
                low[i, i] = np.sqrt(total)
            else:
                low[i, j] = total / low[j, j]
    return low, positive


@numba.njit(cache=True, error_model="numpy")
def solved(low: Array, g: Array) -> Array:
    """Return x (n,) of L L^T x = g, with L (n, n) lower and g (n,)."""
    n = len(g)
    x = np.empty(n)
    for i in range(n):
        total = g[i]
        for k in range(i):
            total -= low[i, k] * x[k]
        x[i] = total / low[i, i]
    for i in range(n - 1, -1, -1):
        total = x[i]
        for k in range(i + 1, n):
            total -= low[k, i] * x[k]
        x[i] = total / low[i, i]
    return x


@numba.njit(cache=True)
def downhill(gradient: Array, hessian: Array, least: float) -> Array:
    """Return the Newton step (n,), with negative curvatures turned round (saddle-free) where the Hessian has any.

    Curvatures below `least` count as that.
    """
    n = len(gradient)
    step = np.zeros(n)
    low, positive = cholesky(hessian, least)
    if positive:
        return moved(step, solved(low, gradient), -1.0)
    values, vectors = eigen(hessian)
    for k in range(n):
        along = 0.0
        for i in range(n):
            along += vectors[i, k] * gradient[i]
        for i in range(n):
            step[i] -= vectors[i, k] * along / max(abs(values[k]), least)
    return step


@numba.njit(cache=True)
def inverse_of(low: Array) -> Array:
    """Return (L L^T)^-1 (n, n) of L (n, n) lower."""
    n = low.shape[0]
    out = np.empty((n, n))
    for j in range(n):
        unit = np.zeros(n)
        unit[j] = 1.0
        x = solved(low, unit)
        for i in range(n):
            out[i, j] = x[i]
    return out
