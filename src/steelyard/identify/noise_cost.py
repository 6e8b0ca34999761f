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

from steelyard.check import Array


@numba.njit(cache=True)
def inverse_spd(matrix: Array) -> Array:
    """Return the inverse of a small symmetric positive definite matrix by Cholesky."""
    n = matrix.shape[0]
    low = np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1):
            total = matrix[i, j]
            for k in range(j):
                total -= low[i, k] * low[j, k]
            if i == j:
                low[i, i] = np.sqrt(max(total, 1e-300))
            else:
                low[i, j] = total / low[j, j]
    out = np.zeros((n, n))
    for column in range(n):
        x = np.zeros(n)
        for i in range(column, n):
            total = 1.0 if i == column else 0.0
            for k in range(column, i):
                total -= low[i, k] * x[k]
            x[i] = total / low[i, i]
        for i in range(n - 1, -1, -1):
            total = x[i]
            for k in range(i + 1, n):
                total -= low[k, i] * x[k]
            x[i] = total / low[i, i]
        out[:, column] = x
    return out


@numba.njit(cache=True, fastmath=True)
def multiply(a: Array, b: Array) -> Array:
    """Return a b for small matrices (no BLAS call overhead)."""
    rows, inner, columns = a.shape[0], a.shape[1], b.shape[1]
    out = np.zeros((rows, columns))
    for i in range(rows):
        for k in range(inner):
            value = a[i, k]
            if value != 0.0:
                for j in range(columns):
                    out[i, j] += value * b[k, j]
    return out


@numba.njit(cache=True, fastmath=True)
def inner(a: Array, b: Array) -> float:
    """Return sum of a * b."""
    total = 0.0
    for i in range(a.shape[0]):
        for j in range(a.shape[1]):
            total += a[i, j] * b[i, j]
    return total


@numba.njit(cache=True)
def weight(K: Array, acceleration: Array, wrench: Array) -> Array:
    """Return W = (Sigma_w + M Sigma_a M^T)^-1 (6, 6) at K (6, Z) for variances (6,) and (6,)."""
    V = np.zeros((6, 6))
    for i in range(6):
        V[i, i] = wrench[i]
        for j in range(6):
            for k in range(6):
                V[i, j] += K[i, k] * acceleration[k] * K[j, k]
    return inverse_spd(V)


@numba.njit(cache=True)
def value(K: Array, scatter: Array, acceleration: Array, wrench: Array) -> float:
    """Return Q at K (6, Z) over groups: scatter (C, Z, Z), variances (C, 6) and (C, 6)."""
    total = 0.0
    for c in range(scatter.shape[0]):
        W = weight(K, acceleration[c], wrench[c])
        total += inner(W, multiply(multiply(K, scatter[c]), K.T))
    return total


@numba.njit(cache=True)
def derivatives(K: Array, T: Array, scatter: Array, acceleration: Array, wrench: Array) -> tuple[float, Array, Array]:
    """Return Q, its gradient (p,) and exact Hessian (p, p) in the linear parameters, for the design T (p, 6, Z)."""
    size = T.shape[0]
    total, gradient, hessian = 0.0, np.zeros(size), np.zeros((size, size))
    width = T.shape[2]
    dV, WVR, WVWB = np.zeros((size, 6, 6)), np.zeros((size, 6, 6)), np.zeros((size, 6, width))
    WTS, RMS = np.zeros((size, 6, width)), np.zeros((size, 6, 6))
    for c in range(scatter.shape[0]):
        S, Sa = scatter[c], acceleration[c]
        W = weight(K, Sa, wrench[c])
        B = multiply(K, S)
        C = multiply(B, K.T)
        WB = multiply(W, B)
        R = multiply(multiply(W, C), W)
        MS = -K[:, :6] * Sa
        RMSa = multiply(R, MS)
        total += inner(W, C)
        for p in range(size):
            Mp = -T[p, :, :6]
            half = multiply(Mp, MS.T)
            dV[p] = half + half.T
            gradient[p] += 2 * inner(WB, T[p]) - 2 * inner(RMSa, Mp)
            WTS[p] = multiply(W, multiply(T[p], S))
            WdV = multiply(W, dV[p])
            WVWB[p] = multiply(WdV, WB)
            WTS[p] -= WVWB[p]
            WVR[p] = multiply(WdV, R)
            RMS[p] = multiply(R, Mp * Sa)
        for p in range(size):
            for q in range(p + 1):
                entry = inner(WTS[p], T[q]) - inner(WVWB[q], T[p])
                entry += inner(WVR[p], dV[q]) + inner(RMS[p], T[q, :, :6])
                hessian[p, q] += 2 * entry
    for p in range(size):
        for q in range(p):
            hessian[q, p] = hessian[p, q]
    return total, gradient, hessian


@numba.njit(cache=True)
def information(K: Array, T: Array, scatter: Array, acceleration: Array, wrench: Array) -> tuple[Array, Array, Array]:
    """Return the parts of the sandwich (p, p): expected H, the extra score variance D, and the uncorrected H.

    H_pq = tr(W T_p (S - n Sigma_a) T_q^T) is the information about the true accelerations;
    D_pq = n tr(W M_p P M_q^T), P = Sigma_a - Sigma_a M^T W M Sigma_a, is what noise in the regressor adds.
    """
    size = T.shape[0]
    expected, extra, plain = np.zeros((size, size)), np.zeros((size, size)), np.zeros((size, size))
    for c in range(scatter.shape[0]):
        S, Sa, n = scatter[c].copy(), acceleration[c], scatter[c, 18, 18]
        W = weight(K, Sa, wrench[c])
        MS = -K[:, :6] * Sa
        P = -multiply(MS.T, multiply(W, MS))
        for i in range(6):
            P[i, i] += Sa[i]
        for p in range(size):
            WTS = multiply(W, multiply(T[p], S))
            WM = multiply(W, T[p, :, :6])
            WMP = multiply(WM, P)
            WMS = WM * Sa
            for q in range(p + 1):
                M = T[q, :, :6]
                raw = inner(WTS, T[q])
                plain[p, q] += raw
                expected[p, q] += raw - n * inner(WMS, M)
                extra[p, q] += n * inner(WMP, M)
    for p in range(size):
        for q in range(p):
            plain[q, p], expected[q, p], extra[q, p] = plain[p, q], expected[p, q], extra[p, q]
    return expected, extra, plain
