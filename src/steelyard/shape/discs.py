"""Winding numbers of flat elements: discs whose field does not thin out within a wall, however thin.

A Kuzmin disc of area a, depth d and normal n has the density a d / (2 pi (r^2 + d^2)^1.5) in its plane; from either
side its field is that of a dipole set back by d behind the plane. Source: Kuzmin 1956, the potential of a flat disc.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np

from steelyard.shape.mesh import Integers
from steelyard.shape.winding import FOUR_PI, ONE, Sight, Tree, seen, with_leaves

Array = Any  # single precision here, double at the border


@dataclass(frozen=True, eq=False)
class Discs:
    """Flat elements on the points of a tree, ordered as it is.

    tree    of the N points
    normal  (3, N) unit normals, float32
    area    (N,), float32
    depth   (N,), float32
    soft    height over a disc within which its jump from one side to the other is spread
    """

    tree: Tree
    normal: Array
    area: Array
    depth: Array
    soft: float

    @classmethod
    def on(cls, tree: Tree, normals: Array, area: Array, depth: float, soft: float) -> Discs:
        """Return discs of unit normals (N, 3) and areas (N,) in the order given; `depth` in sides of their squares."""
        chosen = np.asarray(area)[tree.order]
        return cls(
            tree, _single(np.asarray(normals)[tree.order].T), _single(chosen), _single(depth * chosen**0.5), soft
        )

    def winding(self, sight: Sight, share: Array | None = None, every: int = 1) -> Array:
        """Return the winding number (M,) at every `every`-th leaf of the targets; each disc counts by its `share`."""
        leaves, start, points = sight.chosen(every)
        area = self.area if share is None else _single(self.area * share)
        own = np.concatenate([self.tree.points, self.normal, area[None], self.depth[None]])
        leaf = with_leaves(self.tree, self.normal * area)[1]
        out = np.empty(points.shape[1], np.float32)
        _winding(own, leaf, self.tree.start, sight.near[leaves], points, start, np.float32(self.soft**2), out)
        return out

    def adjoint(self, sight: Sight, weights: Array) -> Array:
        """Return the sum (N,) over the points of weight times what each disc adds to the point's winding number."""
        own, leaf = with_leaves(self.tree, _single(weights)[None])
        out = np.empty(len(self.area), np.float32)
        tree, soft = self.tree, np.float32(self.soft**2)
        _adjoint(own, leaf, tree.start, sight.near, tree.points, self.normal, self.depth, soft, out)
        return out * self.area


def _single(values: Any) -> Array:
    return np.ascontiguousarray(values, np.float32)


@numba.njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _winding(
    own: Array, leaf: Array, start: Integers, near: Array, points: Array, first: Integers, soft: Any, out: Array
) -> None:
    size = own.shape[1] + leaf.shape[1]
    all_seen, inverse, turn = np.empty((8, size), np.float32), np.empty(size, np.float32), np.empty(size, np.float32)
    sx, sy, sz, mx, my, mz = all_seen[0], all_seen[1], all_seen[2], all_seen[3], all_seen[4], all_seen[5]
    area, depth = all_seen[6], all_seen[7]
    for t in range(len(near)):
        close, count = seen(near[t], start, own, leaf, all_seen)
        for i in range(first[t], first[t + 1]):
            x, y, z = points[0, i], points[1, i], points[2, i]
            for j in range(close):
                dx, dy, dz = x - sx[j], y - sy[j], z - sz[j]
                height = dx * mx[j] + dy * my[j] + dz * mz[j]
                square = height * height
                back = abs(height) + depth[j]
                inverse[j] = dx * dx + dy * dy + dz * dz - square + back * back
                turn[j] = area[j] * back * height / math.sqrt(square + soft)
            for j in range(close, count):
                dx, dy, dz = x - sx[j], y - sy[j], z - sz[j]
                inverse[j] = dx * dx + dy * dy + dz * dz
                turn[j] = dx * mx[j] + dy * my[j] + dz * mz[j]
            for j in range(count):
                inverse[j] = ONE / math.sqrt(inverse[j])
            total = np.float32(0)
            for j in range(count):
                total += turn[j] * (inverse[j] * inverse[j] * inverse[j])
            out[i] = -total * FOUR_PI


@numba.njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _adjoint(
    own: Array,
    leaf: Array,
    start: Integers,
    near: Array,
    points: Array,
    normal: Array,
    depth: Array,
    soft: Any,
    out: Array,
) -> None:
    size = own.shape[1] + leaf.shape[1]
    all_seen, inverse, turn = np.empty((4, size), np.float32), np.empty(size, np.float32), np.empty(size, np.float32)
    sx, sy, sz, weight = all_seen[0], all_seen[1], all_seen[2], all_seen[3]
    for t in range(len(near)):
        count = seen(near[t], start, own, leaf, all_seen)[1]
        for i in range(start[t], start[t + 1]):
            x, y, z = points[0, i], points[1, i], points[2, i]
            nx, ny, nz, set_back = normal[0, i], normal[1, i], normal[2, i], depth[i]
            for j in range(count):
                dx, dy, dz = sx[j] - x, sy[j] - y, sz[j] - z
                height = dx * nx + dy * ny + dz * nz
                square = height * height
                back = abs(height) + set_back
                inverse[j] = dx * dx + dy * dy + dz * dz - square + back * back
                turn[j] = weight[j] * back * height / math.sqrt(square + soft)
            for j in range(count):
                inverse[j] = ONE / math.sqrt(inverse[j])
            total = np.float32(0)
            for j in range(count):
                total += turn[j] * (inverse[j] * inverse[j] * inverse[j])
            out[i] = -total * FOUR_PI
