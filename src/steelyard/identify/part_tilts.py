"""Masses and tilts of one model of parts that are not homogeneous, compiled: mode, evidence, and the score of a part.

phi = sum_k m_k b_k(u_k), m_k = V_k exp(y_k). The cost is that of the log, 1/2 phi^T F phi - pull^T phi, with Gaussian
priors on the log densities y and on the tilts u; its mode is found by Gauss and Newton in y and u at once, the evidence
is Laplace's. The score of one more part is the same with its tilt linear about zero: nothing is fitted.
Source: own; the score test is Rao's (1948).
"""

from __future__ import annotations

import numba
import numpy as np

from steelyard.check import Array
from steelyard.identify.density_priors import log_det
from steelyard.identify.linear import inverse_scaled
from steelyard.logs.log import Integers

STEPS, HALVINGS, FALL = 40, 12, 1e-3
# The longest step in log densities, and in tilts.
LONGEST_DENSITY, LONGEST_TILT = 1.0, 0.7
# A tilt beyond this puts the whole part into one point.
STEEPEST = 30.0


@numba.njit(cache=True, nogil=True)
def tilted(weight: Array, features: Array, per_mass: Array, tilt: Array) -> tuple[Array, Array]:
    """Return b (10,) per kilogram of points (N, 10) tilted by u (F,), and db/du (10, F)."""
    power = np.minimum(np.maximum(features @ tilt, -STEEPEST), STEEPEST)
    share = weight * np.exp(power - power.max())
    share /= share.sum()
    b, mean = share @ per_mass, share @ features
    slope = (per_mass.T * share) @ features - np.outer(b, mean)
    return b, slope


@numba.njit(cache=True, nogil=True)
def fitted(
    information: Array, pull: Array, B: Array, volume: Array, precision: Array, centre: float,
    free: Integers, variance: Array, weight: Array, features: Array, per_mass: Array, y: Array, tilts: Array,
) -> tuple[Array, Array, float, Array, Array, Array, Array]:  # fmt: skip
    """Return the mode y (P,), tilts (F f,), its cost, what masses bend it by (P,), the Hessian (q, q) without that,
    d phi (10, q) and phi (10,), q = P + F f.

    B (10, P) per kilogram of even parts; `free` (f,) rows of the free ones, and of these the `variance` (F f,) of
    tilts, and points: weight (f, N), features (f, N, F), per_mass (f, N, 10). y, tilts: where to start.
    """
    P, size = len(volume), len(variance)
    F = features.shape[2]
    y, tilts = y.copy(), tilts.copy()
    cost, gradient, curve, hessian, J, phi = _cost(
        information, pull, B, volume, precision, centre, free, variance, weight, features, per_mass, y, tilts, F
    )
    for _ in range(STEPS):
        step = _solve(hessian, curve, gradient)
        fall = -(gradient @ step)
        if fall < FALL:
            break
        longest = max(np.abs(step[:P]).max() / LONGEST_DENSITY, np.abs(step[P:]).max() / LONGEST_TILT if size else 0.0)
        if longest > 1.0:
            step = step / longest
        before = cost
        for _ in range(HALVINGS):
            found = _cost(
                information, pull, B, volume, precision, centre, free, variance, weight, features, per_mass,
                y + step[:P], tilts + step[P:], F,
            )  # fmt: skip
            if found[0] < before:
                y, tilts = y + step[:P], tilts + step[P:]
                cost, gradient, curve, hessian, J, phi = found
                break
            step = 0.5 * step
        if before - cost < FALL:
            break
    return y, tilts, cost, curve, hessian, J, phi


@numba.njit(cache=True, nogil=True)
def _cost(
    information: Array, pull: Array, B: Array, volume: Array, precision: Array, centre: float, free: Integers,
    variance: Array, weight: Array, features: Array, per_mass: Array, y: Array, tilts: Array, F: int,
) -> tuple[float, Array, Array, Array, Array, Array]:  # fmt: skip
    """Return the cost, its gradient (q,), what masses bend it by (P,), the Gauss-Newton Hessian, d phi and phi."""
    P, size = len(volume), len(variance)
    q = P + size
    J = np.zeros((10, q))
    mass = volume * np.exp(np.minimum(y, 20.0))
    for k in range(P):
        for j in range(10):
            J[j, k] = mass[k] * B[j, k]
    for f in range(len(free)):
        k = free[f]
        b, slope = tilted(weight[f], features[f], per_mass[f], tilts[f * F : (f + 1) * F])
        for j in range(10):
            J[j, k] = mass[k] * b[j]
            for i in range(F):
                J[j, P + f * F + i] = mass[k] * slope[j, i]
    phi = J[:, :P].sum(1)
    seen = information @ phi
    rest = seen - pull
    off = y - centre
    drawn = precision @ off
    cost = float(phi @ (0.5 * seen - pull) + 0.5 * (off @ drawn) + 0.5 * (tilts**2 / variance).sum())
    gradient = J.T @ rest
    curve = gradient[:P].copy()
    gradient[:P] += drawn
    gradient[P:] += tilts / variance
    hessian = J.T @ (information @ J)
    hessian[:P, :P] += precision
    for i in range(size):
        hessian[P + i, P + i] += 1 / variance[i]
    return cost, gradient, curve, hessian, J, phi


@numba.njit(cache=True, nogil=True)
def _solve(hessian: Array, curve: Array, gradient: Array) -> Array:
    """Return the step -(H + max(curve, 0))^-1 g, by Cholesky."""
    q = len(gradient)
    L, x = hessian.copy(), -gradient
    for k in range(len(curve)):
        L[k, k] += max(curve[k], 0.0)
    for j in range(q):
        for k in range(j):
            L[j, j] -= L[j, k] * L[j, k]
        L[j, j] = np.sqrt(max(L[j, j], 1e-9))
        for i in range(j + 1, q):
            total = L[i, j]
            for k in range(j):
                total -= L[i, k] * L[j, k]
            L[i, j] = total / L[j, j]
    for i in range(q):
        for k in range(i):
            x[i] -= L[i, k] * x[k]
        x[i] /= L[i, i]
    for i in range(q - 1, -1, -1):
        for k in range(i + 1, q):
            x[i] -= L[k, i] * x[k]
        x[i] /= L[i, i]
    return x


@numba.njit(cache=True, nogil=True)
def evidence_of(
    cost: float, hessian: Array, curve: Array, spread: float, wide: float, parts: int, variance: Array
) -> float:
    """Return Laplace's log evidence of a mode: densities `spread` apart about a common one known to `wide`."""
    prior = (parts - 1) * np.log(spread) + np.log(spread + parts * wide) + np.log(variance).sum()
    full = hessian.copy()
    for k in range(parts):
        full[k, k] += curve[k]
    return float(-cost - 0.5 * (prior + log_det(full)))


@numba.njit(cache=True, nogil=True)
def scores(
    information: Array, pull: Array, phi: Array, J: Array, hessian: Array, masses: Array, slopes: Array, widths: Array
) -> Array:
    """Return how much the log evidence rises (W, P) with one more part free, its tilt linear about zero.

    The state is a mode: phi (10,), J (10, q), hessian (q, q) without what masses bend it by. Of the parts asked about:
    masses (P,), slopes (P, 10, F) per kilogram; `widths` (W, F) are standard deviations.
    """
    W, F = widths.shape
    seen = information @ J
    known = information - seen @ inverse_scaled(hessian) @ seen.T
    rest = information @ phi - pull
    out = np.zeros((W, len(masses)))
    for k in range(len(masses)):
        slope = masses[k] * slopes[k]
        A, g = slope.T @ (known @ slope), slope.T @ rest
        for w in range(W):
            scaled = np.outer(widths[w], widths[w]) * A
            for i in range(F):
                scaled[i, i] += 1.0
            h = widths[w] * g
            x = _solve(scaled, np.zeros(0), h)
            out[w, k] = -0.5 * (h @ x) - 0.5 * log_det(scaled)
    return out
