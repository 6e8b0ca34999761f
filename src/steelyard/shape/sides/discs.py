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

from steelyard.check import Integers
from steelyard.shape.sides.tree import Tree, single, sums
from steelyard.shape.sides.winding import FOUR_PI, ONE, Sight, View, gathered, seen_of

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
        return cls(tree, single(np.asarray(normals)[tree.order].T), single(chosen), single(depth * chosen**0.5), soft)

    def winding(self, sight: Sight) -> Array:
        """Return the winding number (M,) at the targets, which see the tree of the discs."""
        out = np.zeros(sight.targets.points.shape[1], np.float32)
        nothing = np.empty(0, np.float32)
        self._turns(sight, nothing, nothing, np.zeros((1, 2), np.int64), out)
        return out

    def response(self, sight: Sight) -> Response:
        """Return how the winding number at the targets depends on what each disc counts."""
        size = np.diff(sight.targets.blocks)
        close, beyond = np.diff(sight.view.first), np.diff(sight.view.begin)
        at = np.concatenate([np.zeros((1, 2), np.int64), np.cumsum(np.stack([size * close, 3 * size * beyond], 1), 0)])
        near, far = (np.empty(room, np.float32) for room in at[-1].tolist())
        self._turns(sight, near, far, at, np.empty(sight.targets.points.shape[1], np.float32))
        return Response(self, sight, near, far, at)

    def _turns(self, sight: Sight, near: Array, far: Array, at: Integers, out: Array) -> None:
        own = np.concatenate([self.normal, self.area[None], self.depth[None]])
        elements = sight.elements(own, self.normal * self.area)
        _turns(*elements, sight.targets.points, np.float32(self.soft**2), near, far, at, out)


@dataclass(frozen=True, eq=False)
class Response:
    """The winding number at targets as a linear function of what each disc counts.

    near  by how much each disc that a target sees by itself turns its number, target by target
    far   the field (3,) there of a unit dipole at each node that it sees as one
    at    (B + 1, 2) where the values of each block begin in `near` and in `far`
    """

    discs: Discs
    sight: Sight
    near: Array
    far: Array
    at: Integers

    def winding(self, share: Array, every: int = 1) -> Array:
        """Return the winding number (M,) where the discs count by `share` (N,), ordered as the tree is.

        Only every `every`-th block of targets is looked at, the others have 0.
        """
        discs, sight = self.discs, self.sight
        share = single(share)
        dipole = sums(discs.normal * (discs.area * share), discs.tree.start)
        out = np.zeros(sight.targets.points.shape[1], np.float32)
        _apply(self.near, self.far, sight.view, self.at, every, share, dipole, out)
        return out

    def adjoint(self, weights: Array) -> Array:
        """Return the sum (N,) over targets of weight times what each disc adds to the target's winding number."""
        discs, sight = self.discs, self.sight
        out, field = np.zeros(len(discs.area), np.float32), np.zeros((3, 2 * len(discs.tree.start) - 2), np.float32)
        turned = single(weights), discs.normal, discs.area
        _transposed(self.near, self.far, sight.view, self.at, discs.tree.start, *turned, field, out)
        return out


@numba.njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _turns(
    own: Array, node: Array, view: View, points: Array, soft: Any, close_out: Array, far_out: Array, at: Integers,
    out: Array,
) -> None:  # fmt: skip
    """Write the winding number (M,), and, where there is room, by how much each disc and node turns it."""
    most, blocks = view.most, view.blocks
    all_seen, inverse, turn = np.empty((8, most), np.float32), np.empty(most, np.float32), np.empty(most, np.float32)
    sx, sy, sz, mx, my, mz = all_seen[0], all_seen[1], all_seen[2], all_seen[3], all_seen[4], all_seen[5]
    area, depth = all_seen[6], all_seen[7]
    kept, filled = len(at) > 1, 0
    for b in range(len(blocks) - 1):
        close, count = gathered(own, node, view, b, all_seen)
        for i in range(blocks[b], blocks[b + 1]):
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
            total = np.float32(0)
            for j in range(count):
                inverse[j] = ONE / math.sqrt(inverse[j])
            for j in range(count):
                inverse[j] = -FOUR_PI * inverse[j] * inverse[j] * inverse[j]
                total += turn[j] * inverse[j]
            out[i] = total
            if kept:
                turned = close_out[at[b, 0] + (i - blocks[b]) * close :]
                for j in range(close):
                    turned[j] = turn[j] * inverse[j]
                beyond = count - close
                for j in range(beyond):
                    far_out[filled + j] = (x - sx[close + j]) * inverse[close + j]
                    far_out[filled + beyond + j] = (y - sy[close + j]) * inverse[close + j]
                    far_out[filled + 2 * beyond + j] = (z - sz[close + j]) * inverse[close + j]
                filled += 3 * beyond


@numba.njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _apply(
    near_turn: Array, far_field: Array, view: View, at: Integers, every: int, share: Array, dipole: Array, out: Array
) -> None:
    blocks, ours, theirs = view.blocks, np.empty(view.most, np.float32), np.empty(3 * view.most, np.float32)
    for b in range(0, len(blocks) - 1, every):
        points, nodes = seen_of(view, b)
        close, beyond, filled = len(points), len(nodes), at[b, 1]
        for m in range(close):
            ours[m] = share[points[m]]
        for row in range(3):
            for m in range(beyond):
                theirs[row * beyond + m] = dipole[row, nodes[m]]
        for i in range(blocks[b], blocks[b + 1]):
            turned, field = near_turn[at[b, 0] + (i - blocks[b]) * close :], far_field[filled:]
            total = np.float32(0)
            for j in range(close):
                total += turned[j] * ours[j]
            for j in range(3 * beyond):
                total += field[j] * theirs[j]
            filled += 3 * beyond
            out[i] = total


@numba.njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _transposed(
    near_turn: Array, far_field: Array, view: View, at: Integers, start: Integers, weights: Array, normal: Array,
    area: Array, field: Array, out: Array,
) -> None:  # fmt: skip
    blocks, ours, theirs = view.blocks, np.empty(view.most, np.float32), np.empty(3 * view.most, np.float32)
    filled = 0
    for b in range(len(blocks) - 1):
        points, nodes = seen_of(view, b)
        close, beyond = len(points), len(nodes)
        ours[:close] = 0
        theirs[: 3 * beyond] = 0
        for i in range(blocks[b], blocks[b + 1]):
            turned, beyond_field = near_turn[at[b, 0] + (i - blocks[b]) * close :], far_field[filled:]
            weight = weights[i]
            for j in range(close):
                ours[j] += weight * turned[j]
            for j in range(3 * beyond):
                theirs[j] += weight * beyond_field[j]
            filled += 3 * beyond
        for m in range(close):
            out[points[m]] += ours[m]
        for row in range(3):
            for m in range(beyond):
                field[row, nodes[m]] += theirs[row * beyond + m]
    leaves = len(start) - 1
    for k in range(2, 2 * leaves):
        for row in range(3):
            field[row, k] += field[row, k >> 1]
    for k in range(leaves):
        for i in range(start[k], start[k + 1]):
            along = np.float32(0)
            for row in range(3):
                along += field[row, leaves + k] * normal[row, i]
            out[i] += along * area[i]
