"""Masses and tilts of one model of parts that are not homogeneous, compiled: mode, evidence, and the score of a part.

phi = sum_k m_k b_k(u_k), m_k = V_k exp(y_k). The cost is that of the log, 1/2 phi^T F phi - pull^T phi, with Gaussian
priors on the log densities y and on the tilts u; its mode is found by Gauss and Newton in y and u at once, the evidence
is Laplace's. The score of one more part is the same with its tilt linear about zero: nothing is fitted.
Source: own; the score test is Rao's (1948).
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from steelyard.check import Array, Integers
from steelyard.identify.cost.dense import cholesky, moved, product, solved, times, transposed
from steelyard.identify.cost.linear import inverse_scaled
from steelyard.identify.masses.density_priors import DEEPEST, log_det

STEPS, HALVINGS, FALL = 40, 12, 1e-3
LONGEST_TILT = 0.7  # in one step
# A tilt beyond this puts the whole part into one point.
STEEPEST = 30.0


class Seen(NamedTuple):
    """What a log and the priors of densities say of P parts.

    information, pull  (10, 10) and (10,) of the log: its cost is 1/2 phi^T F phi - pull^T phi
    per_mass           (10, P) the parameters of a kilogram of each part, its density even
    volume             (P,) [m^3]
    precision, centre  (P, P) of the log densities, and their mean
    """

    information: Array
    pull: Array
    per_mass: Array
    volume: Array
    precision: Array
    centre: float


class Free(NamedTuple):
    """The f parts whose density may change within, by F tilts each.

    row                         (f,) among all parts
    variance                    (F f,) of the tilts
    weight, features, per_mass  (f, N), (f, N, F), (f, N, 10) of N points in each
    """

    row: Integers
    variance: Array
    weight: Array
    features: Array
    per_mass: Array


@numba.njit(cache=True, nogil=True)
def tilted(weight: Array, features: Array, per_mass: Array, tilt: Array) -> tuple[Array, Array]:
    """Return b (10,) per kilogram of points (N, 10) tilted by u (F,), and db/du (10, F)."""
    N, F = features.shape
    share, highest, whole = times(features, tilt), -STEEPEST, 0.0
    for n in range(N):
        share[n] = min(max(share[n], -STEEPEST), STEEPEST)
        highest = max(highest, share[n])
    for n in range(N):
        share[n] = weight[n] * np.exp(share[n] - highest)
        whole += share[n]
    b, mean, slope = np.zeros(10), np.zeros(F), np.zeros((10, F))
    for n in range(N):
        part = share[n] / whole
        for f in range(F):
            mean[f] += part * features[n, f]
        for j in range(10):
            moment = part * per_mass[n, j]
            b[j] += moment
            for f in range(F):
                slope[j, f] += moment * features[n, f]
    for j in range(10):
        for f in range(F):
            slope[j, f] -= b[j] * mean[f]
    return b, slope


def fitted(seen: Seen, free: Free, y: Array, tilts: Array) -> tuple[Array, Array, float, Array, Array, Array, Array]:
    """Return the mode y (P,), tilts (F f,), its cost, what masses bend it by (P,), the Hessian (q, q) without that,
    d phi (10, q) and phi (10,), q = P + F f; y, tilts: where to start.
    """
    P = len(seen.volume)
    x = np.concatenate([y, tilts])
    found = _cost(seen, free, x)
    for _ in range(STEPS):
        before, gradient, curve, hessian = found[:4]
        step = _solve(hessian, curve - gradient[:P], gradient)
        if -(gradient @ step) < FALL:
            break
        step *= _most(step[:P], step[P:])
        for _ in range(HALVINGS):
            # Straight in the densities, as in `density_priors.mode`.
            moved_to = np.concatenate([x[:P] + np.log1p(step[:P]), x[P:] + step[P:]])
            trial = _cost(seen, free, moved_to)
            if trial[0] < before:
                x, found = moved_to, trial
                break
            step *= 0.5
        if before - found[0] < FALL:
            break
    cost, _, curve, hessian, J, phi = found
    return x[:P].copy(), x[P:].copy(), cost, curve, hessian, J, phi


def _most(densities: Array, tilts: Array) -> float:
    """Return the share of a step that takes no density, of itself, and no tilt too far."""
    far = max(-densities.min(initial=0.0) / DEEPEST, np.abs(tilts).max(initial=0.0) / LONGEST_TILT)
    return float(1 / max(far, 1.0))


@numba.njit(cache=True, nogil=True)
def _cost(seen: Seen, free: Free, x: Array) -> tuple[float, Array, Array, Array, Array, Array]:
    """Return the cost at x = [y, tilts] (q,), its gradient (q,), what masses bend it by (P,), the Gauss-Newton Hessian,
    d phi and phi.
    """
    information, pull, B, volume, precision, centre = seen
    row, variance, weight, features, per_mass = free
    P, F, q = len(volume), features.shape[2], len(x)
    J, phi, mass = np.zeros((10, q)), np.zeros(10), np.empty(P)
    for k in range(P):
        mass[k] = volume[k] * np.exp(min(x[k], 20.0))
        for j in range(10):
            J[j, k] = mass[k] * B[j, k]
    for f in range(len(row)):
        k, first = row[f], P + f * F
        b, slope = tilted(weight[f], features[f], per_mass[f], x[first : first + F])
        for j in range(10):
            J[j, k] = mass[k] * b[j]
            for i in range(F):
                J[j, first + i] = mass[k] * slope[j, i]
    for j in range(10):
        for k in range(P):
            phi[j] += J[j, k]
    pushed, cost = times(information, phi), 0.0
    for j in range(10):
        cost += phi[j] * (0.5 * pushed[j] - pull[j])
    back = transposed(J)
    gradient, hessian = times(back, moved(pushed, pull, -1.0)), product(back, product(information, J))
    curve = gradient[:P].copy()
    off = np.empty(P)
    for k in range(P):
        off[k] = x[k] - centre
    drawn = times(precision, off)
    for k in range(P):
        cost += 0.5 * off[k] * drawn[k]
        gradient[k] += drawn[k]
        for j in range(P):
            hessian[k, j] += precision[k, j]
    for i in range(q - P):
        pulled = x[P + i] / variance[i]
        cost += 0.5 * x[P + i] * pulled
        gradient[P + i] += pulled
        hessian[P + i, P + i] += 1 / variance[i]
    return cost, gradient, curve, hessian, J, phi


@numba.njit(cache=True, nogil=True)
def _solve(hessian: Array, curve: Array, gradient: Array) -> Array:
    """Return the step -(H + max(curve, 0))^-1 g, by Cholesky."""
    full = hessian.copy()
    for k in range(len(curve)):
        full[k, k] += max(curve[k], 0.0)
    return solved(cholesky(full, 1e-9)[0], moved(np.zeros(len(gradient)), gradient, -1.0))


def evidence_of(
    cost: float, hessian: Array, curve: Array, spread: float, wide: float, parts: int, variance: Array
) -> float:
    """Return Laplace's log evidence of a mode: densities `spread` apart about a common one known to `wide`.

    hessian (q, q), curve (P,), variance (F f,) as `fitted` has them; `spread` and `wide` are variances of log density.
    """
    prior = (parts - 1) * np.log(spread) + np.log(spread + parts * wide) + np.log(variance).sum()
    full = hessian.copy()
    full[range(parts), range(parts)] += curve
    return float(-cost - 0.5 * (prior + log_det(full)))


def scores(
    information: Array, pull: Array, phi: Array, J: Array, hessian: Array, masses: Array, slopes: Array, widths: Array
) -> Array:
    """Return how much the log evidence rises (W, P) with one more part free, its tilt linear about zero.

    The state is a mode: phi (10,), J (10, q), hessian (q, q) without what masses bend it by. Of the parts asked about:
    masses (P,), slopes (P, 10, F) per kilogram; `widths` (W, F) are standard deviations.
    """
    seen = information @ J
    known = information - seen @ inverse_scaled(hessian) @ seen.T
    back = masses[:, None, None] * slopes.transpose(0, 2, 1)
    A, g = back @ known @ back.transpose(0, 2, 1), back @ (information @ phi - pull)
    scaled = np.eye(widths.shape[1]) + (widths[:, :, None] * widths[:, None, :])[:, None] * A
    h = (widths[:, None] * g)[..., None]
    gain = (h * np.linalg.solve(scaled, h)).sum((2, 3))
    return np.asarray(0.5 * gain - 0.5 * np.linalg.slogdet(scaled)[1])
