"""What a log says about phi alone: information with noise taken out, bias projected out, sandwich folded in."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numba
import numpy as np

from steelyard.check import Array
from steelyard.identify import noise_cost
from steelyard.identify.linear import inverse_scaled, nonnegative, normal_equations
from steelyard.identify.newton import residual_map_of
from steelyard.identify.problem import Problem


@dataclass(frozen=True, eq=False)
class Effective:
    """Information F (10, 10) and F phi_hat (10,), and how the bias (0 or more) follows phi."""

    information: Array
    pull: Array
    bias_at: Array
    bias_slope: Array

    @classmethod
    def of(cls, problem: Problem, linear: Array, score: Array | None) -> Effective:
        """Return F = H V^-1 H at the linear parameters (p,), V the variance (p, p) of the score.

        H is the information with the noise of the acceleration taken out of the scatter, so that H phi = g is
        consistent; V adds what that noise does to the score, or is `score` where the log's own correlation is known.
        """
        data = (linear, problem.T, problem.scatter, problem.acceleration, problem.wrench)
        score = np.zeros((0, 0)) if score is None else score
        return cls(*_effective(*data, problem.bias_prior.mean, problem.bias_prior.precision, score))

    def blurred(self, error: Array) -> Effective:
        """Return what is said about a body that is known up to an error with covariance (10, 10): (F^-1 + G)^-1."""
        shrink = np.linalg.inv(np.eye(10) + self.information @ error)
        information = shrink @ self.information
        return replace(self, information=0.5 * (information + information.T), pull=shrink @ self.pull)

    def linear_at(self, phi: Array) -> Array:
        """Return [phi, bias] (p,) with the bias that fits best beside phi (10,)."""
        return np.concatenate([phi, self.bias_at - self.bias_slope @ phi])

    def misfit(self, phi: Array) -> float:
        """Return how much worse phi (10,) fits than the best ten numbers, as a chi-square."""
        best = inverse_scaled(self.information) @ self.pull
        gap = phi - best
        return max(float(gap @ self.information @ gap), 0.0)


@numba.njit(cache=True)
def _effective(
    linear: Array, T: Array, scatter: Array, acceleration: Array, wrench: Array,
    bias_mean: Array, bias_precision: Array, score: Array,
) -> tuple[Array, Array, Array, Array]:  # fmt: skip
    """Return the fields of `Effective` at `linear` (p,); an empty `score` means that noise is white."""
    size = len(linear)
    H, extra, plain, g = _statistics(linear, T, scatter, acceleration, wrench)
    H = nonnegative(H, plain)
    V = H + extra if score.shape[0] == 0 else score.copy()
    if size > 10:
        g[10:16] += bias_precision @ bias_mean
        H, bread = H.copy(), np.zeros((size - 10, size - 10))
        V[10:16, 10:16] += bias_precision
        H[10:16, 10:16] += bias_precision
        bread = inverse_scaled(H[10:, 10:])
    else:
        bread = np.zeros((0, 0))
    project = np.zeros((10, size))
    project[:, :10] = np.eye(10)
    if size > 10:
        project[:, 10:] = -np.ascontiguousarray(H[:10, 10:]) @ bread
    slope = project @ np.ascontiguousarray(H[:, :10])
    half = slope @ inverse_scaled(project @ V @ project.T)
    information = half @ slope
    bias_at = bread @ g[10:]
    bias_slope = bread @ np.ascontiguousarray(H[10:, :10])
    return 0.5 * (information + information.T), half @ (project @ g), bias_at, bias_slope


@numba.njit(cache=True)
def _statistics(
    linear: Array, T: Array, scatter: Array, acceleration: Array, wrench: Array
) -> tuple[Array, Array, Array, Array]:
    """Return the information H, what noise adds to it, the plain normal matrix and its right side at `linear` (p,)."""
    K = residual_map_of(T, linear)
    H, extra, plain = noise_cost.information(K, T, scatter, acceleration, wrench)
    weights = np.zeros((scatter.shape[0], 6, 6))
    for c in range(scatter.shape[0]):
        weights[c] = noise_cost.weight(K, acceleration[c], wrench[c])
    _, g = normal_equations(T, scatter, weights)
    return H, extra, plain, g
