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
from steelyard.identify.cost.linear import inverse_scaled, normal_equations
from steelyard.identify.problem import Problem
from steelyard.identify.solution import Solution
from steelyard.inertia.regressor import motion_map

# Gravity must spread by this along an axis of S [m/s^2], some three degrees.
SPREAD = 0.5
# What shows must be so many times as large, in squares, as noise makes it: by chance in one log of fifty.
SEEN = 2.25
# Gains of which less than this shows look like mass or a first moment.
PLAIN, ROUNDS = 0.1, 20
# A variance may be so many times what was found.
MOST = 2.0
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
    fit = _Fit.of(problem, solution, D)
    # Six channels, torques and then forces.
    kinds = np.repeat(np.eye(2), 3 * len(D), axis=0) * np.repeat(problem.heard, len(D))[:, None]
    seen = fit.seen(np.full((len(problem.scatter), 6), 1 / problem.samples), noise)
    square, quiet, count = seen.of(kinds)
    if not square @ (count / np.maximum(quiet, TINY)) > SEEN * count.sum() > 0:
        return None
    gains = _gains(motion_map(solution.linear[:10]) @ fit.along.sum(0)[:12] / problem.samples, problem.heard)
    # Rows at rest may have much less noise than others, and count as much more in the fit: what they show of an error,
    # noise and all, is about the most that it can be.
    most = fit.seen(fit.share, np.zeros_like(noise)).at_most(kinds, gains)
    variance, of_gains = (np.minimum(*both) for both in zip(seen.variances(kinds, gains), most, strict=True))
    pulled = fit.pull @ gains
    size = kinds.T @ (variance + gains**2 @ of_gains) / 3
    return PoseErrors(np.sqrt(size), (fit.pull * variance) @ fit.pull.T + (pulled * of_gains) @ pulled.T)


def _student(count: Array) -> Array:
    """Return by how much a variance that `count` numbers told is larger for those who do not know it (Student's t)."""
    return count / np.maximum(count - 2, 0.5)


@dataclass(frozen=True, eq=False)
class _Fit:
    """The fit, and the 6 K errors along the axes of D.

    residual  (6, Z) the residual map
    along     (C, Z, K) sums over the rows of z times a - g along the axes, by class
    pull      (p, 6 K) of each error at the parameters
    response  (p, p) by which these follow
    share     (C, 6) how much a row counts for a channel in the fit, one in all
    """

    T: Array
    residual: Array
    D: Array
    along: Array
    pull: Array
    response: Array
    share: Array

    @classmethod
    def of(cls, problem: Problem, solution: Solution, D: Array) -> _Fit:
        """Return what a solution makes of errors along the axes of D (K, Z)."""
        weights = problem.weights_at(solution.linear) if solution.weights is None else solution.weights
        along = problem.scatter @ D.T
        pull = np.einsum("cij,pjz,czk->pik", weights, problem.T, along, optimize=True).reshape(len(problem.T), -1)
        share = weights.diagonal(axis1=1, axis2=2) * problem.heard
        share = share / np.maximum(problem.scatter[:, 18, 18] @ share, TINY)
        response = _response(problem, solution, weights)
        return cls(problem.T, problem.residual_map(solution.linear), D, along, pull, response, share)

    def seen(self, share: Array, noise: Array) -> _Seen:
        """Return what residuals show of the errors, averaged over rows that count by `share` (C, 6).

        noise  (6, K, K) its variance of the mean, over rows that count alike, of every channel's residual times D z
        """
        axes, shown = np.arange(6), self.pull.shape[1]
        sums = np.einsum("ci,czk->izk", share, self.along)
        # Errors like themselves, how each parameter looks like them, and what the fit leaves of them.
        itself, by_noise = np.zeros((2, 6, len(self.D), 6, len(self.D)))
        itself[axes, :, axes], by_noise[axes, :, axes] = np.swapaxes(self.D @ sums, 1, 2), noise
        alike = np.einsum("piz,izk->pik", self.T, sums).reshape(len(self.T), shown)
        whole = np.linalg.pinv(itself.reshape(shown, shown), rcond=1e-6)
        left = np.eye(shown) - whole @ alike.T @ self.response @ self.pull
        found = whole @ np.einsum("iz,izk->ik", self.residual, sums).reshape(shown)
        return _Seen(left @ found, left, left @ by_noise.reshape(shown, shown) @ left.T)


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

    def variances(self, kinds: Array, gains: Array) -> tuple[Array, Array]:
        """Return the variances of every error (n,), and of gains (6,) beside them, as far as they are beyond noise."""
        torques, forces = (_axes(self.left, gains[:, of]) for of in (slice(0, 3), slice(3, 6)))
        axes, _ = np.linalg.qr(np.concatenate([torques[0], forces[0]], 1))
        square, quiet, count = self.without(axes).of(kinds)
        # Few numbers told a variance, which is uncertain itself: that of Student's t.
        variance = kinds @ (np.maximum(square - quiet, 0.0) / np.maximum(count, 1.0) * _student(count))
        # Gains of forces, and those of torques, may differ by more than the rest says.
        return variance, np.repeat([self.along(axes / plain, variance) for axes, plain in (torques, forces)], 3)

    def at_most(self, kinds: Array, gains: Array) -> tuple[Array, Array]:
        """Return the variances of `variances` as if nothing of what is found were noise."""
        axes = [_axes(self.left, gains[:, of]) for of in (slice(0, 3), slice(3, 6))]
        square, _, count = self.of(kinds)
        each = [((a.T @ self.found) ** 2).sum() / max(float(plain @ plain), TINY) for a, plain in axes]
        return kinds @ (MOST * square / np.maximum(count, 1.0)), np.repeat(MOST * np.array(each), 3)

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
    J, H = solution.chain, problem.plus_bias_prior(normal_equations(problem.T, problem.scatter, weights)[0])
    return np.asarray(J @ inverse_scaled(solution.with_prior(H)) @ J.T)


def _gains(felt: Array, heard: Mask) -> Array:
    """Return the errors (6 K, 6) that a gain of each channel makes, of a wrench that is `felt` (6, K) along D."""
    out = np.zeros((6, felt.shape[1], 6))
    out[np.arange(6), :, np.arange(6)] = felt * heard[:, None]
    return out.reshape(-1, 6)


def _axes(left: Array, gains: Array) -> tuple[Array, Array]:
    """Return orthonormal axes (n, r) along which a good part of gains (n, 3) is left, and how plainly (r,)."""
    axes, plain, _ = np.linalg.svd(left @ gains, full_matrices=False)
    shown = plain > PLAIN * max(float(np.linalg.norm(gains, 2)), TINY)
    return np.asarray(axes[:, shown]), np.asarray(plain[shown])
