"""What a log says about phi alone: information with noise taken out, bias projected out, sandwich folded in."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from steelyard.check import Array
from steelyard.identify.cost.linear import inverse_scaled, nonnegative, right_side, without_bias
from steelyard.identify.problem import Problem

# A direction is shown where its information is above this share of the largest.
SHOWN = 1e-9


@dataclass(frozen=True, eq=False)
class Effective:
    """Information F (10, 10) and F phi_hat (10,), and how the bias (b numbers, 0 or more) follows phi.

    score_weight  (10, 10) H V^-1: what a step of the score is worth in F phi_hat; the identity where it is not needed
    bias_own      (b, b) covariance of the bias at a given phi
    """

    information: Array
    pull: Array
    bias_at: Array
    bias_slope: Array
    score_weight: Array = field(default_factory=lambda: np.eye(10))
    bias_own: Array = field(default_factory=lambda: np.zeros((0, 0)))

    @classmethod
    def of(cls, problem: Problem, linear: Array, score: Array | None) -> Effective:
        """Return F = H V^-1 H at the linear parameters (p,), V the variance (p, p) of the score.

        H is the information with the noise of the acceleration taken out of the scatter, so that H phi = g is
        consistent; V adds what that noise does to the score, or is `score` where the log's own correlation is known.
        """
        H, extra, plain = problem.information(linear)
        H = nonnegative(H, plain)
        V = problem.plus_bias_prior(H + extra if score is None else score)
        g = problem.plus_bias_pull(right_side(problem.T, problem.scatter, problem.weights_at(linear)))
        F, G, follow, own = without_bias(problem.plus_bias_prior(H), V)
        half = F @ inverse_scaled(G)
        information = half @ F
        pull = half @ (g[:10] - g[10:] @ follow)
        return cls(0.5 * (information + information.T), pull, own @ g[10:], follow, half, own)

    def left_by(self, error: Array) -> Array:
        """Return (F^-1 + G)^-1 F^-1 (10, 10): what an error with covariance G leaves of F phi_hat."""
        return np.asarray(np.linalg.inv(np.eye(10) + self.information @ error))

    def blurred(self, error: Array) -> Effective:
        """Return what is said about a body that is known up to an error with covariance (10, 10): (F^-1 + G)^-1."""
        information, rest = self._shrunk(error, self.pull)
        return replace(self, information=information, pull=rest[:, 0].copy())

    def _shrunk(self, error: Array, *columns: Array) -> tuple[Array, Array]:
        """Return (F^-1 + G)^-1 (10, 10) of an error G (10, 10), and (1 + F G)^-1 times some columns (10, k)."""
        shrink: Array = self.information @ error
        shrink.flat[::11] += 1.0
        found = np.asarray(np.linalg.solve(shrink, np.column_stack([self.information, *columns])), np.float64)
        return 0.5 * (found[:, :10] + found[:, :10].T), found[:, 10:]

    def cost_of(self, error: Array) -> float:
        """Return what the log evidence of `blurred(error)` lacks beside that of other errors, up to what all share.

        Half of log det(I + F G) + phi_hat^T (F^-1 + G)^-1 phi_hat: a wider error makes every log less likely.
        """
        size = np.linalg.slogdet(np.eye(10) + self.information @ error)[1]
        return float(0.5 * (size + self.best @ self.blurred(error).pull))

    def beside(self, known: Array, covariance: Array) -> Effective:
        """Return what is said about the rest of a body, of which a part `known` (10,) up to `covariance` is taken away.

        phi_hat - known is the rest's, with the error of both.
        """
        information, rest = self._shrunk(covariance, self.pull - self.information @ known, self.score_weight)
        return replace(
            self,
            information=information,
            pull=rest[:, 0].copy(),
            score_weight=rest[:, 1:].copy(),
            bias_at=self.bias_at - self.bias_slope @ known,
        )

    def response(self, follows: Array) -> Array:
        """Return how [phi, bias] (p,) follows the score (p,), where phi follows F phi_hat by `follows` (10, 10)."""
        body, slope = follows @ self.score_weight, self.bias_slope
        return np.block([[body, -body @ slope.T], [-slope @ body, self.bias_own + slope @ body @ slope.T]])

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
