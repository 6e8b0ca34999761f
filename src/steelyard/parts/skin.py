"""The boundary of a tetrahedral solid: its triangles, which of them meet, and how the surface turns between them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from steelyard.check import Array, Integers
from steelyard.shape.points.spacing import Neighbours
from steelyard.shape.tets import FACES, TetMesh
from steelyard.spatial import area_vectors, summed, unit_vectors

NEAR = 16
LINKED, APART = 6, -0.3  # neighbours linked to a vertex; cosine of normals that look out of opposite sides
OPPOSITE = -0.5  # product of the normals of a vertex and one behind it, on the other side of a thin wall
SMOOTH = 0.8  # weight of a neighbour's normal beside the vertex's own


@dataclass(frozen=True, eq=False)
class Skin:
    """F boundary triangles of a solid, and the E edges at which two of them meet.

    vertices   (V, 3) of the solid [m]
    triangles  (F, 3) counter-clockwise seen from outside
    cell       (F,) the tet behind each
    edges      (E, 2) vertices at the ends of each edge
    beside     (E, 2) the two triangles that meet there
    apex       (E, 2) the corner of each of them that is off the edge
    known      neighbours of the vertices, where they were looked for before
    """

    vertices: Array
    triangles: Integers
    cell: Integers
    edges: Integers
    beside: Integers
    apex: Integers
    known: Neighbours | None = None

    @cached_property
    def area_vectors(self) -> Array:
        """Outward normal of each triangle times its area (F, 3) [m^2]."""
        return area_vectors(self.vertices[self.triangles])

    @cached_property
    def areas(self) -> Array:
        """Area (F,) of each triangle [m^2]."""
        return np.asarray(np.linalg.norm(self.area_vectors, axis=1))

    @cached_property
    def lengths(self) -> Array:
        """Length (E,) of each edge [m]."""
        return np.asarray(np.linalg.norm(self.vertices[self.edges[:, 1]] - self.vertices[self.edges[:, 0]], axis=1))

    @cached_property
    def near(self) -> Integers:
        """The nearest other vertices (V, up to 16) of each, nearest first."""
        known = self.known or Neighbours.of(self.vertices, NEAR)
        return np.asarray(known.index[:, :NEAR], dtype=np.int64)

    @cached_property
    def links(self) -> Integers:
        """Pairs (L, 2) of vertices that lie beside each other: at the ends of an edge, or near and not looking apart.

        Few triangles lead from face to face of a sharp edge.
        """
        beside = self.near[:, :LINKED]
        pairs = np.stack([np.repeat(np.arange(len(beside)), beside.shape[1]), beside.ravel()], axis=1)
        facing = (self.normals[pairs[:, 0]] * self.normals[pairs[:, 1]]).sum(1)
        return np.concatenate([self.edges, pairs[facing > APART]])

    @cached_property
    def _vertex_sums(self) -> tuple[Array, Array]:
        corner, count = self.triangles.ravel(), len(self.vertices)
        area = np.bincount(corner, np.repeat(self.areas, 3), count)
        return summed(corner, np.repeat(self.area_vectors, 3, axis=0), count), np.asarray(area, dtype=np.float64)

    @cached_property
    def normals(self) -> Array:
        """Mean outward normal (V, 3) at each vertex, weighted by area; 0 inside."""
        return unit_vectors(self._vertex_sums[0])

    @cached_property
    def smooth_normals(self) -> Array:
        """Normals (V, 3) averaged over each vertex and its neighbours on the boundary."""
        total = self._vertex_sums[0]
        i, j = self.edges.T
        around = summed(i, total[j], len(total)) + summed(j, total[i], len(total))
        return unit_vectors(total + SMOOTH * around)

    @cached_property
    def flatness(self) -> Array:
        """How much the triangles at each vertex (V,) agree: 1 = one plane, small at edges and tips, 0 inside."""
        total, area = self._vertex_sums
        return np.asarray(np.linalg.norm(total, axis=1) / np.maximum(area, 1e-300))

    @cached_property
    def across(self) -> Array:
        """Unit vectors (E, 3) across each edge, from the apex of the first triangle to that of the second."""
        return unit_vectors(self.vertices[self.apex[:, 1]] - self.vertices[self.apex[:, 0]])

    @cached_property
    def turning(self) -> Array:
        """How far the surface turns up (E,) on the way across each edge [rad]: concave above 0, convex below.

        It is the change of the normals at the two apexes along the way between them, so that it spans three edges:
        single dihedral angles of a surface through scattered points are mostly noise.
        """
        return self._turn(self.smooth_normals)

    @cached_property
    def turning_behind(self) -> Array:
        """How far the other side of a thin wall turns up (E,) along the same ways [rad], 0 where there is none near.

        It is the turn between the vertices behind the apexes: the nearest whose normals are opposite.
        """
        normals = self.smooth_normals
        opposite = np.einsum("id,ikd->ik", normals, normals[self.near]) < OPPOSITE
        nearest = np.take_along_axis(self.near, opposite.argmax(1)[:, None], 1)[:, 0]
        thin = opposite.any(1)[self.apex].all(1)
        return np.where(thin, self._turn(normals[nearest]), 0.0)

    def _turn(self, normals: Array) -> Array:
        """Return how much less normals (V, 3) point along the way (E,) across each edge, at its end than before it."""
        change = normals[self.apex[:, 1]] - normals[self.apex[:, 0]]
        return np.asarray(-(change * self.across).sum(1))


def skin_of(mesh: TetMesh, known: Neighbours | None = None) -> Skin:
    """Return the boundary of a solid. Where four triangles share an edge they are taken two by two, in order.

    known  neighbours of its vertices, where they were looked for before
    """
    outer = mesh.neighbours.ravel() < 0
    triangles = mesh.tets[:, FACES].reshape(-1, 3)[outer]
    cell = np.repeat(np.arange(len(mesh)), 4)[outer]
    ends = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    low, high = ends.min(1), ends.max(1)
    key = low * len(mesh.vertices) + high
    area = np.linalg.norm(area_vectors(mesh.vertices[triangles]), axis=1)
    order = np.lexsort((np.repeat(area, 3), key))
    key = key[order]
    place = np.arange(len(key)) - np.searchsorted(key, key)
    first = np.flatnonzero((place[:-1] % 2 == 0) & (key[1:] == key[:-1]))
    one, two = order[first], order[first + 1]
    owner, apex = np.repeat(np.arange(len(triangles)), 3), triangles[:, [2, 0, 1]].ravel()
    return Skin(
        mesh.vertices,
        triangles,
        cell,
        np.stack([low[one], high[one]], axis=1),
        np.stack([owner[one], owner[two]], axis=1),
        np.stack([apex[one], apex[two]], axis=1),
        known,
    )
