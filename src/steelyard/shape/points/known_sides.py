"""Noise of points whose normals are known: how far they scatter along these, and the points brought to their surface.

The line between two points of a smooth surface is at right angles to the sum of their normals, up to the third power
of its length: what it rises along that sum is noise. Normals that are known hide it from all else: the solid of such
points looks clear, and is too large, since its cells reach to the outermost of them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from steelyard.check import Array, Integers, Mask
from steelyard.shape.points.spacing import evenly

# Noise over spacing below which it does little harm. Normals that were fitted to neighbours feign up to 0.22 on points
# without noise.
_NOISY = 0.25
_REACH, _NOISES = 2.5, 3.0  # of a neighbourhood: spacings and standard deviations of noise, at least
_LOOKED_AT = 500  # points that tell how noisy all are
_MOST = 160  # neighbours; more are not looked at
_ALIKE, _LIKER = 0.7, 0.9  # cosine between normals on one smooth surface, and where noise is read
_CLOSE = 0.5  # of the reach along the surface, where noise is read
_DEVIATION = 1.4826 / np.sqrt(2)  # standard deviation of one point over the median size of rises between two
_GROWN = 1.05  # times as much noise in a wider neighbourhood is more
_WITHIN = 4.0  # standard deviations from its sheet beyond which a neighbour is of another
_ROUNDS = 4
_ASIDE = -0.5  # cosine between normals above which neighbours that are not alike are of a side that meets at an edge
_BEYOND = 0.2  # of the noise that a point may lie over such a side


class Along(NamedTuple):
    """Points `rows` (K,) of a cloud, moved along their normals to `xyz` (K, 3), and the noise that they had [m]."""

    rows: Integers
    xyz: Array
    noise: float


def settled_along(xyz: Array, normals: Array, rows: Integers, spacing: float) -> Along | None:
    """Return the points `rows` of a cloud (M, 3) [m] moved along their normals onto their surface; None without noise.

    normals  (M, 3) unit vectors
    spacing  of the points that will be kept of them [m]

    Noise also moves points along their own face, past its edges: those are left out.
    """
    some = evenly(len(xyz), _LOOKED_AT)
    noise = 0.0
    for _ in range(_ROUNDS):
        reach = max(_REACH * spacing, _NOISES * noise)
        around = _Beside.of(xyz, normals, some, reach)
        if around.noise < max(_GROWN * noise, _NOISY * spacing):
            break
        noise = around.noise
    if not noise:
        return None
    offset = _Beside.of(xyz, normals, rows, reach).offset(noise)
    moved, sides = xyz[rows] + offset[:, None] * normals[rows], normals[rows]
    kept = ~_beyond_edges(moved, sides, reach, _BEYOND * noise)
    return Along(rows[kept], moved[kept], noise)


def _beyond_edges(xyz: Array, normals: Array, reach: float, least: float) -> Mask:
    """Return which points (N, 3) noise brought past an edge: over the side behind it, which lies under their own."""
    from scipy.spatial import cKDTree

    far, index = cKDTree(xyz).query(xyz, _MOST, distance_upper_bound=reach)
    index = np.where(np.isfinite(far), index, np.arange(len(xyz))[:, None])
    alike = np.einsum("nd,nkd->nk", normals, normals[index])
    away = xyz[index] - xyz[:, None]
    weight = (alike > _ASIDE) & (alike < _ALIKE)
    count = np.maximum(weight.sum(1), 1)
    over = -(weight * np.einsum("nkd,nkd->nk", away, normals[index])).sum(1) / count
    under = -(weight * np.einsum("nkd,nd->nk", away, normals)).sum(1) / count
    return np.asarray((over > least) & (under > least))


class _Beside(NamedTuple):
    """The neighbours (N, K) of points: their rise over each, the cosine between normals, how far along over the reach.

    Farther than 1 are those that do not count.
    """

    rise: Array
    alike: Array
    along: Array

    @classmethod
    def of(cls, xyz: Array, normals: Array, rows: Integers, reach: float) -> _Beside:
        from scipy.spatial import cKDTree

        step = 1
        while True:  # one point in so many is neighbour enough
            far, index = cKDTree(xyz[::step]).query(xyz[rows], _MOST, distance_upper_bound=reach)
            if np.median(np.isfinite(far).sum(1)) < _MOST:
                break
            step += 1
        found = np.isfinite(far) & (far > 0)
        index = np.where(found, step * index, rows[:, None])
        mean = normals[rows][:, None] + normals[index]
        alike = np.einsum("nd,nkd->nk", normals[rows], normals[index])
        mean /= np.sqrt(np.maximum(2 + 2 * alike, 1e-12))[..., None]
        rise = np.einsum("nkd,nkd->nk", xyz[index] - xyz[rows][:, None], mean)
        along = np.sqrt(np.maximum(far**2 - rise**2, 0, where=found, out=np.full(far.shape, np.inf))) / reach
        return cls(rise, alike, along)

    @property
    def noise(self) -> float:
        """The standard deviation of points across their surface [m]."""
        rise = self.rise[(self.alike > _LIKER) & (self.along < _CLOSE)]
        return _DEVIATION * float(np.median(np.abs(rise))) if rise.size else 0.0

    def offset(self, noise: float) -> Array:
        """Return how far above each point (N,) the sheet of its neighbours lies; its own height counts as well."""
        weight = np.where(self.alike > _ALIKE, np.maximum(1 - self.along**2, 0) ** 2, 0)
        found = np.zeros(len(weight))
        for _ in range(_ROUNDS):
            near = 1 - ((self.rise - found[:, None]) / (_WITHIN * noise)) ** 2
            within = weight * np.maximum(near, 0) ** 2
            found = (within * self.rise).sum(1) / (1 + within.sum(1))
        return found
