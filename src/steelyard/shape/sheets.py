"""Flat pieces of surface in a cloud: planes through points, and which neighbours lie on the same sheet."""

from __future__ import annotations

import math
from typing import Any

import numba
import numpy as np

from steelyard.check import Array
from steelyard.shape.mesh import Integers

_PARALLEL = 0.7  # cosine between the planes of neighbours on one sheet, at least


def sheet_planes(xyz: Array, index: Integers, slope: float) -> tuple[Array, Array]:
    """Return planes (N, 3) through points (N, 3), of either sign, and how much each neighbour is on the same one.

    index   (N, K) neighbours, nearest first
    slope   of the line to a neighbour against both planes, at which the link has fallen to 1/e

    The second (N, K) is negative where a linked plane has the other sign. Where two sheets of a wall lie close, the
    first plane is that of both; then only neighbours on the point's own sheet shape it.
    """
    normal = _first_planes(xyz, index, min(_FIRST, index.shape[1]))
    for widened in (2.0, 1.4):
        normal = _own_planes(xyz, normal, index, _links(xyz, normal, index, widened * slope))
    return normal, np.asarray(_links(xyz, normal, index, slope))


def spread(values: Array, index: Integers, link: Array, sweeps: int, kept: float) -> Array:
    """Return values (N,) pulled toward those of linked neighbours in `sweeps`; `kept` weighs a point's own."""
    return np.asarray(_spread(values, index, link, sweeps, kept))


_FIRST = 18  # neighbours that give the first plane
_LEAST = 4.0  # links that a plane needs to be drawn anew


@numba.njit(cache=True, nogil=True)
def _least_axis(m: Array) -> Array:
    """Return the unit axis (3,) of the least spread of a covariance (3, 3).

    Source: Smith 1961, eigenvalues of a symmetric 3 x 3 matrix.
    """
    q = (m[0, 0] + m[1, 1] + m[2, 2]) / 3
    p = (m[0, 0] - q) ** 2 + (m[1, 1] - q) ** 2 + (m[2, 2] - q) ** 2
    p = math.sqrt((p + 2 * (m[0, 1] ** 2 + m[0, 2] ** 2 + m[1, 2] ** 2)) / 6)
    if p == 0:
        return np.array([0.0, 0.0, 1.0])
    b = (m - q * np.eye(3)) / p
    half = b[0, 0] * (b[1, 1] * b[2, 2] - b[1, 2] ** 2) - b[0, 1] * (b[0, 1] * b[2, 2] - b[1, 2] * b[0, 2])
    half = (half + b[0, 2] * (b[0, 1] * b[1, 2] - b[1, 1] * b[0, 2])) / 2
    least = 2 * math.cos(math.acos(min(1.0, max(-1.0, half))) / 3 + 2 * math.pi / 3)
    rows = b - least * np.eye(3)
    best, size = np.array([0.0, 0.0, 1.0]), 1e-24
    for i in range(3):
        u, v = rows[i], rows[(i + 1) % 3]
        across = np.array([u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]])
        found = (across**2).sum()
        if found > size:
            best, size = across / math.sqrt(found), found
    return best


@numba.njit(cache=True, nogil=True)
def _plane(xyz: Array, i: int, neighbours: Integers, weight: Array) -> Array:
    """Return the plane through point i and weighted neighbours."""
    middle, total = xyz[i].copy(), 1.0
    for a in range(len(neighbours)):
        middle += weight[a] * xyz[neighbours[a]]
        total += weight[a]
    middle /= total
    spread_out = np.zeros((3, 3))
    for a in range(-1, len(neighbours)):
        away = (xyz[i] if a < 0 else xyz[neighbours[a]]) - middle
        share = 1.0 if a < 0 else weight[a]
        for u in range(3):
            for v in range(3):
                spread_out[u, v] += share * away[u] * away[v]
    return _least_axis(spread_out)


@numba.njit(cache=True, nogil=True)
def _first_planes(xyz: Array, index: Integers, count: int) -> Array:
    out, even = np.empty((len(xyz), 3)), np.ones(count)
    for i in range(len(xyz)):
        out[i] = _plane(xyz, i, index[i, :count], even)
    return out


@numba.njit(cache=True, nogil=True)
def _own_planes(xyz: Array, normal: Array, index: Integers, link: Array) -> Array:
    out = normal.copy()
    for i in range(len(xyz)):
        weight = np.abs(link[i])
        if weight.sum() + 1 >= _LEAST:
            out[i] = _plane(xyz, i, index[i], weight)
    return out


@numba.njit(cache=True, nogil=True)
def _links(xyz: Array, normal: Array, index: Integers, slope: float) -> Array:
    out = np.zeros(index.shape)
    for i in range(len(xyz)):
        for a in range(index.shape[1]):
            j = index[i, a]
            turn = 0.0
            square, rise, other = 0.0, 0.0, 0.0
            for k in range(3):
                away = xyz[j, k] - xyz[i, k]
                turn += normal[i, k] * normal[j, k]
                square += away * away
                rise += away * normal[i, k]
                other += away * normal[j, k]
            if abs(turn) > _PARALLEL and square > 0:
                out[i, a] = turn * math.exp(-(rise * rise + other * other) / (square * slope * slope))
    return out


@numba.njit(cache=True, nogil=True)
def _spread(values: Array, index: Integers, link: Array, sweeps: int, kept: float) -> Any:
    old, new = values.astype(np.float64), np.empty(len(values))
    for _ in range(sweeps):
        for i in range(len(values)):
            total, weight = kept * values[i], kept
            for a in range(index.shape[1]):
                total += link[i, a] * old[index[i, a]]
                weight += abs(link[i, a])
            new[i] = total / weight
        old, new = new, old
    return old
