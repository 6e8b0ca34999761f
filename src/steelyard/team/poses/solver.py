"""Steps and covariance of a joint fit from its information, in the directions that the motion shows.

Homes and delays always follow the grasps and are eliminated first; what is then left for the grasps decides which of
their directions are shown.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh
from scipy.linalg.lapack import dpotri, dtrtri

from steelyard.check import Array
from steelyard.logs.log import Integers, Mask
from steelyard.team.poses.statistic import OWN

# A direction of a grasp is shown where the motion along it is so many times the noise of a single row: from noise
# alone, poses look as if they moved that much.
SHOWN = 5.0
# A pivot of the homes and delays, scaled to a diagonal of ones, that is smaller than this may be rounding.
PIVOT = 1e-6
# Eigenvalues below this share of the largest are taken for zero: rounding.
RANK = 1e-15


@dataclass(frozen=True, eq=False)
class Shown:
    """What the motion shows of the unknown parameters.

    inverse  (K, K) their covariance for white noise, zero along what is lost
    lost     (K, L) directions of theirs that the motion does not show, unit length in units of the noise
    """

    inverse: Array
    lost: Array


@dataclass(frozen=True, eq=False)
class Solver:
    """Steps from pulls on K parameters, of which G are of grasps.

    grasp    (K,) which they are
    root     (K - G, R) of the inverse information about homes and delays, which is root root^T
    carried  (G, R) the information that grasps share with them, times that root
    inner    (G, G) covariance of the grasps for white noise, zero along what is lost
    lost     (G, L) directions of theirs that are not shown
    """

    grasp: Mask
    root: Array
    carried: Array
    inner: Array
    lost: Array

    @classmethod
    def of(cls, H: Array, unknown: Integers, noise: Array, rows: int) -> Solver:
        """Return the solver of information H (K, K) about the parameters `unknown` (K,)."""
        grasp = unknown % OWN < 6
        root = _root(H[np.ix_(~grasp, ~grasp)])
        carried = H[np.ix_(grasp, ~grasp)] @ root
        left = H[np.ix_(grasp, grasp)] - carried @ carried.T
        scale = unit(unknown[grasp], noise, rows)
        inner, lost = _shown(left * np.outer(scale, scale))
        return cls(grasp, root, carried, inner * np.outer(scale, scale), scale[:, None] * lost)

    def step(self, pull: Array) -> Array:
        """Return the step (K,) for a pull."""
        rest, out = self.root.T @ pull[~self.grasp], np.empty_like(pull)
        out[self.grasp] = self.inner @ (pull[self.grasp] - self.carried @ rest)
        out[~self.grasp] = self.root @ (rest - self.carried.T @ out[self.grasp])
        return out

    def variance(self, chosen: Mask) -> Array:
        """Return the variances of chosen (K,) homes and delays for white noise."""
        root = self.root[chosen[~self.grasp]]
        along = root @ self.carried.T
        return np.asarray((root**2).sum(1) + ((along @ self.inner) * along).sum(1))

    def all_shown(self) -> Shown:
        """Return the covariance for white noise, and what is lost."""
        size = len(self.grasp)
        inverse, lost = np.empty((size, size)), np.zeros((size, self.lost.shape[1]))
        back = -(self.inner @ self.carried) @ self.root.T
        inverse[np.ix_(self.grasp, self.grasp)] = self.inner
        inverse[np.ix_(self.grasp, ~self.grasp)] = back
        inverse[np.ix_(~self.grasp, self.grasp)] = back.T
        inverse[np.ix_(~self.grasp, ~self.grasp)] = self.root @ (self.root.T - self.carried.T @ back)
        lost[self.grasp] = self.lost
        return Shown(inverse, lost)


def unit(grasp: Integers, noise: Array, rows: int) -> Array:
    """Return steps of the parameters `grasp` (G,) that all rows together tell by their noise (N, 2) alone."""
    turn, place = noise[grasp // OWN].T
    return np.asarray(1 / np.sqrt(np.where(grasp % OWN < 3, 2.0, (turn / place) ** 2) * rows))


def _root(H: Array) -> Array:
    """Return F with F F^T the inverse of H, or the pseudo-inverse where H is singular, as without any row of a robot.

    Cholesky where its pivots leave no doubt. Raises LinAlgError where H is no information, as of steps that diverged.
    """
    if not (np.diag(H) >= 0).all():
        raise np.linalg.LinAlgError("the information is negative: the fit has diverged")
    scale = 1 / np.sqrt(np.maximum(np.diag(H), 1e-300))
    try:
        factor = np.linalg.cholesky(H * np.outer(scale, scale))
    except np.linalg.LinAlgError:
        factor = np.zeros_like(H)
    if np.diag(factor).min(initial=1.0) > PIVOT:
        return np.asarray(scale[:, None] * dtrtri(factor.T, lower=0)[0])
    values, vectors = np.linalg.eigh(H)
    there = values > RANK * values[-1]
    return np.asarray(vectors[:, there] / np.sqrt(values[there]))


def _shown(left: Array) -> tuple[Array, Array]:
    """Return the inverse (G, G) of information in units of a row's noise, zero along what is lost, and that (G, L).

    What is lost is given the information of the others while the rest is inverted, and taken out again.
    """
    try:
        np.linalg.cholesky(left - SHOWN**2 * np.eye(len(left)))
        lost = np.zeros((len(left), 0))
        filled, share = left, 1.0
    except np.linalg.LinAlgError:
        values, lost = eigh(left, subset_by_value=(-np.inf, SHOWN**2), check_finite=False)
        share = max(float(np.trace(left)) / len(left), SHOWN**2)
        filled = left + (lost * (share - values)) @ lost.T
    half = dpotri(np.linalg.cholesky(filled), lower=1)[0]
    inverse = half + half.T
    inverse[np.diag_indices_from(inverse)] *= 0.5
    return np.asarray(inverse - lost @ lost.T / share), np.asarray(lost)
