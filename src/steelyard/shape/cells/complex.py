"""The Delaunay complex of the points of a cloud: its cells, edges and hull."""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from steelyard.check import Array, Integers
from steelyard.shape.cells.delaunay import tetrahedra, thinly
from steelyard.spatial import area_vectors

_NUDGE = 1e-7  # of the diagonal
_SIDES = 100  # facets of the hull that are asked which way is out
_LEVEL = 0.2  # spacings below a facet within which points lie on it


@dataclass(frozen=True, eq=False)
class Complex:
    """The Delaunay complex of N points.

    simplices  (S, 4) its cells
    beside     (S, 4) the cell opposite each corner, -1 without one
    start      (N + 1,) and other: the points joined to point i by edges are other[start[i]:start[i + 1]]
    hull       (F, 3) corners of the facets around all points
    across     (F, 3) their outward normals, as long as twice their area
    """

    simplices: Integers
    beside: Integers
    start: Integers
    other: Integers
    hull: Integers
    across: Array

    @classmethod
    def of(cls, xyz: Array, order: Integers) -> Complex:
        """Return the complex of points (N, 3) in units of their diagonal; `order` (N,) runs along a tree of theirs."""
        # Points in one plane or on one sphere have many complexes: moved by less than any measurement notices, one.
        moved = xyz + _NUDGE * np.random.default_rng(0).uniform(-1, 1, xyz.shape)
        simplices, beside = tetrahedra(moved, thinly(order)) or _by_qhull(moved)
        start, other = _edges(simplices, len(xyz))
        hull = _hull(simplices, beside)
        across = 2 * area_vectors(xyz[hull])
        outward = ((xyz[hull[:, 0]] - xyz[np.unique(hull)].mean(0)) * across).sum(1) >= 0
        across = np.where(outward[:, None], across, -across)
        return cls(simplices, beside, start, other, hull, across)

    def flux(self, xyz: Array, normals: Array, spacing: float) -> float:
        """Return how squarely the normals (N, 3) of points on the largest facets leave the hull: -1 to 1."""
        twice = np.linalg.norm(self.across, axis=1)
        largest = np.argsort(-twice, kind="stable")[:_SIDES]
        out = self.across[largest] / np.maximum(twice[largest], 1e-30)[:, None]
        on = xyz @ out.T > (xyz[self.hull[largest, 0]] * out).sum(1) - _LEVEL * spacing
        along = ((normals @ out.T) * on).sum(0) / np.maximum(on.sum(0), 1)
        return float((along * twice[largest]).sum() / twice[largest].sum())


def _by_qhull(xyz: Array) -> tuple[Integers, Integers]:
    from scipy.spatial import Delaunay

    made = Delaunay(xyz)
    return made.simplices.astype(np.int64), made.neighbors.astype(np.int64)


def _hull(simplices: Integers, beside: Integers) -> Integers:
    """Return the corners (F, 3) of the faces of cells that no other shares."""
    cell, corner = np.nonzero(beside < 0)
    return np.asarray(simplices[cell[:, None], (corner[:, None] + np.arange(1, 4)) % 4])


@numba.njit(cache=True, nogil=True)
def _edges(simplices: Integers, points: int) -> tuple[Integers, Integers]:
    """Return the points joined to each of N points: start (N + 1,) and other."""
    first = np.zeros(points + 1, np.int64)
    for s in range(len(simplices)):
        for k in range(4):
            first[simplices[s, k] + 1] += 1
    first = np.cumsum(first)
    cell, filled = np.empty(4 * len(simplices), np.int64), first.copy()
    for s in range(len(simplices)):
        for k in range(4):
            i = simplices[s, k]
            cell[filled[i]] = s
            filled[i] += 1
    start, other, found = np.zeros(points + 1, np.int64), np.empty(3 * len(cell), np.int64), np.full(points, -1)
    count = 0
    for i in range(points):
        for m in range(first[i], first[i + 1]):
            for k in range(4):
                j = simplices[cell[m], k]
                if j != i and found[j] != i:
                    found[j] = i
                    other[count] = j
                    count += 1
        start[i + 1] = count
    return start, other[:count].copy()
