"""The noise-aware cost with exact first and second derivatives, from scatter matrices alone.

With K = [-L(phi), 1, -b] the residual of a row is r = K z, and noise in the measured acceleration adds to the noise of
the wrench: V = Sigma_w + M Sigma_a M^T, M = L(phi)[:, :6], W = V^-1. The cost of all rows of a class is
    Q = sum_t r_t^T W r_t = tr(W K S K^T),
and, with B = K S, C = B K^T, R = W C W, T_p = dK/dp, dV_p = M_p Sigma_a M^T + (.)^T,
    Q_p  = 2 <W B, T_p> - 2 <R M Sigma_a, M_p>
    Q_pq = 2 <W T_p S, T_q> - 2 <W dV_p W B, T_q> - 2 <W dV_q W B, T_p>
           + 2 tr(R dV_p W dV_q) - 2 <R M_p Sigma_a, M_q>.
No log-determinant is added: that is the consistent form when the accelerations are unknown constants.
Source: own; closed forms checked row by row and against finite differences in the tests.
"""

from __future__ import annotations

import numba
import numpy as np

from steelyard.check import Array, Integers
from steelyard.identify.cost.dense import add_product, cholesky, inverse_of, mirror, product, product_transposed

# The entries of a design that are not zero: of matrix p those numbered start[p] to start[p + 1], with row, column and
# value. Each of the ten parameters touches a few of the 6 x Z only.
Entries = tuple[Integers, Integers, Integers, Array]


@numba.njit(cache=True)
def entries(T: Array) -> Entries:
    """Return the entries of a design T (p, 6, Z) that are not zero."""
    size, height, width = T.shape
    start, count = np.zeros(size + 1, np.int64), 0
    row, column = np.empty(T.size, np.int64), np.empty(T.size, np.int64)
    value = np.empty(T.size)
    for p in range(size):
        for i in range(height):
            for z in range(width):
                if T[p, i, z] != 0.0:
                    row[count], column[count], value[count] = i, z, T[p, i, z]
                    count += 1
        start[p + 1] = count
    return start, row, column, value


@numba.njit(cache=True)
def add_products(out: Array, T: Entries, W: Array, S: Array, factor: float) -> None:
    """Add factor tr(W T_p S T_q^T) for q <= p to out (p, p): W (6, 6) and S (Z, Z) symmetric, T from `entries`."""
    start, row, column, value = T
    for p in range(out.shape[0]):
        for q in range(p + 1):
            total = 0.0
            for a in range(start[p], start[p + 1]):
                for b in range(start[q], start[q + 1]):
                    total += value[a] * value[b] * W[row[a], row[b]] * S[column[a], column[b]]
            out[p, q] += factor * total


def weight(K: Array, acceleration: Array, wrench: Array) -> Array:
    """Return W = (Sigma_w + M Sigma_a M^T)^-1 (6, 6) at K (6, Z) for variances (6,) and (6,)."""
    return np.asarray(weights_at(K, acceleration[None], wrench[None])[0])


@numba.njit(cache=True)
def residual_map_of(T: Array, linear: Array) -> Array:
    """Return K (6, Z) at the linear parameters (p,)."""
    width = T.shape[2]
    K = np.zeros((6, width))
    for i in range(6):
        K[i, 12 + i] = 1.0
    for p in range(T.shape[0]):
        if linear[p] != 0.0:
            for i in range(6):
                for j in range(width):
                    K[i, j] += linear[p] * T[p, i, j]
    return K


@numba.njit(cache=True)
def weights_at(K: Array, acceleration: Array, wrench: Array) -> Array:
    """Return W (C, 6, 6) of every class, as `weight` does, at K (6, Z) for variances (C, 6) and (C, 6)."""
    out, V = np.empty((len(wrench), 6, 6)), np.empty((6, 6))
    for c in range(len(wrench)):
        for i in range(6):
            for j in range(6):
                V[i, j] = wrench[c, i] if i == j else 0.0
                for k in range(6):
                    V[i, j] += K[i, k] * acceleration[c, k] * K[j, k]
        W = inverse_of(cholesky(V, 1e-300)[0])
        for i in range(6):
            for j in range(6):
                out[c, i, j] = W[i, j]
    return out


# The weights are found apart: a kernel that found its own would be compiled with all that inverts a matrix in it.
def value(K: Array, scatter: Array, acceleration: Array, wrench: Array) -> tuple[float, Array]:
    """Return Q at K (6, Z) and the sum of r^2 (6,), over groups: scatter (C, Z, Z), variances (C, 6) and (C, 6)."""
    return _value(K, scatter, weights_at(K, acceleration, wrench))


@numba.njit(cache=True)
def _value(K: Array, scatter: Array, weights: Array) -> tuple[float, Array]:
    total, square = 0.0, np.zeros(6)
    for c in range(scatter.shape[0]):
        W, C = weights[c], product_transposed(product(K, scatter[c]), K)
        for i in range(6):
            square[i] += C[i, i]
            for j in range(6):
                total += W[i, j] * C[i, j]
    return total, square


def derivatives(K: Array, T: Array, scatter: Array, acceleration: Array, wrench: Array) -> tuple[float, Array, Array]:
    """Return Q, its gradient (p,) and exact Hessian (p, p) in the linear parameters, for the design T (p, 6, Z).

    K (6, Z), scatter (C, Z, Z) and the variances (C, 6) are those of `value`.
    """
    return _derivatives(K, T, scatter, acceleration, weights_at(K, acceleration, wrench))


@numba.njit(cache=True)
def _derivatives(K: Array, T: Array, scatter: Array, acceleration: Array, weights: Array) -> tuple[float, Array, Array]:
    size = T.shape[0]
    total, gradient, hessian = 0.0, np.zeros(size), np.zeros((size, size))
    sparse = entries(T)
    start, row, column, entry = sparse
    dV = np.empty((size, 6, 6))
    for c in range(scatter.shape[0]):
        WdVR, WdVWB = np.zeros((size, 6, 6)), np.zeros((size, 6, T.shape[2]))
        S, Sa, W = scatter[c], acceleration[c], weights[c]
        B = product(K, S)
        C = product_transposed(B, K)
        WB = product(W, B)
        R = product(product(W, C), W)
        slope, noise = WB.copy(), np.zeros(S.shape)
        for j in range(6):
            noise[j, j] = Sa[j]
            for i in range(6):
                total += W[i, j] * C[i, j]
                for k in range(6):
                    slope[i, j] -= R[i, k] * K[k, j] * Sa[j]
        add_products(hessian, sparse, W, S, 2.0)
        add_products(hessian, sparse, R, noise, -2.0)
        for p in range(size):
            half = np.zeros((6, 6))
            for a in range(start[p], start[p + 1]):
                i, z = row[a], column[a]
                gradient[p] += 2 * entry[a] * slope[i, z]
                if z < 6:
                    for j in range(6):
                        half[i, j] += entry[a] * K[j, z] * Sa[z]
            for i in range(6):
                for j in range(6):
                    dV[p, i, j] = half[i, j] + half[j, i]
            WdV = product(W, dV[p])
            add_product(WdVR[p], WdV, R)
            add_product(WdVWB[p], WdV, WB)
        for p in range(size):
            for q in range(p + 1):
                bend = 0.0
                for i in range(6):
                    for j in range(6):
                        bend += WdVR[p, i, j] * dV[q, i, j]
                for a in range(start[q], start[q + 1]):
                    bend -= entry[a] * WdVWB[p, row[a], column[a]]
                for a in range(start[p], start[p + 1]):
                    bend -= entry[a] * WdVWB[q, row[a], column[a]]
                hessian[p, q] += 2 * bend
    mirror(hessian)
    return total, gradient, hessian


def information(K: Array, T: Array, scatter: Array, acceleration: Array, wrench: Array) -> tuple[Array, Array, Array]:
    """Return the parts of the sandwich (p, p): expected H, the extra score variance D, and the uncorrected H.

    H_pq = tr(W T_p (S - n Sigma_a) T_q^T) is the information about the true accelerations;
    D_pq = n tr(W M_p P M_q^T), P = Sigma_a - Sigma_a M^T W M Sigma_a, is what noise in the regressor adds.
    """
    return _information(K, T, scatter, acceleration, weights_at(K, acceleration, wrench))


@numba.njit(cache=True)
def _information(K: Array, T: Array, scatter: Array, acceleration: Array, weights: Array) -> tuple[Array, Array, Array]:
    size, width = T.shape[0], T.shape[2]
    expected, extra, plain = np.zeros((size, size)), np.zeros((size, size)), np.zeros((size, size))
    sparse = entries(T)
    for c in range(scatter.shape[0]):
        S, Sa, W, n = scatter[c], acceleration[c], weights[c], scatter[c, 18, 18]
        WK = product(W, K)
        true, P = S.copy(), np.zeros((width, width))
        for i in range(6):
            true[i, i] -= n * Sa[i]
            P[i, i] = Sa[i]
            for j in range(6):
                for k in range(6):
                    P[i, j] -= Sa[i] * K[k, i] * WK[k, j] * Sa[j]
        add_products(plain, sparse, W, S, 1.0)
        add_products(expected, sparse, W, true, 1.0)
        add_products(extra, sparse, W, P, n)
    mirror(plain)
    mirror(expected)
    mirror(extra)
    return expected, extra, plain
