"""Tetrahedral meshes: a solid as cells of exact volume and moments, and which cells touch."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from steelyard import check
from steelyard.check import Array, Integers, Mask
from steelyard.errors import BadValue
from steelyard.shape.mesh import tetrahedra_moments
from steelyard.spatial import Pose, area_vectors, cross

# The faces of a tetrahedron, each opposite the corner of the same number, outward for positive volume.
FACES = ((1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1))
_ONE_KEY = 1 << 21  # vertices: three of their numbers fit in one of 64 bits


@dataclass(frozen=True, eq=False)
class TetMesh:
    """T tetrahedra over V vertices, each of positive volume.

    vertices  (V, 3) [m]
    tets      (T, 4) numbers of the corners; a cell given with negative orientation has two of them exchanged
    volumes   (T,) of each cell [m^3]
    """

    vertices: Array
    tets: Integers
    volumes: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        vertices = check.vectors("vertices", self.vertices)
        tets = np.array(check.whole("tets", self.tets))
        if vertices.ndim != 2 or tets.ndim != 2 or tets.shape[1] != 4 or not len(tets):
            raise BadValue(f"a solid needs vertices (V, 3) and tets (T, 4), T > 0; got {vertices.shape}, {tets.shape}.")
        if tets.min() < 0 or tets.max() >= len(vertices):
            raise BadValue(f"tets must name vertices 0..{len(vertices) - 1}; got {tets.min()}..{tets.max()}.")
        volumes = _turned(vertices, tets)
        tets.flags.writeable = False
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "tets", tets)
        object.__setattr__(self, "volumes", volumes)

    @classmethod
    def known(cls, vertices: Array, tets: Integers, volumes: Array, neighbours: Integers) -> TetMesh:
        """Return cells of positive `volumes` (T,) whose `neighbours` (T, 4) are known; nothing is looked at again."""
        mesh = cls.__new__(cls)
        mesh.__dict__.update(vertices=vertices, tets=tets, volumes=volumes, neighbours=neighbours)
        return mesh

    def __len__(self) -> int:
        return len(self.tets)

    @property
    def volume(self) -> float:
        """Volume of the solid [m^3]."""
        return float(self.volumes.sum())

    @cached_property
    def centroids(self) -> Array:
        """Centroid (T, 3) of each cell [m]."""
        return np.asarray(self.vertices[self.tets].mean(1))

    @cached_property
    def neighbours(self) -> Integers:
        """The cell (T, 4) behind the face opposite each corner, -1 at the surface."""
        a, b, c = self.tets[:, FACES].reshape(-1, 3).T
        low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
        if len(self.vertices) < _ONE_KEY:
            key = (low * len(self.vertices) + (a + b + c - low - high)) * len(self.vertices) + high
            order = np.argsort(key, kind="stable")
            same = key[order[1:]] == key[order[:-1]]
        else:
            corners = np.stack([low, a + b + c - low - high, high])
            order = np.lexsort(corners)
            same = (corners[:, order[1:]] == corners[:, order[:-1]]).all(0)
        first, second = order[:-1][same], order[1:][same]
        found = np.full(4 * len(self), -1, dtype=np.int64)
        found[first], found[second] = second // 4, first // 4
        return found.reshape(-1, 4)

    @cached_property
    def dual(self) -> Integers:
        """Pairs (E, 2) of cells that share a face, each once, the lower number first."""
        cell, other = np.repeat(np.arange(len(self)), 4), self.neighbours.ravel()
        return np.stack([cell, other], axis=1)[self._once]

    @cached_property
    def inner_faces(self) -> Integers:
        """Corners (E, 3) of the faces between the cells of `dual`, counter-clockwise seen from the second."""
        return self.tets[:, FACES].reshape(-1, 3)[self._once]

    @cached_property
    def inner_areas(self) -> Array:
        """Area (E,) of the faces between the cells of `dual` [m^2]."""
        return np.asarray(np.linalg.norm(area_vectors(self.vertices[self.inner_faces]), axis=1))

    @property
    def _once(self) -> Mask:
        """Which faces of cells (4 T,) have a cell of a higher number behind them."""
        return np.repeat(np.arange(len(self)), 4) < self.neighbours.ravel()

    @property
    def surface(self) -> Integers:
        """Triangles (F, 3) of the boundary, counter-clockwise seen from outside."""
        return self.tets[:, FACES].reshape(-1, 3)[self.neighbours.ravel() < 0]

    def moments(self, group: Any, count: int) -> Array:
        """Return the ten parameters (count, 10) of groups of cells at 1 kg/m^3; `group` (T,) numbers each cell's."""
        middle = self.vertices[self.tets.ravel()].mean(0)
        corners = np.moveaxis(self.vertices[self.tets] - middle, 1, 0)
        group = np.asarray(group, np.int64)
        return tetrahedra_moments(corners, self.volumes, group, np.tile(middle, (count, 1)))

    def chosen(self, cells: Any) -> TetMesh:
        """Return some of the cells over the same vertices, numbers or a mask."""
        tets = self.tets[cells]
        if "neighbours" not in self.__dict__ or not len(tets):
            return TetMesh(self.vertices, tets)
        number = np.full(len(self) + 1, -1)  # the last stands for what lies outside
        number[:-1][cells] = np.arange(len(tets))
        return TetMesh.known(self.vertices, tets, self.volumes[cells], number[self.neighbours[cells]])

    def in_frame(self, X_AB: Pose) -> TetMesh:
        """Return the same solid, given in B, seen from frame A."""
        return TetMesh(X_AB.apply(self.vertices), self.tets)


def _turned(vertices: Array, tets: Integers) -> Array:
    """Return the volume (T,) of every cell; of one that is negative two corners are exchanged."""
    a, b, c, d = np.moveaxis(vertices[tets], 1, 0)
    six = (cross(b - a, c - a) * (d - a)).sum(1)
    negative = six < 0
    tets[negative, 2:] = tets[negative, :1:-1]
    return np.asarray(np.abs(six) / 6)
