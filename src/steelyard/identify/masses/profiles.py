"""How the density may change within a part: exponential tilts of an even density, always above zero.

A density exp(u f(x)) with f the position and its products, each of mean zero and unit size over the part, is the one
nearest to an even density (in relative entropy) among all that have the same moments E f. The ten parameters per
kilogram b(u) = E_u z(x) and their slope Cov_u(z, f) are sums over points in the part; every such body is consistent.
Source: own; maximum entropy as in Jaynes 1957.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from steelyard.check import Array
from steelyard.identify.masses import tilting
from steelyard.inertia import InertialParameters, forms
from steelyard.parts.parts import Parts

POINTS = 150
# Tilts: three of position and six of its products.
FEATURES = 9
# Points this few, or this much out of shape, do not stand for a part.
FEWEST_POINTS, OUT_OF_SHAPE = 20, 4.0


@dataclass(frozen=True, eq=False)
class Profile:
    """One part as weighted points whose mean and second moments are exactly those of the part.

    place     (N, 3) in units of the standard deviation along each principal axis, mean zero
    weight    (N,) adding up to one
    per_mass  (N, 10) the ten parameters of a kilogram at each point
    axes      (3, 3) columns: principal axes in the frame of the parts, and size (3,) [m] along each
    """

    place: Array
    weight: Array
    per_mass: Array
    axes: Array
    size: Array
    features: Array

    @classmethod
    def of(cls, parts: Parts, part: int) -> Profile:
        """Return the profile of part number `part` (its row): of points inside it, or of a box of its moments."""
        body = InertialParameters(parts.moments[part] / parts.volume[part])
        centre = body.com
        second = body.pseudo_inertia[:3, :3] - np.outer(centre, centre)
        values, axes = np.linalg.eigh(second)
        size = np.sqrt(np.maximum(values, 1e-12 * values[-1]))
        place, weight = _inside(parts, part, centre, axes, size)
        points = centre + place * size @ axes.T
        moments = np.concatenate([np.ones((len(points), 1)), points, forms.upper(forms.point_inertia(points))], 1)
        return cls(place, weight, moments, axes, size, _features(place, weight))

    def tilted(self, tilt: Array) -> tuple[Array, Array]:
        """Return b (10,) per kilogram at a tilt u (F,), and db/du (10, F)."""
        return tilting.tilted(self.weight, self.features, self.per_mass, tilt)

    def weights(self, tilt: Array) -> Array:
        """Return the share (N,) of the mass at each point."""
        power = np.clip(self.features @ tilt, -tilting.STEEPEST, tilting.STEEPEST)
        weight = self.weight * np.exp(power - power.max())
        return np.asarray(weight / weight.sum())

    def shift(self, tilt: Array) -> Array:
        """Return how far (3,) a tilt moves the centre of mass, in standard deviations along the principal axes."""
        return np.asarray(self.weights(tilt) @ self.place)


def _features(place: Array, weight: Array) -> Array:
    """Return position and its products (N, 9), of mean zero, uncorrelated with what comes before, of unit size."""
    columns = [place[:, k] for k in range(3)] + [place[:, i] * place[:, j] for i, j in forms.UPPER]
    raw = np.stack(columns, 1)
    raw -= weight @ raw
    linear = raw[:, :3]
    quadratic = raw[:, 3:] - linear @ ((weight[:, None] * linear).T @ raw[:, 3:])
    size = np.sqrt(weight @ quadratic**2)
    return np.concatenate([linear, quadratic / np.maximum(size, 1e-6)], 1)


def _inside(parts: Parts, part: int, centre: Array, axes: Array, size: Array) -> tuple[Array, Array]:
    """Return points (N, 3) and weights (N,) of a part, in standard deviations along its axes, of covariance one."""
    if parts.interior is None:
        return _box()
    points, volume = parts.interior.points(part, POINTS)
    # Thin parts get a point for every line that meets them.
    step = max(1, len(points) // POINTS)
    points, volume = points[::step], volume[::step]
    if len(points) < FEWEST_POINTS:
        return _box()
    place, weight = (points - centre) @ axes / size, volume / volume.sum()
    place -= weight @ place
    values, vectors = np.linalg.eigh((weight[:, None] * place).T @ place)
    if values[0] < 1 / OUT_OF_SHAPE or values[-1] > OUT_OF_SHAPE:
        return _box()
    return place @ ((vectors / np.sqrt(values)) @ vectors.T), weight


def _box() -> tuple[Array, Array]:
    """Return points (125, 3) and weights of a box of covariance one: five of Gauss and Legendre along each axis."""
    nodes, weights = np.polynomial.legendre.leggauss(5)
    grid = np.stack(np.meshgrid(nodes, nodes, nodes, indexing="ij"), -1).reshape(-1, 3)
    shares = np.einsum("i,j,k->ijk", weights, weights, weights).ravel() / 8
    return np.sqrt(3) * grid, shares
