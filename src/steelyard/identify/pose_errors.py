"""Errors of the wrench that come back with the pose: of gains, of an arm's own model, of a cable.

In slow motion all that such an error does to mass and centre of mass goes through its part that is linear in gravity as
S sees it (in a - g where S accelerates): 18 numbers, six channels by three axes. A body takes up four of them and
leaves the others as residual. All of one kind, of forces or of torques, are taken to be drawn alike, so that those that
show tell how large those are that do not. Unlike noise, they are no smaller in a longer log.
Source: own; a random-effects model whose variances are found by moments.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from steelyard.check import Array
from steelyard.identify.linear import inverse_scaled, normal_equations
from steelyard.identify.noise_cost import weights_at
from steelyard.identify.problem import Problem
from steelyard.identify.solution import Solution

# Gravity must spread by this along an axis of S [m/s^2], some three degrees.
SPREAD = 0.5
# What shows must be so many times as large, in squares, as noise makes it: by chance in one log of fifty.
SEEN = 2.0


def directions(problem: Problem) -> Array:
    """Return D (K, Z), K <= 3, so that D z of a row is its a - g along K axes of S, of mean zero and unit size.

    All rows count alike. Weighted as in the fit, where rows at rest may count a hundred times as much as others, few of
    them would be left to tell what comes back.
    """
    S = problem.scatter.sum(0)
    mean = S[3:6, 18] / S[18, 18]
    values, axes = np.linalg.eigh(S[3:6, 3:6] / S[18, 18] - np.outer(mean, mean))
    far = values > SPREAD**2
    out = np.zeros((int(far.sum()), len(S)))
    out[:, 3:6] = (axes[:, far] / np.sqrt(values[far])).T
    out[:, 18] = -out[:, 3:6] @ mean
    return out


@dataclass(frozen=True, eq=False)
class PoseErrors:
    """Errors of the wrench that come back with the pose.

    size      (2,) rms over the rows of what is linear in a - g, of a torque [N m] and of a force [N]
    variance  (p, p) what they add to that of the score
    """

    size: Array
    variance: Array

    @property
    def note(self) -> str:
        """What there is to say of them."""
        torque, force = self.size
        return (
            f"the wrench has errors that come back with the pose, of some {force:.2g} N and {torque:.2g} N m: the "
            "error bars hold what they may do to the answer"
        )


def pose_errors(problem: Problem, solution: Solution, D: Array, noise: Array) -> PoseErrors | None:
    """Return the errors that come back with the pose; None where residuals show none.

    D      (K, Z) as from `directions`
    noise  (6, K, K) what noise makes the variance of the mean over the rows of a channel's residual times D z
    """
    weights = solution.weights
    if weights is None:
        weights = weights_at(solution.linear, problem.T, problem.acceleration, problem.wrench)
    size, shown, along = len(problem.T), 6 * len(D), problem.scatter @ D.T
    # How each error pulls at the parameters, how each parameter looks like errors, and what the fit leaves of an error.
    pull = np.einsum("cij,pjz,czk->pik", weights, problem.T, along, optimize=True).reshape(size, shown)
    alike = (problem.T @ along.sum(0)).reshape(size, shown) / problem.samples
    left = np.eye(shown) - alike.T @ _response(problem, solution, weights) @ pull
    found = left @ (problem.residual_map(solution.linear) @ along.sum(0)).ravel() / problem.samples
    spread = np.zeros((6, len(D), 6, len(D)))
    spread[np.arange(6), :, np.arange(6)] = noise
    by_noise = ((left @ spread.reshape(shown, shown)) * left).sum(1)
    # Six channels, torques and then forces.
    kinds = np.repeat(np.eye(2), 3 * len(D), axis=0) * np.repeat(problem.heard, len(D))[:, None]
    square, quiet, count = found**2 @ kinds, by_noise @ kinds, (left**2).sum(1) @ kinds
    if not square @ (count / np.maximum(quiet, 1e-300)) > SEEN * count.sum() > 0:
        return None
    # Few numbers told the variance, which is uncertain itself: that of Student's t.
    beyond = np.maximum(square - quiet, 0.0)
    variance = kinds @ (beyond / np.maximum(count - 2, 1.0))
    rms = np.sqrt(len(D) * beyond / np.maximum(count, 1.0))
    return PoseErrors(rms, (pull * variance) @ pull.T)


def _response(problem: Problem, solution: Solution, weights: Array) -> Array:
    """Return how the parameters follow the score, (p, p)."""
    J = np.eye(len(problem.T))
    J[:10, :10] = solution.jacobian
    H = problem.plus_bias_prior(normal_equations(problem.T, problem.scatter, weights)[0])
    A = J.T @ H @ J
    A[:10, :10] += solution.prior
    return np.asarray(J @ inverse_scaled(A) @ J.T)
