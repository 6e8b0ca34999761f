"""What a log says about phi alone: information with noise taken out, bias projected out, sandwich folded in."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numba
import numpy as np

from steelyard.check import Array
from steelyard.identify import noise_cost
from steelyard.identify.dense import product, symmetric, times
from steelyard.identify.linear import inverse_scaled, nonnegative, right_side, without_bias
from steelyard.identify.problem import Problem

# A direction is shown where its information is above this share of the largest.
SHOWN = 1e-9


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
        shrink = self.information @ error
        shrink.flat[::11] += 1.0
        found = np.linalg.solve(shrink, np.column_stack([self.information, self.pull]))
        information = 0.5 * (found[:, :10] + found[:, :10].T)
        return Effective(information, found[:, 10].copy(), self.bias_at, self.bias_slope)

    def linear_at(self, phi: Array) -> Array:
        """Return [phi, bias] (p,) with the bias that fits best beside phi (10,)."""
        return np.concatenate([phi, self.bias_at - self.bias_slope @ phi])

    def misfit(self, phi: Array) -> float:
        """Return how much worse phi (10,) fits than the best ten numbers, as a chi-square."""
        gap = phi - self.best
        return max(float(gap @ self.information @ gap), 0.0)

    @cached_property
    def best(self) -> Array:
        """The ten numbers (10,) that fit best."""
        return np.asarray(inverse_scaled(self.information) @ self.pull)

    @cached_property
    def rank(self) -> int:
        """How many directions of phi the log shows at all."""
        values = np.linalg.eigvalsh(self.information)
        return int((values > SHOWN * values[-1]).sum())


@numba.njit(cache=True)
def _effective(
    linear: Array, T: Array, scatter: Array, acceleration: Array, wrench: Array,
    bias_mean: Array, bias_precision: Array, score: Array,
) -> tuple[Array, Array, Array, Array]:  # fmt: skip
    """Return the fields of `Effective` at `linear` (p,); an empty `score` means that noise is white."""
    size = len(linear)
    K = noise_cost.residual_map_of(T, linear)
    H, extra, plain = noise_cost.information(K, T, scatter, acceleration, wrench)
    g = right_side(T, scatter, noise_cost.weights_at(linear, T, acceleration, wrench))
    H = nonnegative(H, plain)
    V = np.empty((size, size))
    for i in range(size):
        for j in range(size):
            V[i, j] = score[i, j] if len(score) else H[i, j] + extra[i, j]
    if size > 10:
        for i in range(6):
            for j in range(6):
                V[10 + i, 10 + j] += bias_precision[i, j]
                H[10 + i, 10 + j] += bias_precision[i, j]
                g[10 + i] += bias_precision[i, j] * bias_mean[j]
    F, G, bias_slope, bread = without_bias(H, V)
    half = product(F, inverse_scaled(G))
    bias_at, pull = times(bread, g[10:]), g[:10].copy()
    for j in range(10):
        for i in range(size - 10):
            pull[j] -= bias_slope[i, j] * g[10 + i]
    return symmetric(product(half, F)), times(half, pull), bias_at, bias_slope
