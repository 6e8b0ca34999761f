"""The paper's reconstruction, for comparison: ball pivoting, thickened by voxels, cut into tetrahedra.

Every surface is thickened on both sides by a share of the diagonal, whatever it is: volume grows 1.3 to 8.8 times on
the published objects. Use `volume.enclose` for a volume that is right.
Source: "The Sum of Its Parts", section IV-A; the constants are those of its code.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from scipy.ndimage import binary_dilation, label, map_coordinates
from scipy.spatial import Delaunay

from steelyard.check import Array, Integers, Mask
from steelyard.errors import BadValue
from steelyard.shape.ball_pivoting import ball_pivoting
from steelyard.shape.cloud import Cloud
from steelyard.shape.pairs import joined
from steelyard.shape.sides.tangent_planes import tangent_normals
from steelyard.shape.tets import TetMesh

# Shares of the diagonal.
LARGER_BALLS = (0.1, 0.2)
CELL = 0.01
OFFSET = 0.02  # 55 % of a range of 0.4 about zero
HOLE = 0.01  # beyond the offset: a hole through which no larger ball fits is closed
SURFACE_POINTS = 700
CRUMB = 0.01  # of the volume
_FLAT = 1e-12  # of the diagonal cubed: a cell with no more volume than this is none


@dataclass(frozen=True, eq=False)
class _Field:
    """Distance from the surface on a grid of nodes, negative inside; `origin` and `cell` [m]."""

    values: Array
    origin: Array
    cell: float

    def at(self, points: Array) -> Array:
        """Return the field at points (N, 3)."""
        return np.asarray(map_coordinates(self.values, ((points - self.origin) / self.cell).T, order=1))


def published_surface(cloud: Cloud) -> TetMesh:
    """Return the solid that the published route makes of a cloud, in the cloud's frame.

    Normals are those of the cloud, else of tangent planes. Raises BadValue for points in one plane.
    """
    diagonal = cloud.diagonal
    if len(cloud) < 4 or diagonal == 0:
        raise BadValue(f"a solid needs at least 4 points apart; got {len(cloud)} over {diagonal:g} m.")
    normals = tangent_normals(cloud.xyz) if cloud.normals is None else cloud.normals
    balls = diagonal * np.array([1 / np.sqrt(len(cloud)), *LARGER_BALLS])
    triangles = ball_pivoting(cloud.xyz, normals, balls.tolist())
    return _tetrahedra(_thickened(cloud.xyz[triangles], diagonal), diagonal)


def _thickened(corners: Array, diagonal: float) -> _Field:
    """Return the distance from triangles (F, 3, 3) less the offset; what it encloses counts as inside."""
    cell, offset = CELL * diagonal, OFFSET * diagonal
    reach = offset + 3 * cell
    low = corners.min((0, 1)) - reach - cell
    size = np.ceil((corners.max((0, 1)) + reach + cell - low) / cell).astype(np.int64) + 1
    values = np.full(size, reach)
    _spread(values, corners, low, cell, reach)
    values -= offset
    beyond, _ = label(values > HOLE * diagonal)
    outside = binary_dilation(beyond == beyond[0, 0, 0], iterations=2, mask=values > 0)
    values[(values > 0) & ~outside] *= -1
    return _Field(values, low, cell)


@numba.njit(cache=True)
def _spread(values: Array, corners: Array, origin: Array, cell: float, reach: float) -> None:
    """Lower every node near a triangle to its distance from it."""
    for t in range(len(corners)):
        triangle = corners[t]
        a, b, c = triangle[0], triangle[1], triangle[2]
        normal = np.cross(b - a, c - a)
        normal /= np.sqrt((normal**2).sum())
        first, last = np.empty(3, np.int64), np.empty(3, np.int64)
        for k in range(3):
            first[k] = int(np.ceil((min(a[k], b[k], c[k]) - reach - origin[k]) / cell))
            last[k] = int(np.floor((max(a[k], b[k], c[k]) + reach - origin[k]) / cell))
        point = np.empty(3)
        for i in range(first[0], last[0] + 1):
            point[0] = origin[0] + i * cell
            for j in range(first[1], last[1] + 1):
                point[1] = origin[1] + j * cell
                for k in range(first[2], last[2] + 1):
                    point[2] = origin[2] + k * cell
                    values[i, j, k] = min(values[i, j, k], _distance(point, triangle, normal))


@numba.njit(cache=True)
def _distance(p: Array, corners: Array, normal: Array) -> float:
    """Return the distance of a point from a triangle (3, 3): to the nearest side, or to its plane where p is above."""
    n0, n1, n2 = normal[0], normal[1], normal[2]
    above, best = True, np.inf
    for side in range(3):
        a, b = corners[side], corners[(side + 1) % 3]
        e0, e1, e2 = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        q0, q1, q2 = p[0] - a[0], p[1] - a[1], p[2] - a[2]
        share = min(max((e0 * q0 + e1 * q1 + e2 * q2) / (e0 * e0 + e1 * e1 + e2 * e2), 0.0), 1.0)
        best = min(best, (q0 - share * e0) ** 2 + (q1 - share * e1) ** 2 + (q2 - share * e2) ** 2)
        inner = (e1 * q2 - e2 * q1) * n0 + (e2 * q0 - e0 * q2) * n1 + (e0 * q1 - e1 * q0) * n2
        above = above and inner >= 0
    if above:
        a = corners[0]
        return float(abs(n0 * (p[0] - a[0]) + n1 * (p[1] - a[1]) + n2 * (p[2] - a[2])))
    return float(np.sqrt(best))


def _tetrahedra(field: _Field, diagonal: float) -> TetMesh:
    """Return the Delaunay cells inside the field over points spread evenly on its zero surface."""
    points = _crossings(field)
    points = points[_farthest(points, min(SURFACE_POINTS, len(points)))]
    cells = Delaunay(points).simplices
    solid = TetMesh(points, cells)
    solid = solid.chosen((field.at(solid.centroids) < 0) & (solid.volumes > _FLAT * diagonal**3))
    return solid.chosen(~_crumbs(solid))


def _crumbs(solid: TetMesh) -> Mask:
    """Return which cells belong to pieces so small that they are chips of the surface."""
    piece = joined(solid.dual, len(solid))
    volume = np.bincount(piece, solid.volumes)
    return np.asarray((volume < CRUMB * solid.volume)[piece])


def _crossings(field: _Field) -> Array:
    """Return the points (N, 3) where the edges of the grid cross zero."""
    found = []
    values = field.values
    for axis in range(3):
        here = np.moveaxis(values, axis, 0)[:-1]
        there = np.moveaxis(values, axis, 0)[1:]
        place = np.argwhere((here < 0) != (there < 0))
        u, v = here[tuple(place.T)], there[tuple(place.T)]
        node = np.insert(place[:, 1:], axis, place[:, 0], axis=1).astype(np.float64)
        node[:, axis] += u / (u - v)
        found.append(node)
    return np.asarray(field.origin + field.cell * np.concatenate(found))


@numba.njit(cache=True)
def _farthest(points: Array, count: int) -> Integers:
    """Return the numbers of `count` points, each the farthest from those before it."""
    chosen = np.zeros(count, np.int64)
    gap = np.full(len(points), np.inf)
    for n in range(1, count):
        last = points[chosen[n - 1]]
        best = 0
        for i in range(len(points)):
            d = (points[i, 0] - last[0]) ** 2 + (points[i, 1] - last[1]) ** 2 + (points[i, 2] - last[2]) ** 2
            gap[i] = min(gap[i], d)
            if gap[i] > gap[best]:
                best = i
        chosen[n] = best
    return chosen
