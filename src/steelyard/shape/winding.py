"""Winding numbers of clouds: sums over oriented elements, those far away taken node by node of a kd tree.

An element of area a and outward normal n turns the winding number of a point by its solid angle over 4 pi: 1 inside
the solid in all, 0 outside. Near elements are summed one by one; a node of the tree seen from
afar counts as one dipole at its centre. All sums are in single precision; lengths are in units of the
cloud's size.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numba
import numpy as np

from steelyard.shape.mesh import Integers

Array = Any  # single precision here, double at the border
Numbers = Any  # unsigned, or numba asks of each whether it counts from the end

_LEAF = 8  # most points of a leaf
_FAR = 3.5  # a node is far beyond this many of its radii: its points then err by about (1 / 2.5)^2 / 6 of a small sum
FOUR_PI = np.float32(1 / (4 * math.pi))
ONE, THREE = np.float32(1), np.float32(3)


@dataclass(frozen=True, eq=False)
class Tree:
    """Points in the order of the leaves of a kd tree; of 2 L nodes, 1 is the root, k has 2 k and 2 k + 1 under it.

    order   (N,) row of the given points that each ordered point is
    start   (L + 1,) first ordered point of each leaf; leaf i is node L + i
    points  (3, N) float32, ordered
    centre  (3, 2 L) float32 and radius (2 L,) of the nodes
    """

    order: Integers
    start: Integers
    points: Array
    centre: Array
    radius: Array

    @classmethod
    def of(cls, xyz: Array) -> Tree:
        """Return the tree of points (N, 3)."""
        xyz = np.ascontiguousarray(xyz, np.float64)
        order, start = _ordered(xyz, _LEAF)
        points = single(xyz[order].T)
        centre, radius = _nodes(points, start)
        return cls(order, start, points, centre, radius)

    def back(self, values: Array) -> Array:
        """Return values (..., N) of the ordered points as those of the given ones."""
        out = np.empty_like(values)
        out[..., self.order] = values
        return out

    @cached_property
    def blocks(self) -> Integers:
        """First ordered point (B + 1,) of each pair of leaves: points so near one another see alike."""
        return np.ascontiguousarray(self.start[::2]) if len(self.start) > 2 else self.start

    def of_blocks(self, every: int) -> Integers:
        """Return the numbers of the ordered points of every `every`-th block."""
        block = np.repeat(np.arange(len(self.blocks) - 1), np.diff(self.blocks))
        return np.flatnonzero(block % every == 0)


@dataclass(frozen=True, eq=False)
class Sight:
    """How blocks of the points of one tree see the nodes of another.

    targets, sources  the trees
    near  numbers of the points that block b sees one by one: near[1][near[0][b]:near[0][b + 1]]
    far   the same of the nodes that it sees as one
    """

    targets: Tree
    sources: Tree
    near: tuple[Integers, Numbers]
    far: tuple[Integers, Numbers]

    @classmethod
    def of(cls, targets: Tree, sources: Tree) -> Sight:
        """Return which leaves must be summed point by point."""
        blocks = len(targets.blocks) - 1
        seen_from = targets.centre, targets.radius, blocks, sources.centre, sources.radius, sources.start
        first, near, begin, far = _seen_by(*seen_from)
        return cls(targets, sources, (first, near), (begin, far))

    @cached_property
    def most(self) -> int:
        """The most points and nodes that any block sees."""
        return int((np.diff(self.near[0]) + np.diff(self.far[0])).max())

    def winding_and_gradient(self, dipoles: Array, width: float) -> tuple[Array, Array]:
        """Return the winding number (M,) and its gradient (3, M) at the targets of ordered dipoles (3, N), softened."""
        points = self.targets.points
        out, gradient = np.zeros(points.shape[1], np.float32), np.zeros(points.shape, np.float32)
        seen_here = *self.elements(dipoles), points, self.targets.blocks, np.float32(width**2), self.most
        _gradient(*seen_here, out, gradient)
        return out, gradient

    def winding(self, dipoles: Array, width: float, every: int = 1) -> Array:
        """Return the winding number (M,) alone; only every `every`-th block of targets is looked at, others have 0."""
        points = self.targets.points
        out = np.zeros(points.shape[1], np.float32)
        _winding(*self.elements(dipoles), points, self.targets.blocks, every, np.float32(width**2), self.most, out)
        return out

    def adjoint(self, weights: Array, width: float) -> Array:
        """Return the sum (3, M) over sources of weight times how a dipole at the target turns the source's number."""
        points = self.targets.points
        out = np.empty(points.shape, np.float32)
        seen_here = *self.elements(weights[None]), points, self.targets.blocks, np.float32(width**2), self.most
        _adjoint(*seen_here, out)
        return out

    def elements(self, values: Array, counted: Array | None = None) -> tuple[Any, Any, Any, Any, Any, Any]:
        """Return points with values (3 + K, N), nodes with theirs, and what each block sees.

        counted  what a node has the sums of, the values where it is None
        """
        tree = self.sources
        values = single(values)
        own = np.concatenate([tree.points, values])
        node = np.concatenate([tree.centre, sums(values if counted is None else single(counted), tree.start)])
        return own, node, *self.near, *self.far


def single(values: Any) -> Array:
    """Return contiguous values in single precision."""
    return np.ascontiguousarray(values, np.float32)


@numba.njit(cache=True, nogil=True)
def _ordered(xyz: Array, most: int) -> tuple[Integers, Integers]:
    """Return points in leaf order and the first of each leaf: boxes halved by count across their longest side."""
    order = np.arange(len(xyz))
    key = np.empty(len(xyz))
    levels = 0
    while len(xyz) > most << levels:
        levels += 1
    start = np.array([(len(xyz) * k) >> levels for k in range((1 << levels) + 1)])
    for level in range(levels):
        step = 1 << (levels - level)
        for first in range(0, 1 << levels, step):
            a, b, middle = start[first], start[first + step], start[first + step // 2]
            axis, longest = 0, -1.0
            for k in range(3):
                low = high = xyz[order[a], k]
                for i in range(a + 1, b):
                    low, high = min(low, xyz[order[i], k]), max(high, xyz[order[i], k])
                if high - low > longest:
                    axis, longest = k, high - low
            for i in range(a, b):
                key[i] = xyz[order[i], axis]
            _halved(key, order, a, b - 1, middle)
    return order, start


@numba.njit(cache=True, nogil=True)
def _halved(key: Array, order: Integers, a: int, b: int, middle: int) -> None:
    """Exchange the rows a..b until none before `middle` has a larger key than one from there on.

    Source: Hoare 1961, algorithm 65, FIND.
    """
    while a < b:
        pivot = key[(a + b) >> 1]
        i, j = a, b
        while i <= j:
            while key[i] < pivot:
                i += 1
            while pivot < key[j]:
                j -= 1
            if i <= j:
                key[i], key[j] = key[j], key[i]
                order[i], order[j] = order[j], order[i]
                i += 1
                j -= 1
        if middle <= j:
            b = j
        elif middle >= i:
            a = i
        else:
            return


@numba.njit(cache=True, nogil=True)
def _nodes(points: Array, start: Integers) -> tuple[Array, Array]:
    """Return centres (3, 2 L) and radii (2 L,) of nodes over ordered points (3, N); node 0 means nothing."""
    leaves = len(start) - 1
    centre, radius = np.zeros((3, 2 * leaves), np.float32), np.zeros(2 * leaves, np.float32)
    step, first = leaves, 1
    while step > 0:
        for k in range(first):
            a, b = start[k * step], start[(k + 1) * step]
            x, y, z = 0.0, 0.0, 0.0
            for i in range(a, b):
                x, y, z = x + points[0, i], y + points[1, i], z + points[2, i]
            x, y, z = x / (b - a), y / (b - a), z / (b - a)
            most = 0.0
            for i in range(a, b):
                most = max(most, (points[0, i] - x) ** 2 + (points[1, i] - y) ** 2 + (points[2, i] - z) ** 2)
            centre[0, first + k], centre[1, first + k], centre[2, first + k] = x, y, z
            radius[first + k] = math.sqrt(most)
        step //= 2
        first *= 2
    return centre, radius


@numba.njit(cache=True, nogil=True)
def sums(values: Array, start: Integers) -> Array:
    """Return the sums (K, 2 L) of values (K, N) of ordered points over the points of every node."""
    leaves = len(start) - 1
    out = np.zeros((len(values), 2 * leaves), np.float32)
    for row in range(len(values)):
        for k in range(leaves):
            total = np.float32(0)
            for i in range(start[k], start[k + 1]):
                total += values[row, i]
            out[row, leaves + k] = total
        for k in range(leaves - 1, 0, -1):
            out[row, k] = out[row, 2 * k] + out[row, 2 * k + 1]
    return out


@numba.njit(cache=True, nogil=True)
def _seen_by(
    centre: Array, radius: Array, blocks: int, source: Array, size: Array, start: Integers
) -> tuple[Integers, Numbers, Integers, Numbers]:
    """Return starts and numbers of the points that every block sees one by one, and of the nodes it sees as one."""
    leaves = len(size) // 2
    first, begin = np.zeros(blocks + 1, np.int64), np.zeros(blocks + 1, np.int64)
    near, far = np.empty(64 * _LEAF * blocks, np.uint32), np.empty(64 * blocks, np.uint32)
    stack = np.empty(128, np.int64)
    close, away = 0, 0
    for b in range(blocks):
        t = blocks + b
        if close + start[-1] > len(near):
            near = np.concatenate((near, np.empty(len(near) + start[-1], np.uint32)))
        if away + leaves > len(far):
            far = np.concatenate((far, np.empty(len(far) + leaves, np.uint32)))
        waiting = 1
        stack[0] = 1
        while waiting > 0:
            waiting -= 1
            k = stack[waiting]
            gap = (centre[0, t] - source[0, k]) ** 2 + (centre[1, t] - source[1, k]) ** 2
            gap = math.sqrt(gap + (centre[2, t] - source[2, k]) ** 2)
            if gap - radius[t] >= _FAR * size[k]:
                far[away] = k
                away += 1
            elif k >= leaves:
                for i in range(start[k - leaves], start[k - leaves + 1]):
                    near[close] = i
                    close += 1
            else:
                stack[waiting], stack[waiting + 1] = 2 * k + 1, 2 * k
                waiting += 2
        first[b + 1], begin[b + 1] = close, away
    return first, near[:close].copy(), begin, far[:away].copy()


@numba.njit(cache=True, nogil=True)
def seen(
    own: Array, node: Array, first: Integers, near: Numbers, begin: Integers, far: Numbers, b: int, out: Array
) -> tuple[int, int]:
    """Write what block b of targets sees into out, near points first; return their number and that of all."""
    points, nodes = near[first[b] : first[b + 1]], far[begin[b] : begin[b + 1]]
    close, beyond = len(points), len(nodes)
    for row in range(len(own)):
        given, kept = own[row], out[row]
        for m in range(close):
            kept[m] = given[points[m]]
    for row in range(len(node)):
        given, kept = node[row], out[row, close:]
        for m in range(beyond):
            kept[m] = given[nodes[m]]
    return close, close + beyond


@numba.njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _gradient(
    own: Array, node: Array, first: Integers, near: Numbers, begin: Integers, far: Numbers,
    points: Array, blocks: Integers, soft: Any, most: int, out: Array, gradient: Array,
) -> None:  # fmt: skip
    all_seen, inverse = np.empty((6, most), np.float32), np.empty(most, np.float32)
    sx, sy, sz, mx, my, mz = all_seen[0], all_seen[1], all_seen[2], all_seen[3], all_seen[4], all_seen[5]
    for b in range(len(blocks) - 1):
        count = seen(own, node, first, near, begin, far, b, all_seen)[1]
        for i in range(blocks[b], blocks[b + 1]):
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
def _winding(
    own: Array, node: Array, first: Integers, near: Numbers, begin: Integers, far: Numbers,
    points: Array, blocks: Integers, every: int, soft: Any, most: int, out: Array,
) -> None:  # fmt: skip
    all_seen = np.empty((6, most), np.float32)
    sx, sy, sz, mx, my, mz = all_seen[0], all_seen[1], all_seen[2], all_seen[3], all_seen[4], all_seen[5]
    for b in range(0, len(blocks) - 1, every):
        count = seen(own, node, first, near, begin, far, b, all_seen)[1]
        for i in range(blocks[b], blocks[b + 1]):
            x, y, z = points[0, i], points[1, i], points[2, i]
            total = np.float32(0)
            for j in range(count):
                dx, dy, dz = x - sx[j], y - sy[j], z - sz[j]
                inverse = ONE / math.sqrt(dx * dx + dy * dy + dz * dz + soft)
                total += (dx * mx[j] + dy * my[j] + dz * mz[j]) * inverse * inverse * inverse
            out[i] = -total * FOUR_PI


@numba.njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _adjoint(
    own: Array, node: Array, first: Integers, near: Numbers, begin: Integers, far: Numbers,
    points: Array, blocks: Integers, soft: Any, most: int, out: Array,
) -> None:  # fmt: skip
    all_seen, inverse = np.empty((4, most), np.float32), np.empty(most, np.float32)
    sx, sy, sz, weight = all_seen[0], all_seen[1], all_seen[2], all_seen[3]
    for b in range(len(blocks) - 1):
        count = seen(own, node, first, near, begin, far, b, all_seen)[1]
        for i in range(blocks[b], blocks[b + 1]):
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
