"""Winding numbers of clouds: sums over oriented elements, those far away taken leaf by leaf of a kd tree.

An element of area a and outward normal n turns the winding number of a point by its solid angle over 4 pi: 1 inside
the solid in all, 0 outside. Near elements are summed one by one; a leaf of the tree seen from
afar counts as one dipole at its centre. All sums are in single precision; lengths are in units of the
cloud's size.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np

from steelyard.shape.mesh import Integers

Array = Any  # single precision here, double at the border

_LEAF = 16  # most points of a leaf
_FAR = 2.5  # a leaf is far beyond this many of its radii: its points then err by about (1 / 2.5)^2 / 6 of a small sum
FOUR_PI = np.float32(1 / (4 * math.pi))
ONE, THREE = np.float32(1), np.float32(3)


@dataclass(frozen=True, eq=False)
class Tree:
    """Points in the order of the leaves of a kd tree.

    order   (N,) row of the given points that each ordered point is
    start   (L + 1,) first ordered point of each leaf
    points  (3, N) float32, ordered
    centre  (L, 3) and radius (L,) of the leaves
    """

    order: Integers
    start: Integers
    points: Array
    centre: Array
    radius: Array

    @classmethod
    def of(cls, xyz: Array) -> Tree:
        """Return the tree of points (N, 3)."""
        order, start = _ordered(np.ascontiguousarray(xyz), _LEAF)
        ordered = xyz[order]
        centre, radius = _leaves(ordered, start)
        return cls(order, start, _single(ordered.T), centre, radius)

    def back(self, values: Array) -> Array:
        """Return values (..., N) of the ordered points as those of the given ones."""
        out = np.empty_like(values)
        out[..., self.order] = values
        return out


@dataclass(frozen=True, eq=False)
class Sight:
    """How the leaves of a tree of targets see the leaves of a tree of sources: near (T, L) or far."""

    targets: Tree
    sources: Tree
    near: Array

    @classmethod
    def of(cls, targets: Tree, sources: Tree) -> Sight:
        """Return which leaves must be summed point by point."""
        return cls(targets, sources, _near(targets.centre, targets.radius, sources.centre, sources.radius))

    def winding(self, dipoles: Array, width: float, every: int = 1) -> Array:
        """Return the winding number (M,) at every `every`-th leaf of targets of ordered dipoles (3, N), softened."""
        leaves, start, points = self.chosen(every)
        out = np.empty(points.shape[1], np.float32)
        own, leaf = with_leaves(self.sources, dipoles)
        _winding(own, leaf, self.sources.start, self.near[leaves], points, start, np.float32(width**2), out)
        return out

    def winding_and_gradient(self, dipoles: Array, width: float) -> tuple[Array, Array]:
        """Return the winding number (M,) and its gradient (3, M) at the targets of ordered dipoles (3, N), softened."""
        points = self.targets.points
        out, gradient = np.empty(points.shape[1], np.float32), np.empty(points.shape, np.float32)
        own, leaf = with_leaves(self.sources, dipoles)
        _gradient(
            own, leaf, self.sources.start, self.near, points, self.targets.start, np.float32(width**2), out, gradient
        )
        return out, gradient

    def adjoint(self, weights: Array, width: float) -> Array:
        """Return the sum (3, M) over sources of weight times how a dipole at the target turns the source's number."""
        points = self.targets.points
        out = np.empty(points.shape, np.float32)
        own, leaf = with_leaves(self.sources, weights[None])
        _adjoint(own, leaf, self.sources.start, self.near, points, self.targets.start, np.float32(width**2), out)
        return out

    def chosen(self, every: int) -> tuple[Integers, Integers, Array]:
        """Return numbers, starts and points of every `every`-th leaf of targets."""
        tree = self.targets
        if every == 1:
            return np.arange(len(tree.centre)), tree.start, tree.points
        leaves = np.arange(0, len(tree.centre), every)
        sizes = np.diff(tree.start)[leaves]
        rows = np.concatenate([np.arange(tree.start[k], tree.start[k + 1]) for k in leaves.tolist()])
        return leaves, np.concatenate([[0], np.cumsum(sizes)]), np.ascontiguousarray(tree.points[:, rows])


def _single(values: Array) -> Array:
    return np.ascontiguousarray(values, np.float32)


def with_leaves(tree: Tree, values: Array) -> tuple[Array, Array]:
    """Return positions and values of the points (3 + K, N), and of the leaves, whose values are sums."""
    sums = np.add.reduceat(values, tree.start[:-1], axis=1, dtype=np.float32)
    return np.concatenate([tree.points, _single(values)]), np.concatenate([_single(tree.centre.T), sums])


@numba.njit(cache=True, nogil=True)
def _ordered(xyz: Array, most: int) -> tuple[Integers, Integers]:
    """Return points in leaf order and the first of each leaf: boxes halved by count across their longest side."""
    order = np.arange(len(xyz))
    levels = 0
    while len(xyz) > most << levels:
        levels += 1
    start = np.array([(len(xyz) * k) >> levels for k in range((1 << levels) + 1)])
    for level in range(levels):
        step = 1 << (levels - level)
        for first in range(0, 1 << levels, step):
            a, b = start[first], start[first + step]
            rows = order[a:b].copy()
            low, high = xyz[rows[0]].copy(), xyz[rows[0]].copy()
            for i in rows:
                for k in range(3):
                    low[k], high[k] = min(low[k], xyz[i, k]), max(high[k], xyz[i, k])
            order[a:b] = rows[np.argsort(xyz[rows, np.argmax(high - low)])]
    return order, start


@numba.njit(cache=True, nogil=True)
def _leaves(xyz: Array, start: Integers) -> tuple[Array, Array]:
    centre, radius = np.zeros((len(start) - 1, 3)), np.zeros(len(start) - 1)
    for k in range(len(radius)):
        for i in range(start[k], start[k + 1]):
            centre[k] += xyz[i] / (start[k + 1] - start[k])
        for i in range(start[k], start[k + 1]):
            radius[k] = max(radius[k], np.sqrt(((xyz[i] - centre[k]) ** 2).sum()))
    return centre, radius


@numba.njit(cache=True, nogil=True)
def _near(centre: Array, radius: Array, source: Array, size: Array) -> Array:
    out = np.empty((len(centre), len(source)), np.bool_)
    for t in range(len(centre)):
        for k in range(len(source)):
            away = (centre[t, 0] - source[k, 0]) ** 2 + (centre[t, 1] - source[k, 1]) ** 2
            away = math.sqrt(away + (centre[t, 2] - source[k, 2]) ** 2)
            out[t, k] = away - radius[t] < _FAR * size[k]
    return out


@numba.njit(cache=True, nogil=True)
def seen(near: Array, start: Integers, own: Array, leaf: Array, out: Array) -> tuple[int, int]:
    """Write what one leaf of targets sees into out, near points first; return their number and that of all."""
    count = 0
    for k in range(len(near)):
        if near[k]:
            for row in range(len(own)):
                for i in range(start[k], start[k + 1]):
                    out[row, count + i - start[k]] = own[row, i]
            count += start[k + 1] - start[k]
    close = count
    for k in range(len(near)):
        if not near[k]:
            for row in range(len(leaf)):
                out[row, count] = leaf[row, k]
            count += 1
    return close, count


@numba.njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _winding(
    own: Array, leaf: Array, start: Integers, near: Array, points: Array, first: Integers, soft: Any, out: Array
) -> None:
    all_seen, inverse = (
        np.empty((6, own.shape[1] + leaf.shape[1]), np.float32),
        np.empty(len(own.T) + len(leaf.T), np.float32),
    )
    for t in range(len(near)):
        count = seen(near[t], start, own, leaf, all_seen)[1]
        sx, sy, sz, mx, my, mz = all_seen[0], all_seen[1], all_seen[2], all_seen[3], all_seen[4], all_seen[5]
        for i in range(first[t], first[t + 1]):
            x, y, z = points[0, i], points[1, i], points[2, i]
            for j in range(count):
                dx, dy, dz = x - sx[j], y - sy[j], z - sz[j]
                inverse[j] = ONE / math.sqrt(dx * dx + dy * dy + dz * dz + soft)
            total = np.float32(0)
            for j in range(count):
                along = (x - sx[j]) * mx[j] + (y - sy[j]) * my[j] + (z - sz[j]) * mz[j]
                total += along * (inverse[j] * inverse[j] * inverse[j])
            out[i] = -total * FOUR_PI


@numba.njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _gradient(
    own: Array,
    leaf: Array,
    start: Integers,
    near: Array,
    points: Array,
    first: Integers,
    soft: Any,
    out: Array,
    gradient: Array,
) -> None:
    all_seen, inverse = (
        np.empty((6, own.shape[1] + leaf.shape[1]), np.float32),
        np.empty(len(own.T) + len(leaf.T), np.float32),
    )
    for t in range(len(near)):
        count = seen(near[t], start, own, leaf, all_seen)[1]
        sx, sy, sz, mx, my, mz = all_seen[0], all_seen[1], all_seen[2], all_seen[3], all_seen[4], all_seen[5]
        for i in range(first[t], first[t + 1]):
            x, y, z = points[0, i], points[1, i], points[2, i]
            for j in range(count):
                dx, dy, dz = x - sx[j], y - sy[j], z - sz[j]
                inverse[j] = ONE / math.sqrt(dx * dx + dy * dy + dz * dz + soft)
            total, gx, gy, gz = np.float32(0), np.float32(0), np.float32(0), np.float32(0)
            for j in range(count):
                dx, dy, dz = x - sx[j], y - sy[j], z - sz[j]
                square = inverse[j] * inverse[j]
                cube = square * inverse[j]
                along = (dx * mx[j] + dy * my[j] + dz * mz[j]) * cube
                total += along
                along *= THREE * square
                gx += mx[j] * cube - along * dx
                gy += my[j] * cube - along * dy
                gz += mz[j] * cube - along * dz
            out[i] = -total * FOUR_PI
            gradient[0, i], gradient[1, i], gradient[2, i] = -gx * FOUR_PI, -gy * FOUR_PI, -gz * FOUR_PI


@numba.njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _adjoint(
    own: Array, leaf: Array, start: Integers, near: Array, points: Array, first: Integers, soft: Any, out: Array
) -> None:
    all_seen, inverse = (
        np.empty((4, own.shape[1] + leaf.shape[1]), np.float32),
        np.empty(len(own.T) + len(leaf.T), np.float32),
    )
    for t in range(len(near)):
        count = seen(near[t], start, own, leaf, all_seen)[1]
        sx, sy, sz, weight = all_seen[0], all_seen[1], all_seen[2], all_seen[3]
        for i in range(first[t], first[t + 1]):
            x, y, z = points[0, i], points[1, i], points[2, i]
            for j in range(count):
                dx, dy, dz = x - sx[j], y - sy[j], z - sz[j]
                inverse[j] = ONE / math.sqrt(dx * dx + dy * dy + dz * dz + soft)
            gx, gy, gz = np.float32(0), np.float32(0), np.float32(0)
            for j in range(count):
                cube = inverse[j] * inverse[j] * inverse[j] * weight[j]
                gx += (x - sx[j]) * cube
                gy += (y - sy[j]) * cube
                gz += (z - sz[j]) * cube
            out[0, i], out[1, i], out[2, i] = gx * FOUR_PI, gy * FOUR_PI, gz * FOUR_PI
