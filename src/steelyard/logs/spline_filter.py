"""A signal as the n-fold integral of white noise seen through white noise: Kalman filter and pass back, compiled.

Loops only: an array expression takes longer to compile than the whole filter.
Source: Bierman 1973, the pass back of Bryson and Frazier 1963.
"""

from __future__ import annotations

import numpy as np
from numba import njit

_WIDE = 1e6  # variance of the start, where that of a measurement is 1
WARM_UP = 6  # innovations left out of the likelihood: the start is not known
_FACTORS = 4  # variances multiplied before a logarithm is taken: none overflows, most of a logarithm is saved


@njit(cache=True, error_model="numpy")
def forward(clock, values, order, scales, keep):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Kalman filters side by side, one for each of `scales` (L,): of the clock times a scale, at that process density.

    Measurement noise is 1. Returns of the first filter states (N, n, D) and covariances (N, n, n), each with its
    measurement in it, and the inverse variance (N,) of innovations, empty unless to be kept; and of the innovations of
    each the sum of squares over variances (L,), that of the logarithms of variances (L,), and their number.
    """
    n, rows, channels, lanes = order, values.shape[0], values.shape[1], len(scales)
    stored = rows if keep else 0
    states, covariances, weights = np.empty((stored, n, channels)), np.empty((stored, n, n)), np.empty(stored)
    x, P = np.zeros((n, channels, lanes)), np.zeros((n, n, lanes))
    F, gain, row = np.zeros((n, lanes)), np.zeros((n, lanes)), np.zeros((n, lanes))
    S, product, quad, log_det = np.zeros(lanes), np.zeros(lanes), np.zeros(lanes), np.zeros(lanes)
    for w in range(lanes):
        F[0, w] = product[w] = 1.0
        for c in range(channels):
            x[0, c, w] = values[0, c]
        for i in range(n):
            P[i, i, w] = _WIDE
    for k in range(rows):
        if k > 0:
            _predict(x, P, F, scales, clock[k] - clock[k - 1])
        for w in range(lanes):
            S[w] = P[0, 0, w] + 1.0
        _update(x, P, S, values[k], gain, row, quad, k >= WARM_UP)
        if k >= WARM_UP:
            for w in range(lanes):
                product[w] *= S[w]
        if k % _FACTORS == 0 or k == rows - 1:
            for w in range(lanes):
                log_det[w] += np.log(product[w])
                product[w] = 1.0
        if keep:
            weights[k] = 1 / S[0]
            for i in range(n):
                for c in range(channels):
                    states[k, i, c] = x[i, c, 0]
                for j in range(n):
                    covariances[k, i, j] = P[i, j, 0] if i < j else P[j, i, 0]
    return states, covariances, weights, quad, log_det, max(rows - WARM_UP, 0)


@njit(cache=True, inline="always")
def _predict(x, P, F, scales, dt):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Move states (n, D, L) and the upper half of covariances (n, n, L) one step on, in place.

    F (n, L) are the entries dt^k / k! of the transition. White noise, integrated over the step, adds
    F_a F_b / (a + b + 1) of its size with a = n - 1 - i and b = n - 1 - j.
    """
    n, channels, lanes = x.shape
    for i in range(1, n):
        for w in range(lanes):
            F[i, w] = F[i - 1, w] * scales[w] * (dt / i)
    for i in range(n):
        for m in range(i + 1, n):
            for c in range(channels):
                for w in range(lanes):
                    x[i, c, w] += F[m - i, w] * x[m, c, w]
        for j in range(i, n):
            for m in range(i + 1, n):
                a, b = (m, j) if m < j else (j, m)
                for w in range(lanes):
                    P[i, j, w] += F[m - i, w] * P[a, b, w]
    for i in range(n):
        for j in range(i, n):
            for m in range(j + 1, n):
                for w in range(lanes):
                    P[i, j, w] += F[m - j, w] * P[i, m, w]
            share = dt / (2 * n - 1 - i - j)
            for w in range(lanes):
                P[i, j, w] += scales[w] ** 2 * share * F[n - 1 - i, w] * F[n - 1 - j, w]


@njit(cache=True, inline="always")
def _update(x, P, S, measured, gain, row, quad, counts):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Take one measurement (D,) in, in place; Joseph's form keeps covariances positive with a very wide start.

    (1 - K h^T) is taken to the right side last: what the first leaves of a wide row is rounded, and that mends it.
    """
    n, channels, lanes = x.shape
    for i in range(n):
        for w in range(lanes):
            row[i, w] = P[0, i, w]
            gain[i, w] = P[0, i, w] / S[w]
    for c in range(channels):
        for w in range(lanes):
            e = measured[c] - x[0, c, w]
            for i in range(n):
                x[i, c, w] += gain[i, w] * e
            if counts:
                quad[w] += e * e / S[w]
    for i in range(n):
        for j in range(i, n):
            for w in range(lanes):
                left = row[j, w] - gain[j, w] * row[0, w]
                P[i, j, w] = P[i, j, w] - gain[j, w] * row[i, w] - left * gain[i, w] + gain[i, w] * gain[j, w]


@njit(cache=True, inline="always")
def _transition(F, dt):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Set F (n, n), upper triangular, of a step dt: F_ij = dt^(j - i) / (j - i)!."""
    for i in range(len(F)):
        F[i, i] = 1.0
        for j in range(i + 1, len(F)):
            F[i, j] = F[i, j - 1] * dt / (j - i)


@njit(cache=True, error_model="numpy")
def backward(clock, values, states, covariances, weights):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Take what comes later into states (N, n, D) and covariances (N, n, n), in place; no matrix is inverted.

    What comes later is carried back as an adjoint a (n, D) and its scatter A (n, n): x - P a, P - P A P. With unit
    measurement noise the gain K is the first column of P, and what the filter leaves, y - x_0, is e / S of an
    innovation e of variance S. The `weights` (N,) are 1 / S: 1 - K_0, too, but that cancels after the wide start.
    Variances of the first n rows, what is left of that start, are right to about 1e-3.
    """
    n, channels = states.shape[1], states.shape[2]
    a, A = np.zeros((n, channels)), np.zeros((n, n))
    F, gain, left = np.zeros((n, n)), np.zeros(n), np.zeros(channels)
    room = np.zeros((n, n)), np.zeros((n, n))
    for k in range(len(states) - 1, -1, -1):
        for i in range(n):
            gain[i] = covariances[k, i, 0]
        for c in range(channels):
            left[c] = values[k, c] - states[k, 0, c]
        _correct(states[k], covariances[k], a, A, room)
        if k > 0:
            _before_measurement(a, A, gain, left, weights[k])
            _transition(F, clock[k] - clock[k - 1])
            _before_step(a, A, F, room[0])


@njit(cache=True, inline="always")
def _correct(x, P, a, A, room):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Set x - P a and P - P A P, in place."""
    n = len(P)
    half, whole = room
    for i in range(n):
        for c in range(x.shape[1]):
            for m in range(n):
                x[i, c] -= P[i, m] * a[m, c]
        for j in range(n):
            half[i, j] = 0.0
            for m in range(n):
                half[i, j] += P[i, m] * A[m, j]
    for i in range(n):
        for j in range(n):
            whole[i, j] = 0.0
            for m in range(n):
                whole[i, j] += half[i, m] * P[m, j]
    for i in range(n):
        for j in range(n):
            P[i, j] -= whole[i, j]


@njit(cache=True, inline="always")
def _before_measurement(a, A, gain, left, weight):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Carry the adjoint back over a measurement, in place: C^T a - h e / S, C^T A C + h h^T / S; C = 1 - K h^T."""
    n = len(A)
    for c in range(len(left)):
        total = left[c]
        for m in range(n):
            total += gain[m] * a[m, c]
        a[0, c] -= total
    for i in range(n):
        total = 0.0
        for m in range(n):
            total += A[i, m] * gain[m]
        A[i, 0] -= total
    for j in range(n):
        total = 0.0
        for m in range(n):
            total += gain[m] * A[m, j]
        A[0, j] -= total
    A[0, 0] += weight


@njit(cache=True, inline="always")
def _before_step(a, A, F, room):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Carry the adjoint back over a step, in place: F^T a, F^T A F; F is upper triangular."""
    n = len(A)
    for i in range(n - 1, -1, -1):
        for c in range(a.shape[1]):
            total = 0.0
            for m in range(i + 1):
                total += F[m, i] * a[m, c]
            a[i, c] = total
        for j in range(n):
            total = 0.0
            for m in range(i + 1):
                total += F[m, i] * A[m, j]
            room[i, j] = total
    for i in range(n):
        for j in range(n):
            total = 0.0
            for m in range(j + 1):
                total += room[i, m] * F[m, j]
            A[i, j] = total
