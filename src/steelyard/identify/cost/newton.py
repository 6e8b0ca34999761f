"""Newton's method on the noise-aware cost in log-Cholesky coordinates, so that every iterate is a rigid body.

P = U U^T with U = e^alpha [[U3, t], [0, 1]], t the centre of mass and U3 the upper triangular root of the second moment
per unit mass. The shape prior acts on U3 alone, so that it moves neither mass nor centre of mass directly:
    prior(U3) = gamma [ 3 log(r^2) - log det(U3 U3^T) ] + precision/2 (log r - log s)^2,  r^2 = tr(U3 U3^T)/3.
The first term is the entropic divergence from the ball that fits best (Lee, Wensing, Park 2019, with the prior's mass,
centre and size profiled out); the second a wide log-normal pull of the radius of gyration r to s.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from steelyard.check import Array
from steelyard.identify.cost.dense import downhill, product, product_transposed
from steelyard.identify.cost.noise_cost import derivatives, residual_map_of

# Newton converges quadratically: once the cost can fall by no more than this (half squared standard deviations), two
# full steps end at rounding, where a line search could only see noise.
NEAR = 1e-4

# Mass and centre of mass have no prior: where nothing shows them, this curvature (of a thirty-fold mass, of 30 m) keeps
# rounding from driving them off. It is no part of the cost.
DAMPING = 1e-3
# Curvatures below this, after scaling, count as this.
FLATTEST = 1e-9
# A step that is halved more often moves nothing.
HALVINGS = 30

# theta = [alpha, d1, d2, d3, s12, s23, s13, t1, t2, t3]: where each sits in U.
_ROW = np.array([0, 0, 1, 2, 0, 1, 0, 0, 1, 2])
_COLUMN = np.array([0, 0, 1, 2, 1, 2, 2, 3, 3, 3])


class Rows(NamedTuple):
    """What a log says, with its noise.

    T                     (p, 6, Z) design of the linear parameters, p = 10 or 16 with the wrench bias
    scatter               (C, Z, Z) scatter matrix of every noise class
    acceleration, wrench  (C, 6) variances of a class: moment or angular part first
    """

    T: Array
    scatter: Array
    acceleration: Array
    wrench: Array


class Priors(NamedTuple):
    """What is taken to hold beforehand.

    gamma                 weight of the entropic term
    log_size, precision   log of the radius of gyration [m], with the inverse of its variance
    bias, bias_precision  mean (6,) and inverse covariance (6, 6) of the wrench bias, moment first [N m, N]
    """

    gamma: float
    log_size: float
    precision: float
    bias: Array
    bias_precision: Array


@numba.njit(cache=True)
def factor(theta: Array) -> Array:
    """Return U (4, 4) from theta (10,)."""
    U = np.zeros((4, 4))
    scale = np.exp(theta[0])
    for k in range(1, 10):
        entry = np.exp(theta[k]) if k <= 3 else theta[k]
        U[_ROW[k], _COLUMN[k]] = scale * entry
    U[3, 3] = scale
    return U


@numba.njit(cache=True)
def vector_of(P: Array) -> Array:
    """Return phi (10,) of a symmetric P (4, 4): linear."""
    out = np.empty(10)
    out[0], out[1], out[2], out[3] = P[3, 3], P[0, 3], P[1, 3], P[2, 3]
    out[4], out[5], out[6] = P[1, 1] + P[2, 2], -P[0, 1], -P[0, 2]
    out[7], out[8], out[9] = P[0, 0] + P[2, 2], -P[1, 2], P[0, 0] + P[1, 1]
    return out


@numba.njit(cache=True, inline="always")
def _adjoint(g: Array) -> Array:
    """Return Gamma (4, 4), so that g . vector_of(dP) = <Gamma, dP> for symmetric dP."""
    out = np.zeros((4, 4))
    out[3, 3] = g[0]
    for i in range(3):
        out[i, 3] = out[3, i] = g[1 + i] / 2
    out[0, 0], out[1, 1], out[2, 2] = g[7] + g[9], g[4] + g[9], g[4] + g[7]
    out[0, 1] = out[1, 0] = -g[5] / 2
    out[0, 2] = out[2, 0] = -g[6] / 2
    out[1, 2] = out[2, 1] = -g[8] / 2
    return out


@numba.njit(cache=True)
def jacobian(theta: Array, U: Array) -> Array:
    """Return d phi / d theta (10, 10)."""
    out = np.empty((10, 10))
    scale = np.exp(theta[0])
    for k in range(10):
        if k == 0:
            half = product_transposed(U, U)
        else:
            half = np.zeros((4, 4))
            step = scale * (np.exp(theta[k]) if k <= 3 else 1.0)
            for j in range(4):
                half[_ROW[k], j] = step * U[j, _COLUMN[k]]
        for i in range(4):
            for j in range(i + 1):
                half[i, j] = half[j, i] = half[i, j] + half[j, i]
        column = vector_of(half)
        for i in range(10):
            out[i, k] = column[i]
    return out


@numba.njit(cache=True)
def _curvature(theta: Array, U: Array, g: Array) -> Array:
    """Return sum_k g_k d2 phi_k / d theta2 (10, 10)."""
    gamma = _adjoint(g)
    scale = np.exp(theta[0])
    out = np.zeros((10, 10))
    first = np.zeros(10)
    gU = product(gamma, U)
    step = np.empty(10)
    for k in range(1, 10):
        step[k] = scale * (np.exp(theta[k]) if k <= 3 else 1.0)
        first[k] = 2 * gU[_ROW[k], _COLUMN[k]] * step[k]
    first[0] = 0.0
    for i in range(4):
        for j in range(4):
            first[0] += 2 * gU[i, j] * U[i, j]
    # alpha scales all of U: dU/dalpha = U, so that second derivatives by alpha are twice the first ones.
    out[0, 0] = 2 * first[0]
    for k in range(1, 10):
        out[0, k] = out[k, 0] = 2 * first[k]
        for q in range(1, 10):
            if _COLUMN[k] == _COLUMN[q]:
                out[k, q] += 2 * gamma[_ROW[k], _ROW[q]] * step[k] * step[q]
        if k <= 3:
            out[k, k] += first[k]
    return out


@numba.njit(cache=True)
def shape_prior(theta: Array, gamma: float, log_size: float, precision: float) -> tuple[float, Array, Array]:
    """Return the prior, its gradient (10,) and Hessian (10, 10).

    With T = tr(U3 U3^T): gamma [3 log(T/3) - 2 (d1+d2+d3)] + precision/2 (log(T/3)/2 - log_size)^2.
    """
    gradient, hessian = np.zeros(10), np.zeros((10, 10))
    trace, dT, ddT = 0.0, np.zeros(10), np.zeros(10)
    for k in range(1, 7):
        square = np.exp(2 * theta[k]) if k <= 3 else theta[k] ** 2
        trace += square
        dT[k] = 2 * square if k <= 3 else 2 * theta[k]
        ddT[k] = 4 * square if k <= 3 else 2.0
    miss = 0.5 * np.log(trace / 3) - log_size
    total = gamma * (3 * np.log(trace / 3) - 2 * (theta[1] + theta[2] + theta[3])) + 0.5 * precision * miss**2
    slope = 3 * gamma + 0.5 * precision * miss
    for k in range(1, 7):
        gradient[k] = slope * dT[k] / trace - (2 * gamma if k <= 3 else 0.0)
        hessian[k, k] += slope * ddT[k] / trace
        for q in range(1, 7):
            hessian[k, q] += (0.25 * precision - slope) * dT[k] * dT[q] / trace**2
    return total, gradient, hessian


@numba.njit(cache=True)
def linear_of(u: Array) -> Array:
    """Return [phi, bias] (p,) from u = [theta, bias]."""
    out = u.copy()
    U = factor(u[:10])
    phi = vector_of(product_transposed(U, U))
    for k in range(10):
        out[k] = phi[k]
    return out


def cost_derivatives(u: Array, rows: Rows, priors: Priors) -> tuple[float, Array, Array]:
    """Return Q/2 + priors with gradient (p,) and Hessian (p, p) in u = [theta, bias] (p,), where p is 10 or 16."""
    U = factor(u)
    Q, g, H = derivatives(residual_map_of(rows.T, linear_of(u)), *rows)
    J = np.eye(len(u))
    J[:10, :10] = jacobian(u, U)
    prior, prior_gradient, prior_hessian = shape_prior(u, priors.gamma, priors.log_size, priors.precision)
    gradient, hessian = 0.5 * (J.T @ g), 0.5 * (J.T @ H @ J)
    gradient[:10] += prior_gradient
    hessian[:10, :10] += 0.5 * _curvature(u, U, g) + prior_hessian
    total = 0.5 * Q + prior
    if len(u) > 10:
        off = u[10:16] - priors.bias
        pull = priors.bias_precision @ off
        total += 0.5 * float(off @ pull)
        gradient[10:16] += pull
        hessian[10:16, 10:16] += priors.bias_precision
    return total, gradient, hessian


@numba.njit(cache=True)
def _downhill(gradient: Array, hessian: Array) -> Array:
    """Return the Newton step (see `dense.downhill`) of coordinates scaled to curvatures of one."""
    size = len(gradient)
    scale, scaled, slope = np.empty(size), np.empty((size, size)), np.empty(size)
    for i in range(size):
        own = hessian[i, i] + (DAMPING if i == 0 or 7 <= i <= 9 else 0.0)
        scale[i] = 1 / np.sqrt(max(abs(own), 1e-300))
        scaled[i, i] = own * scale[i] * scale[i]
        slope[i] = scale[i] * gradient[i]
    for i in range(size):
        for j in range(i):
            scaled[i, j] = scaled[j, i] = hessian[i, j] * scale[i] * scale[j]
    step = downhill(slope, scaled, FLATTEST)
    for i in range(size):
        step[i] *= scale[i]
    return step


def minimise(start: Array, rows: Rows, priors: Priors, iterations: int) -> tuple[Array, float, bool]:
    """Return the minimum u (p,), its cost and whether Newton converged, from `start` (p,) by damped Newton steps.

    A Hessian that is not positive definite has its negative curvatures turned round (saddle-free Newton); the step is
    kept within a trust length of 1 in log coordinates and halved until the cost falls.
    """
    u = start
    current, gradient, hessian = cost_derivatives(u, rows, priors)
    for _ in range(iterations):
        step = _downhill(gradient, hessian)
        fall = -float(gradient @ step)
        if 0.5 * fall < NEAR:
            current, gradient, hessian = cost_derivatives(u + step, rows, priors)
            return u + step + _downhill(gradient, hessian), current, True
        share = 1 / max(1.0, float(np.abs(step[:7]).max()))
        for _ in range(HALVINGS):
            trial, least = u + share * step, current - 1e-4 * share * abs(fall)
            now, gradient, hessian = cost_derivatives(trial, rows, priors)
            if now < least or now < current - 1e-10 * abs(current):
                break
            share *= 0.5
        else:
            return u, current, 0.5 * fall < 1e-3
        u, current = trial, now
    return u, current, False
