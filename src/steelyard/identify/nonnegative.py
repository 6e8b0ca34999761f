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

from steelyard.check import Array
from steelyard.identify.linear import inverse_scaled, solve_scaled

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
    least = FLAT * np.abs(b).max()
    for _ in range(5 * P):
        slope = b - A @ m
        enters, steepest = -1, least
        for k in range(P):
            if not free[k] and slope[k] > steepest:
                enters, steepest = k, slope[k]
        if enters < 0:
            break
        free[enters] = True
        for _ in range(P):
            aim, step = np.zeros(P), 1.0
            chosen = np.flatnonzero(free)
            aim[chosen] = solve_scaled(A[chosen][:, chosen], b[chosen])
            for j in chosen:
                if aim[j] <= 0.0 and m[j] > aim[j]:
                    step = min(step, m[j] / (m[j] - aim[j]))
            m = m + step * (aim - m)
            if step == 1.0 and aim[chosen].min() > 0.0:
                break
            for j in chosen:
                if aim[j] <= 0.0 and m[j] <= 1e-12 * m.max():
                    free[j], m[j] = False, 0.0
            if not free[enters]:
                break
        if not free[enters]:
            # Rounding alone made its slope: no step along it is downhill.
            break
    return np.maximum(m, 0.0)


@numba.njit(cache=True)
def spread_about(A: Array, b: Array, masses: Array) -> Array:
    """Return E[(m - masses) (m - masses)^T] (P, P) of the Gaussian exp(b^T m - m^T A m / 2), cut off at m >= 0.

    No part weighs more than about the whole, which bounds what the data leave open.
    """
    P = len(b)
    most = max(masses.sum(), LIGHTEST)
    bounded = A + np.eye(P) / most**2
    pull = b + masses / most**2
    covariance = inverse_scaled(bounded)
    held, shift = np.zeros(P), np.zeros(P)
    mean = covariance @ pull
    for _ in range(SWEEPS):
        before = mean
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
            column = covariance[:, k].copy()
            covariance -= change / (1 + change * variance) * np.outer(column, column)
            mean = covariance @ (pull + shift)
        if (np.abs(mean - before) < SETTLED * np.sqrt(np.diag(covariance))).all():
            break
    off = mean - masses
    return covariance + np.outer(off, off)


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
