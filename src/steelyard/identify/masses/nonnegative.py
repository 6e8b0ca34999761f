"""Masses that do not fall below zero: the likeliest ones, and how far from them the truth may be.

The data are m^T A m / 2 - b^T m with m >= 0. At the likeliest masses some parts are held at zero; that they would weigh
exactly nothing is not what the data say. What they say is a Gaussian cut off at zero, whose moments come from
expectation propagation, one factor per part.
Source: Lawson and Hanson 1974, chapter 23, on the normal equations; Cunningham, Hennig, Lacoste-Julien 2011, section 3.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from steelyard.check import Array, Mask
from steelyard.identify.cost.dense import moved, times
from steelyard.identify.cost.linear import RANK_TOLERANCE, pseudo_inverse

# The whole weighs at least this much [kg].
LIGHTEST = 1e-6
# A slope below this share of the largest is none.
FLAT = 1e-9
SWEEPS, SETTLED = 20, 1e-4
# So many deviations below zero the tail of a Gaussian is taken from its asymptotic series.
FAR = 8.0


@numba.njit(cache=True)
def nonnegative_masses(A: Array, b: Array) -> Array:
    """Return m >= 0 (P,) that minimises m^T A m / 2 - b^T m, for A (P, P) positive semidefinite."""
    P = len(b)
    m, free = np.zeros(P), np.zeros(P, np.bool_)
    least = 0.0
    for k in range(P):
        least = max(least, FLAT * abs(b[k]))
    for _ in range(5 * P):
        drawn, enters, steepest = times(A, m), -1, least
        for k in range(P):
            if not free[k] and b[k] - drawn[k] > steepest:
                enters, steepest = k, b[k] - drawn[k]
        if enters < 0:
            break
        free[enters] = True
        for _ in range(P):
            aim, step, lowest = _free_masses(A, b, free), 1.0, np.inf
            for j in range(P):
                if free[j]:
                    lowest = min(lowest, aim[j])
                    if aim[j] <= 0.0 and m[j] > aim[j]:
                        step = min(step, m[j] / (m[j] - aim[j]))
            heaviest = -np.inf
            for j in range(P):
                m[j] += step * (aim[j] - m[j])
                heaviest = max(heaviest, m[j])
            if step == 1.0 and lowest > 0.0:
                break
            for j in range(P):
                if free[j] and aim[j] <= 0.0 and m[j] <= 1e-12 * heaviest:
                    free[j], m[j] = False, 0.0
            if not free[enters]:
                break
        if not free[enters]:
            # Rounding alone made its slope: no step along it is downhill.
            break
    for k in range(P):
        m[k] = max(m[k], 0.0)
    return m


@numba.njit(cache=True)
def _free_masses(A: Array, b: Array, free: Mask) -> Array:
    """Return the masses (P,) that fit best among the `free` (P,), the others zero."""
    P = len(b)
    n, place = 0, np.empty(P, np.int64)
    for k in range(P):
        if free[k]:
            place[n] = k
            n += 1
    chosen, pull, out = np.empty((n, n)), np.empty(n), np.zeros(P)
    for i in range(n):
        pull[i] = b[place[i]]
        for j in range(n):
            chosen[i, j] = A[place[i], place[j]]
    found = times(pseudo_inverse(chosen, RANK_TOLERANCE), pull)
    for i in range(n):
        out[place[i]] = found[i]
    return out


@numba.njit(cache=True)
def spread_about(A: Array, b: Array, masses: Array) -> Array:
    """Return E[(m - masses) (m - masses)^T] (P, P) of the Gaussian exp(b^T m - m^T A m / 2), cut off at m >= 0.

    No part weighs more than about the whole, which bounds what the data leave open.
    """
    P, whole = len(b), 0.0
    for k in range(P):
        whole += masses[k]
    loose = max(whole, LIGHTEST) ** -2
    bounded, pull = A.copy(), b.copy()
    for k in range(P):
        bounded[k, k] += loose
        pull[k] += loose * masses[k]
    covariance = pseudo_inverse(bounded, RANK_TOLERANCE)
    held, shift, column = np.zeros(P), np.zeros(P), np.empty(P)
    mean = times(covariance, pull)
    for _ in range(SWEEPS):
        before, settled = mean, True
        for k in range(P):
            variance = covariance[k, k]
            precision = 1 / variance - held[k]
            if precision <= 0.0:
                continue
            at = (mean[k] / variance - shift[k]) / precision
            cut_mean, cut_variance = _cut(at, 1 / precision)
            change = 1 / cut_variance - precision - held[k]
            held[k] += change
            shift[k] = cut_mean / cut_variance - at * precision
            for i in range(P):
                column[i] = covariance[i, k]
            for i in range(P):
                for j in range(P):
                    covariance[i, j] -= change / (1 + change * variance) * column[i] * column[j]
            mean = times(covariance, moved(pull, shift, 1.0))
        for k in range(P):
            settled = settled and abs(mean[k] - before[k]) < SETTLED * np.sqrt(covariance[k, k])
        if settled:
            break
    for i in range(P):
        for j in range(P):
            covariance[i, j] += (mean[i] - masses[i]) * (mean[j] - masses[j])
    return covariance


@numba.njit(cache=True)
def _cut(mean: float, variance: float) -> tuple[float, float]:
    """Return mean and variance of a Gaussian cut off below zero."""
    std = math.sqrt(variance)
    z = mean / std
    if z > FAR:
        return mean, variance
    if z < -FAR:
        square = 1 / (z * z)
        return std * (1 - 2 * square) / -z, variance * square * (1 - 6 * square)
    ratio = math.sqrt(2 / math.pi) * math.exp(-0.5 * z * z) / math.erfc(-z / math.sqrt(2.0))
    return mean + std * ratio, variance * (1 - ratio * (ratio + z))
