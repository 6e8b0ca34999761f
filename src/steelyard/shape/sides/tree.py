"""A kd tree of points in single precision: their order along its leaves, its nodes, and sums over them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numba
import numpy as np

from steelyard.check import Integers

Array = Any  # single precision here, double at the border

LEAF = 8  # most points of a leaf


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
        order, start = _ordered(xyz, LEAF)
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
