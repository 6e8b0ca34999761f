"""How densely a cloud samples its surface: neighbours, spacing, and the area that each point stands for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from steelyard.check import Array, Integers

COUNT = 24  # neighbours looked at
_CLOSE = 12  # neighbours that give the spacing
_FOLLOWED = 10  # neighbours on the same sheet that give the area
_LOOKED_AT = 300  # points that tell whether all lie on a grid
# Their neighbours looked at, the largest square of a distance over the least, how whole these are, how many must be.
_STEPS, _FARTHEST, _EXACT, _GRID = 6, 6.5, 0.01, 0.9
_ABOUT = -0.3  # cosine between normals below which a neighbour lies on the other side of a wall or gap


@dataclass(frozen=True, eq=False)
class Neighbours:
    """The nearest other points (N, K) of each point, nearest first, and how far they are (N, K)."""

    index: Integers
    distance: Array

    @classmethod
    def of(cls, xyz: Array, count: int = COUNT) -> Neighbours:
        """Return up to `count` neighbours of each of the points (N, 3)."""
        from scipy.spatial import cKDTree

        distance, index = cKDTree(xyz).query(xyz, min(count + 1, len(xyz)))
        return cls(index[:, 1:], distance[:, 1:])

    def reordered(self, order: Integers) -> Neighbours:
        """Return the same neighbours where points come in another order (N,)."""
        place = np.empty_like(order)
        place[order] = np.arange(len(order))
        return Neighbours(place[self.index[order]], self.distance[order])

    def scaled(self, factor: float) -> Neighbours:
        """Return the same neighbours with lengths `factor` times as large."""
        return Neighbours(self.index, factor * self.distance)

    @property
    def spacing(self) -> float:
        """Median side of the square of surface per point, were all close neighbours on one flat sheet."""
        k = min(_CLOSE, self.distance.shape[1])
        return float(np.median(self.distance[:, k - 1] * np.sqrt(np.pi / k)))


def nearest(among: Array, places: Array) -> Integers:
    """Return which of the points `among` (N, 3) is nearest to each of `places` (M, 3)."""
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(among).query(places)[1])


def evenly(count: int, most: int) -> Integers:
    """Return the numbers of up to `most` of `count` points, evenly along their order."""
    return np.linspace(0, count - 1, min(most, count)).astype(np.int64)


def areas(near: Neighbours, normals: Array) -> Array:
    """Return the area (N,) of surface that each point stands for; neighbours behind a wall or gap do not share it."""
    same = np.einsum("nd,nkd->nk", normals, normals[near.index]) > _ABOUT
    found = np.cumsum(same, axis=1)
    used = np.clip(found[:, -1], 1, _FOLLOWED)
    last = (found >= used[:, None]).argmax(1)
    return np.asarray(np.pi * near.distance[np.arange(len(last)), last] ** 2 / used)


def voxel_side(xyz: Array, index: Integers) -> float:
    """Return the side of the voxels whose centres points (N, 3) with neighbours (N, K), nearest first, are; 0 for none.

    Squares of distances between them are small multiples of the least.
    """
    rows = evenly(len(xyz), _LOOKED_AT)
    away = np.linalg.norm(xyz[index[rows, :_STEPS]] - xyz[rows, None], axis=-1)
    side = float(away.min())
    squared = (away / side) ** 2
    whole = (np.abs(squared - np.round(squared)) < _EXACT) & (squared < _FARTHEST)
    return side if whole.mean() > _GRID else 0.0
