"""Errors of the wrench that come back with the pose: of gains, of an arm's own model, of a cable.

In slow motion all that such an error does to mass and centre of mass goes through its part that is linear in gravity as
S sees it (in a - g where S accelerates): 18 numbers, six channels by three axes. A body takes up four of them and
leaves the others as residual. All of one kind, of forces or of torques, are taken to be drawn alike, so that those that
show tell how large those are that do not. Gains of the three channels of a kind, which in the mean look like mass or a
first moment, may be larger. Unlike noise, all this is no smaller in a longer log.
Source: own; a random-effects model whose variances are found by moments.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from steelyard.check import Array, Mask
from steelyard.identify.linear import inverse_scaled, normal_equations
from steelyard.identify.noise_cost import weights_at
from steelyard.identify.problem import Problem
from steelyard.identify.regressor import motion_map
from steelyard.identify.solution import Solution

# Gravity must spread by this along an axis of S [m/s^2], some three degrees.
SPREAD = 0.5
# What shows must be so many times as large, in squares, as noise makes it: by chance in one log of fifty.
SEEN = 2.0
# Gains of which less than this shows look like mass or a first moment.
PLAIN, ROUNDS = 0.1, 20
TINY = 1e-100


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
    along, channels = problem.scatter @ D.T, np.repeat(problem.heard, len(D))
    seen, pull = _seen(problem, solution, along, noise)
    # Six channels, torques and then forces.
    kinds = np.repeat(np.eye(2), 3 * len(D), axis=0) * channels[:, None]
    square, quiet, count = seen.of(kinds)
    if not square @ (count / np.maximum(quiet, TINY)) > SEEN * count.sum() > 0:
        return None
    gains = _gains(motion_map(solution.linear[:10]) @ along.sum(0)[:12] / problem.samples, problem.heard)
    torques, forces = (_axes(seen.left @ gains[:, of]) for of in (slice(0, 3), slice(3, 6)))
    axes, _ = np.linalg.qr(np.concatenate([torques[0], forces[0]], 1))
    square, quiet, count = seen.without(axes).of(kinds)
    beyond = np.maximum(square - quiet, 0.0)
    variance = kinds @ (beyond / np.maximum(count, 1.0) * _student(count))
    # Gains of forces, and those of torques, may differ by more than the rest says.
    of_gains = np.repeat([seen.along(axes / plain, variance) for axes, plain in (torques, forces)], 3)
    score = (pull * variance) @ pull.T + ((pull @ gains) * of_gains) @ (pull @ gains).T
    each = ((gains.reshape(2, 3 * len(D), 6) ** 2) @ of_gains).sum(1) / 3
    return PoseErrors(np.sqrt(len(D) * beyond / np.maximum(count, 1.0) + each), score)


def _seen(problem: Problem, solution: Solution, along: Array, noise: Array) -> tuple[_Seen, Array]:
    """Return what residuals show of the 6 K errors, and how each pulls at the parameters (p, 6 K).

    along  (C, Z, K) sums over the rows of z times a - g along the axes
    """
    weights = solution.weights
    if weights is None:
        weights = weights_at(solution.linear, problem.T, problem.acceleration, problem.wrench)
    size, shown = len(problem.T), 6 * along.shape[2]
    pull = np.einsum("cij,pjz,czk->pik", weights, problem.T, along, optimize=True).reshape(size, shown)
    # How each parameter looks like errors, and what the fit leaves of an error.
    alike = (problem.T @ along.sum(0)).reshape(size, shown) / problem.samples
    left = np.eye(shown) - alike.T @ _response(problem, solution, weights) @ pull
    found = left @ (problem.residual_map(solution.linear) @ along.sum(0)).ravel() / problem.samples
    by_noise = np.zeros((6, along.shape[2], 6, along.shape[2]))
    by_noise[np.arange(6), :, np.arange(6)] = noise
    return _Seen(found, left, left @ by_noise.reshape(shown, shown) @ left.T), pull


def _student(count: Array) -> Array:
    """Return by how much a variance that `count` numbers told is larger for those who do not know it (Student's t)."""
    return count / np.maximum(count - 2, 0.5)


@dataclass(frozen=True, eq=False)
class _Seen:
    """What residuals show of errors (n,): found = left errors + noise, whose covariance is `noise` (n, n)."""

    found: Array
    left: Array
    noise: Array

    def of(self, kinds: Array) -> tuple[Array, Array, Array]:
        """Return for each kind (n, 2) the sum of squares, what noise makes of it, and how many errors it shows."""
        return self.found**2 @ kinds, np.diag(self.noise) @ kinds, (self.left**2).sum(1) @ kinds

    def without(self, axes: Array) -> _Seen:
        """Return what is seen across some orthonormal axes (n, r)."""
        rest = np.eye(len(self.found)) - axes @ axes.T
        return _Seen(rest @ self.found, rest @ self.left, rest @ self.noise @ rest)

    def along(self, axes: Array, variance: Array) -> float:
        """Return the variance along axes (n, r), one for all, beyond noise and errors of `variance` (n,)."""
        if not axes.size:
            return 0.0
        square = (axes.T @ self.found) ** 2
        quiet = np.diag(axes.T @ (self.noise + (self.left * variance) @ self.left.T) @ axes)
        found = float(np.maximum(square - quiet, 0.0).max(initial=0.0))
        # Most likely where each is weighted by how well it tells.
        for _ in range(ROUNDS):
            told = np.maximum(found + quiet, TINY) ** -2.0
            found = max(float(told @ (square - quiet) / told.sum()), 0.0)
        return found * float(_student(((found / np.maximum(found + quiet, TINY)) ** 2).sum()))


def _response(problem: Problem, solution: Solution, weights: Array) -> Array:
    """Return how the parameters follow the score, (p, p)."""
    J = np.eye(len(problem.T))
    J[:10, :10] = solution.jacobian
    H = problem.plus_bias_prior(normal_equations(problem.T, problem.scatter, weights)[0])
    A = J.T @ H @ J
    A[:10, :10] += solution.prior
    return np.asarray(J @ inverse_scaled(A) @ J.T)


def _gains(felt: Array, heard: Mask) -> Array:
    """Return the errors (6 K, 6) that a gain of each channel makes, of a wrench that is `felt` (6, K) along D."""
    out = np.zeros((6, felt.shape[1], 6))
    out[np.arange(6), :, np.arange(6)] = felt * heard[:, None]
    return out.reshape(-1, 6)


def _axes(shape: Array) -> tuple[Array, Array]:
    """Return orthonormal axes (n, r) along which gains show, that look like `shape` (n, 3), and how plainly (r,)."""
    axes, plain, _ = np.linalg.svd(shape, full_matrices=False)
    shown = plain > PLAIN * max(float(plain.max(initial=0.0)), TINY)
    return np.asarray(axes[:, shown]), np.asarray(plain[shown])
