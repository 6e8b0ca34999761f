"""What the data alone see of a body, beside the sizes that are natural to it: rank, and which numbers they fix."""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from steelyard.check import Array, Mask
from steelyard.identify.cost.dense import eigen, product, product_transposed
from steelyard.inertia.people import people_jacobian

# Identified means: the data alone, without prior, give one standard deviation below these shares of
# the mass, of the radius of gyration, and of half the trace of the inertia about the centre of mass.
MASS_SHARE, COM_SHARE, INERTIA_SHARE = 0.1, 0.2, 0.1
SHARES = np.repeat([MASS_SHARE, COM_SHARE, INERTIA_SHARE], [1, 3, 6])
SMALLEST_RADIUS = 0.02
# A direction counts toward the rank when the data fix it to half its natural size.
RANK_INFORMATION = 4.0
# Below this information (a third of the natural size to the power -2), or below this share of the best seen direction,
# a direction is open.
OPEN, UNSEEN = 0.1, 1e-12


@dataclass(frozen=True, eq=False)
class Sight:
    """What the data alone see: rank, condition, std (10,) of mass, com, inertia about the CoM, and their sizes."""

    rank: int
    condition: float
    std: Array
    sizes: Array

    @classmethod
    def of(cls, F: Array, G: Array, phi: Array) -> Sight:
        """Return what information and score variance (10, 10) of phi (10,) see, the bias projected out."""
        return cls(*_sight(F, G, phi))

    @property
    def identified(self) -> Mask:
        """Which of the ten the data fix."""
        return identified(self.std, self.sizes)


@numba.njit(cache=True)
def natural_sizes(phi: Array) -> Array:
    """Return (10,) mass [kg], radius of gyration [m] for com x y z, half the trace of the inertia about it."""
    mass = max(abs(phi[0]), 1e-6)
    square = phi[1] * phi[1] + phi[2] * phi[2] + phi[3] * phi[3]
    trace = abs((phi[4] + phi[7] + phi[9]) / 2 - square / mass)
    out = np.empty(10)
    out[0] = mass
    for i in range(1, 4):
        out[i] = max(np.sqrt(trace / mass / 3), SMALLEST_RADIUS)
    for i in range(4, 10):
        out[i] = max(trace, mass * SMALLEST_RADIUS**2)
    return out


def identified(std: Array, sizes: Array) -> Mask:
    """Return which of mass, com and inertia about the CoM (10,) have standard deviations small beside their sizes."""
    return np.asarray(std < SHARES * sizes)


@numba.njit(cache=True)
def _sight(F: Array, G: Array, phi: Array) -> tuple[int, float, Array, Array]:
    """Return the fields of `Sight` from information and score variance (10, 10) of phi, the bias projected out.

    In natural units (mass m, length r, the radius of gyration) an eigenvalue 1 fixes a direction to its own size.
    """
    sizes = natural_sizes(phi)
    natural, scaled = np.empty(10), np.empty((10, 10))
    for i in range(10):
        natural[i] = sizes[i] if i == 0 else sizes[0] * sizes[1] * (1.0 if i < 4 else sizes[1])
    for i in range(10):
        for j in range(10):
            scaled[i, j] = F[i, j] * natural[i] * natural[j]
    values, vectors = eigen(scaled)
    into = np.empty((10, 10))
    for i in range(10):
        for k in range(10):
            into[i, k] = natural[i] * vectors[i, k]
    directions = product(people_jacobian(phi), into)
    # Directions that the data leave open may be off by several times their natural size, not by anything at all.
    least = max(OPEN, UNSEEN * values[-1])
    seen, open_end, rank, weakest = np.zeros((10, 10)), np.zeros(10), 0, np.inf
    for k in range(10):
        if values[k] > RANK_INFORMATION:
            rank += 1
            weakest = min(weakest, values[k])
        for i in range(10):
            if values[k] < least:
                open_end[i] += directions[i, k] ** 2 / OPEN
            else:
                seen[i, k] = directions[i, k] / values[k]
    bread = product_transposed(seen, into)
    half, std = product(bread, G), np.empty(10)
    for i in range(10):
        variance = 0.0
        for j in range(10):
            variance += half[i, j] * bread[i, j]
        std[i] = np.inf if open_end[i] > sizes[i] ** 2 else np.sqrt(max(variance, 0.0) + open_end[i])
    return rank, np.sqrt(values[-1] / weakest) if rank else np.inf, std, sizes
