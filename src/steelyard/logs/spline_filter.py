"""A signal as the n-fold integral of white noise seen through white noise: Kalman filter and pass back, compiled.

Loops only: an array expression takes longer to compile than the whole filter.
Source: Bierman 1973, the pass back of Bryson and Frazier 1963.
"""

from __future__ import annotations

import numpy as np
from numba import njit

_WIDE = 1e6  # variance of the start, where that of a measurement is 1
WARM_UP = 6  # innovations left out of the likelihood: the start is not known


@njit(cache=True, error_model="numpy")
def forward(clock, values, order, density, keep):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Kalman filter with unit measurement noise and process density `density` in the given time unit.

    Returns states (N, n, D), covariances (N, n, n), each with its measurement in it, and the inverse variance (N,) of
    innovations, empty unless to be kept; and of the innovations the sum of squares over variances, that of the
    logarithms of variances, and their number.
    """
    n, rows, channels = order, values.shape[0], values.shape[1]
    stored = rows if keep else 0
    states, covariances, weights = np.empty((stored, n, channels)), np.empty((stored, n, n)), np.empty(stored)
    x, P = np.zeros((n, channels)), np.zeros((n, n))
    for c in range(channels):
        x[0, c] = values[0, c]
    for i in range(n):
        P[i, i] = _WIDE
    F, room, gain = np.zeros((n, n)), np.zeros((n, n)), np.zeros(n)
    quad, log_det, count = 0.0, 0.0, 0
    for k in range(rows):
        if k > 0:
            dt = clock[k] - clock[k - 1]
            _transition(F, dt)
            _predict(x, P, F, density * dt, room)
        S = P[0, 0] + 1.0
        for i in range(n):
            gain[i] = P[i, 0] / S
        for c in range(channels):
            e = values[k, c] - x[0, c]
            for i in range(n):
                x[i, c] += gain[i] * e
            if k >= WARM_UP:
                quad += e * e / S
        if k >= WARM_UP:
            log_det += np.log(S)
            count += 1
        _update(P, gain, room)
        if keep:
            weights[k] = 1 / S
            for i in range(n):
                for c in range(channels):
                    states[k, i, c] = x[i, c]
                for j in range(n):
                    covariances[k, i, j] = P[i, j]
    return states, covariances, weights, quad, log_det, count


@njit(cache=True, inline="always")
def _transition(F, dt):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Set F (n, n), upper triangular, of a step dt: F_ij = dt^(j - i) / (j - i)!."""
    for i in range(len(F)):
        F[i, i] = 1.0
        for j in range(i + 1, len(F)):
            F[i, j] = F[i, j - 1] * dt / (j - i)


@njit(cache=True, inline="always")
def _predict(x, P, F, noise, room):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Move state and covariance one step on, in place.

    White noise, integrated over the step, adds noise F_0a F_0b / (a + b + 1) with a = n - 1 - i and b = n - 1 - j.
    """
    n = len(P)
    for i in range(n):
        for c in range(x.shape[1]):
            total = 0.0
            for m in range(i, n):
                total += F[i, m] * x[m, c]
            x[i, c] = total
        for j in range(n):
            total = 0.0
            for m in range(i, n):
                total += F[i, m] * P[m, j]
            room[i, j] = total
    for i in range(n):
        for j in range(n):
            total = noise * F[0, n - 1 - i] * F[0, n - 1 - j] / (2 * n - 1 - i - j)
            for m in range(j, n):
                total += room[i, m] * F[j, m]
            P[i, j] = total


@njit(cache=True, inline="always")
def _update(P, gain, room):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Take one measurement into the covariance, in place; Joseph's form keeps it positive with a very wide start."""
    n = len(P)
    for i in range(n):
        for j in range(n):
            room[i, j] = P[i, j] - gain[i] * P[0, j]
    for i in range(n):
        for j in range(n):
            P[i, j] = room[i, j] - room[i, 0] * gain[j] + gain[i] * gain[j]


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
