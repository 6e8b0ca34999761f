"""Which material each part is made of, from a list: the mixed-integer choice of the paper's future work.

A choice gives every part the log-normal density of its material; its evidence is Laplace's, as in `density_priors`, and
few materials in one object are likelier than many (a Chinese restaurant again). Few choices are all tried; many are
searched from several starts. What was tried is averaged by evidence, so
that ties stay ties.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numba
import numpy as np

from steelyard.check import Array
from steelyard.identify.density_priors import canonical, log_det, mode, partition_prior, place_of, spread_masses
from steelyard.logs.log import Integers, Mask
from steelyard.parts.material import Material

# Up to this many choices all are tried.
EXHAUSTIVE = 3000
MOST, SWEEPS = 4000, 6
# A material is not ruled out for a part above this share of the evidence, or where it fits as well as the likeliest
# choice to within this chi-square: what only the prior for few materials prefers is not known from the log.
POSSIBLE, AS_GOOD = 0.05, 1.0


@dataclass(frozen=True, eq=False)
class Choices:
    """N choices looked at: masses (N, P), log evidence (N,), covariances (N, P, P), chi-square (N,) of log and
    tolerances up to a constant, material numbers (N, P).
    """

    masses: Array
    evidence: Array
    spread: Array
    chi_square: Array
    chosen: Integers

    def shares(self, materials: int) -> Array:
        """Return the probability (P, materials) of each material for each part."""
        weight = np.exp(self.evidence - self.evidence.max())
        weight /= weight.sum()
        out = np.zeros((self.chosen.shape[1], materials))
        for k in range(materials):
            out[:, k] = weight @ (self.chosen == k)
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
    free    (P,) masses without any list: where the search starts
    """
    centre = np.log([m.density for m in materials])
    tolerance = np.array([m.tolerance for m in materials])
    P, K = len(volume), len(materials)
    if K**P <= EXHAUSTIVE:
        tried = np.stack(np.meshgrid(*[np.arange(K)] * P, indexing="ij"), -1).reshape(-1, P)
        return Choices(*_all(A, b, volume, centre, tolerance, tried), tried)
    density = np.log(np.maximum(free, 1e-9) / volume)
    near = np.abs((density[:, None] - centre) / tolerance).argmin(1)
    starts = np.stack([near, *(np.full(P, k) for k in range(K))])
    masses, evidence, spread, square, chosen, count = _search(A, b, volume, centre, tolerance, starts)
    return Choices(masses[:count], evidence[:count], spread[:count], square[:count], chosen[:count])


@numba.njit(cache=True)
def _one(
    A: Array, b: Array, volume: Array, centre: Array, tolerance: Array, chosen: Integers, masses: Array, spread: Array
) -> tuple[float, float]:
    """Return log evidence and chi-square of one choice; write masses (P,) and their covariance (P, P)."""
    P = len(volume)
    own, at, precision, prior = np.arange(P), np.empty(P), np.zeros((P, P)), 0.0
    for k in range(P):
        at[k] = centre[chosen[k]]
        precision[k, k] = tolerance[chosen[k]] ** -2
        prior += 2 * np.log(tolerance[chosen[k]])
    y, cost, hessian = mode(A, b, volume, own, precision, at, at)
    spread_masses(volume, own, y, hessian, masses, spread)
    group, groups = canonical(chosen)
    evidence = -cost - 0.5 * (prior + log_det(hessian)) + partition_prior(group, groups)
    for taken in range(groups):
        evidence -= np.log(float(max(len(centre) - taken, 1)))
    return evidence, 2 * cost


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


@numba.njit(cache=True)
def _search(
    A: Array, b: Array, volume: Array, centre: Array, tolerance: Array, starts: Integers
) -> tuple[Array, Array, Array, Array, Integers, int]:
    """Return what was tried from the starts (S, P): one part, all parts of one material, or two exchanged."""
    P, K = len(volume), len(centre)
    masses, evidence, spread = np.zeros((MOST, P)), np.zeros(MOST), np.zeros((MOST, P, P))
    square, known, count = np.zeros(MOST), np.zeros((MOST, P), np.int64), 0
    for s in range(len(starts)):
        current, best = starts[s], -np.inf
        for _sweep in range(SWEEPS):
            improved = False
            for move in range(P + K):
                base = current
                for choice in range(K + (P if move < P else 0)):
                    trial = base.copy()
                    if move >= P:
                        for k in range(P):
                            if base[k] == move - P:
                                trial[k] = choice
                    elif choice < K:
                        trial[move] = choice
                    else:
                        trial[move], trial[choice - K] = base[choice - K], base[move]
                    place = place_of(trial, known, count)
                    if place == count:
                        if count == MOST:
                            return masses, evidence, spread, square, known, count
                        count += 1
                        found = _one(A, b, volume, centre, tolerance, trial, masses[place], spread[place])
                        evidence[place], square[place] = found
                    if evidence[place] > best + 1e-9:
                        best, current, improved = evidence[place], trial, True
            if not improved:
                break
    return masses, evidence, spread, square, known, count
