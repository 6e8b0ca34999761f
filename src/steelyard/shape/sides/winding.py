"""Winding numbers of clouds: sums over oriented elements, those far away taken node by node of a kd tree.

An element of area a and outward normal n turns the winding number of a point by its solid angle over 4 pi: 1 inside
the solid in all, 0 outside. Near elements are summed one by one; a node of the tree seen from
afar counts as one dipole at its centre. All sums are in single precision; lengths are in units of the
cloud's size.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numba
import numpy as np

from steelyard.check import Integers
from steelyard.shape.sides.tree import LEAF, Tree, single, sums

Array = Any  # single precision here, double at the border
Numbers = Any  # unsigned, or numba asks of each whether it counts from the end

_FAR = 3.5  # a node is far beyond this many of its radii: its points then err by about (1 / 2.5)^2 / 6 of a small sum
FOUR_PI = np.float32(1 / (4 * math.pi))
ONE, THREE = np.float32(1), np.float32(3)


class View(NamedTuple):
    """What blocks of targets see of the points and nodes of another tree.

    first, near  numbers of the points that block b sees one by one: near[first[b]:first[b + 1]]
    begin, far   the same of the nodes that it sees as one
    blocks       (B + 1,) first target of each block
    most         points and nodes that any block sees, at most
    """

    first: Integers
    near: Numbers
    begin: Integers
    far: Numbers
    blocks: Integers
    most: int


@dataclass(frozen=True, eq=False)
class Sight:
    """How the points of one tree see those of another, and its nodes."""

    targets: Tree
    sources: Tree
    view: View

    @classmethod
    def of(cls, targets: Tree, sources: Tree) -> Sight:
        """Return which leaves must be summed point by point."""
        count = len(targets.blocks) - 1
        first, near, begin, far = _seen_by(
            targets.centre, targets.radius, count, sources.centre, sources.radius, sources.start
        )
        most = int((np.diff(first) + np.diff(begin)).max())
        return cls(targets, sources, View(first, near, begin, far, targets.blocks, most))

    def winding_and_gradient(self, dipoles: Array, width: float) -> tuple[Array, Array]:
        """Return the winding number (M,) and its gradient (3, M) at the targets of ordered dipoles (3, N), softened."""
        points = self.targets.points
        out, gradient = np.zeros(points.shape[1], np.float32), np.zeros(points.shape, np.float32)
        _gradient(*self.elements(dipoles), points, np.float32(width**2), out, gradient)
        return out, gradient

    def winding(self, dipoles: Array, width: float, every: int = 1) -> Array:
        """Return the winding number (M,) alone; only every `every`-th block of targets is looked at, others have 0."""
        points = self.targets.points
        out = np.zeros(points.shape[1], np.float32)
        _winding(*self.elements(dipoles), points, every, np.float32(width**2), out)
        return out

    def adjoint(self, weights: Array, width: float) -> Array:
        """Return the sum (3, M) over sources of weight times how a dipole at the target turns the source's number."""
        points = self.targets.points
        out = np.empty(points.shape, np.float32)
        _adjoint(*self.elements(weights[None]), points, np.float32(width**2), out)
        return out

    def elements(self, values: Array, counted: Array | None = None) -> tuple[Array, Array, View]:
        """Return points with values (3 + K, N), nodes with theirs, and what each block sees of both.

        counted  what a node has the sums of, the values where it is None
        """
        tree = self.sources
        values = single(values)
        own = np.concatenate([tree.points, values])
        node = np.concatenate([tree.centre, sums(values if counted is None else single(counted), tree.start)])
        return own, node, self.view


@numba.njit(cache=True, nogil=True)
def _seen_by(
    centre: Array, radius: Array, blocks: int, source: Array, size: Array, start: Integers
) -> tuple[Integers, Numbers, Integers, Numbers]:
    """Return starts and numbers of the points that every block sees one by one, and of the nodes it sees as one."""
    leaves = len(size) // 2
    first, begin = np.zeros(blocks + 1, np.int64), np.zeros(blocks + 1, np.int64)
    near, far = np.empty(64 * LEAF * blocks, np.uint32), np.empty(64 * blocks, np.uint32)
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
def seen_of(view: View, b: int) -> tuple[Numbers, Numbers]:
    """Return the numbers of the points and of the nodes that block b of targets sees."""
    first, begin = view.first, view.begin
    return view.near[first[b] : first[b + 1]], view.far[begin[b] : begin[b + 1]]


@numba.njit(cache=True, nogil=True)
def gathered(own: Array, node: Array, view: View, b: int, out: Array) -> tuple[int, int]:
    """Write what block b of targets sees into out, near points first; return their number and that of all."""
    points, nodes = seen_of(view, b)
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
def _gradient(own: Array, node: Array, view: View, points: Array, soft: Any, out: Array, gradient: Array) -> None:
    all_seen, inverse, blocks = np.empty((6, view.most), np.float32), np.empty(view.most, np.float32), view.blocks
    sx, sy, sz, mx, my, mz = all_seen[0], all_seen[1], all_seen[2], all_seen[3], all_seen[4], all_seen[5]
    for b in range(len(blocks) - 1):
        count = gathered(own, node, view, b, all_seen)[1]
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
def _winding(own: Array, node: Array, view: View, points: Array, every: int, soft: Any, out: Array) -> None:
    all_seen, blocks = np.empty((6, view.most), np.float32), view.blocks
    sx, sy, sz, mx, my, mz = all_seen[0], all_seen[1], all_seen[2], all_seen[3], all_seen[4], all_seen[5]
    for b in range(0, len(blocks) - 1, every):
        count = gathered(own, node, view, b, all_seen)[1]
        for i in range(blocks[b], blocks[b + 1]):
            x, y, z = points[0, i], points[1, i], points[2, i]
            total = np.float32(0)
            for j in range(count):
                dx, dy, dz = x - sx[j], y - sy[j], z - sz[j]
                inverse = ONE / math.sqrt(dx * dx + dy * dy + dz * dz + soft)
                total += (dx * mx[j] + dy * my[j] + dz * mz[j]) * inverse * inverse * inverse
            out[i] = -total * FOUR_PI


@numba.njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _adjoint(own: Array, node: Array, view: View, points: Array, soft: Any, out: Array) -> None:
    all_seen, inverse, blocks = np.empty((4, view.most), np.float32), np.empty(view.most, np.float32), view.blocks
    sx, sy, sz, weight = all_seen[0], all_seen[1], all_seen[2], all_seen[3]
    for b in range(len(blocks) - 1):
        count = gathered(own, node, view, b, all_seen)[1]
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
