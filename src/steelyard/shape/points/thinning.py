"""Well-spread points: no two nearer than a radius, except on the two sides of a sheet."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np

from steelyard.check import Array, Integers

_ROUNDS = 12
_BESIDE = (0, -1, 1)  # the cubes about one, itself first
_LEAP = 2.0  # on a regular grid nothing goes at first, then half at once


def spread(xyz: Array, normal: Array, order: Integers, radius: float) -> Integers:
    """Return the numbers of the points that stay: taken in `order`, each at least `radius` from those before it.

    Points whose normals (N, 3) are more than a right angle apart do not hinder each other.
    """
    return np.asarray(_taken(xyz, normal, order, radius))


def cubes(xyz: Array, edge: float) -> Integers:
    """Return the cube (N, 3) that each point (N, 3) lies in, counted along the axes from the lowest on."""
    return np.asarray(np.floor((xyz - xyz.min(0)) / edge).astype(np.int64))


def spread_to(xyz: Array, normal: Array, order: Integers, count: int, least: float) -> tuple[Integers, float]:
    """Return about `count` well-spread points or fewer, and the distance they keep, at least `least` [m]."""
    kept, radius = spread(xyz, normal, order, least), least
    for _ in range(_ROUNDS):
        if len(kept) <= 1.04 * count:
            break
        # The points that a surface holds fall with the square of their distance, and those that go while few must
        # rise with it. Either falls short.
        gone = (len(xyz) - count) / max(len(xyz) - len(kept), 1)
        radius *= max(float(np.sqrt(max(len(kept) / count, min(gone, _LEAP)))), 1.01)
        kept = spread(xyz, normal, order, radius)
    return kept, radius


def in_cubes(xyz: Array, edge: float) -> Integers:
    """Return an order of points (N, 3) in which those of one cube follow one another, and cubes of one column.

    Passes over images read the same pixels for points that lie close: many images together are far larger than the
    processor's cache.
    """
    cell = cubes(xyz, edge)
    size = cell.max(0) + 1
    return np.argsort((cell[:, 0] * size[1] + cell[:, 1]) * size[2] + cell[:, 2], kind="stable")


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _taken(xyz: Any, normal: Any, order: Any, radius: float) -> Any:
    bits = 1
    while bits < 4 * len(xyz):
        bits *= 2
    head = np.full(bits, -1, np.int32)  # a cube's place is hashed: strangers in it are told apart by their distance
    follow = np.full(len(xyz), -1, np.int32)
    out = np.empty(len(xyz), np.int64)
    n = 0
    for i in order:
        # Most that do not stay are held off by one in their own cube or below or above it.
        x, y, z = xyz[i, 0] / radius, xyz[i, 1] / radius, xyz[i, 2] / radius
        a, b, c = int(np.floor(x)), int(np.floor(y)), int(np.floor(z))
        free = True
        for m in range(9):
            start = _column(a + _BESIDE[m // 3], b + _BESIDE[m % 3]) + c
            for up in _BESIDE:
                j = head[(start + up) & (bits - 1)] if free else -1
                while j >= 0:
                    gap, agree = 0.0, 0.0
                    for axis in range(3):
                        gap += (xyz[i, axis] - xyz[j, axis]) ** 2
                        agree += normal[i, axis] * normal[j, axis]
                    if gap < radius * radius and agree > 0:
                        free = False
                        break
                    j = follow[j]
            if not free:
                break
        if free:
            place = (_column(a, b) + c) & (bits - 1)
            follow[i] = head[place]
            head[place] = i
            out[n] = i
            n += 1
    return out[:n]


@numba.njit(cache=True, nogil=True, inline="always")
def _column(i: int, j: int) -> int:
    """Return where the places of a column of cubes begin: its cubes lie side by side in memory."""
    return int(i * 73856093 ^ j * 19349663)
