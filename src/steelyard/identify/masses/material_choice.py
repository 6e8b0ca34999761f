"""Which material each part is made of, from a list: the mixed-integer choice of the paper's future work.

A choice gives every part the log-normal density of its material; its evidence is Laplace's, as in `density_priors`, and
few materials in one object are likelier than many (a Chinese restaurant again). Few choices are all tried; many are
drawn by their evidence. Their average is the answer, so that ties stay ties, and the spread between them is in its
error bars.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numba
import numpy as np
from scipy.special import softmax

from steelyard.check import Array, Integers, Mask
from steelyard.identify.masses.density_priors import TRUST, log_det, mode, spread_masses
from steelyard.identify.masses.material_sampling import draw, material_prior
from steelyard.identify.mixture import spread_of
from steelyard.parts.material import Material

# Up to this many choices all are tried.
EXHAUSTIVE = 3000
# A material is not ruled out for a part above this share of the evidence, or where it fits as well as the likeliest
# choice to within this chi-square: what only the prior for few materials prefers is not known from the log.
POSSIBLE, AS_GOOD = 0.05, 1.0


@dataclass(frozen=True, eq=False)
class Choices:
    """N choices looked at: masses (N, P), log evidence (N,), covariances (N, P, P), chi-square (N,) of log and
    tolerances up to a constant, material numbers (N, P).

    weight  (N,) of each choice by evidence
    doubt   (N,) by evidence to the power TRUST, as error bars count it

    Choices that are only there because they fit have no weight.
    """

    masses: Array
    evidence: Array
    spread: Array
    chi_square: Array
    chosen: Integers
    weight: Array
    doubt: Array

    def mixture(self) -> tuple[Array, Array]:
        """Return mean masses (P,) and their covariance (P, P), with the spread between choices."""
        mean = self.weight @ self.masses
        return mean, spread_of(self.doubt, self.masses - mean, self.spread)

    def shares(self, materials: int) -> Array:
        """Return the probability (P, materials) of each material for each part."""
        out = np.zeros((self.chosen.shape[1], materials))
        for k in range(materials):
            out[:, k] = self.weight @ (self.chosen == k)
        return out

    def possible(self, materials: int) -> Mask:
        """Say which materials (P, materials) are not ruled out for which part."""
        out = self.shares(materials) > POSSIBLE
        good = self.chosen[self.chi_square < self.chi_square[self.evidence.argmax()] + AS_GOOD]
        for k in range(materials):
            out[:, k] |= (good == k).any(0)
        return np.asarray(out)


def choose(A: Array, b: Array, volume: Array, materials: Sequence[Material], free: Array) -> Choices:
    """Return the choices of one material per part and what they weigh.

    A, b    the data as m^T A m / 2 - b^T m
    free    (P,) masses without any list: where drawing starts
    """
    density, tolerance = np.array([m.density for m in materials]), np.array([m.tolerance for m in materials])
    P, K = len(volume), len(materials)
    if P == 1 or K**P <= EXHAUSTIVE:
        tried = np.stack(np.meshgrid(*[np.arange(K)] * P, indexing="ij"), -1).reshape(-1, P)
        found = _all(A, b, volume, np.log(density), tolerance, tried)
        return Choices(*found, tried, *softmax(np.outer([1.0, TRUST], found[1]), axis=1))
    near = np.abs((np.log(np.maximum(free, 1e-9) / volume)[:, None] - np.log(density)) / tolerance).argmin(1)
    drawn = draw(A, b, volume, density, tolerance, near)
    tried, place = np.unique(np.concatenate(drawn), axis=0, return_inverse=True)
    by_evidence, annealed, _ = np.split(place.ravel(), np.cumsum([len(rows) for rows in drawn[:2]]))
    weights = (np.bincount(rows, minlength=len(tried)) / len(rows) for rows in (by_evidence, annealed))
    return Choices(*_all(A, b, volume, np.log(density), tolerance, tried), tried, *weights)


@numba.njit(cache=True)
def _one(
    A: Array, b: Array, volume: Array, centre: Array, tolerance: Array, chosen: Integers, masses: Array, spread: Array
) -> tuple[float, float]:
    """Return log evidence and chi-square of one choice; write masses (P,) and their covariance (P, P)."""
    P = len(volume)
    own, at, precision, prior = np.arange(P), np.empty(P), np.zeros((P, P)), 0.0
    count = np.zeros(len(centre), np.int64)
    for k in range(P):
        at[k] = centre[chosen[k]]
        precision[k, k] = tolerance[chosen[k]] ** -2
        prior += 2 * np.log(tolerance[chosen[k]])
        count[chosen[k]] += 1
    y, cost, hessian = mode(A, b, volume, own, precision, at, at)
    spread_masses(volume, own, y, hessian, masses, spread)
    return -cost - 0.5 * (prior + log_det(hessian)) + material_prior(count), 2 * cost


@numba.njit(cache=True)
def _all(
    A: Array, b: Array, volume: Array, centre: Array, tolerance: Array, tried: Integers
) -> tuple[Array, Array, Array, Array]:
    """Return masses, log evidence, covariance and chi-square of every choice."""
    N, P = tried.shape
    masses, evidence, spread, square = np.zeros((N, P)), np.zeros(N), np.zeros((N, P, P)), np.zeros(N)
    for i in range(N):
        evidence[i], square[i] = _one(A, b, volume, centre, tolerance, tried[i], masses[i], spread[i])
    return masses, evidence, spread, square
