"""Flat pieces of surface in a cloud: planes through points, and which neighbours lie on the same sheet."""

from __future__ import annotations

import math

import numba
import numpy as np

from steelyard.check import Array, Integers
from steelyard.shape.points.plane_axis import least_axis

_SLOPE = 0.12  # of the line between neighbours on one sheet against its planes, at which their link has fallen to 1/e
_PARALLEL = 0.7  # cosine between the planes of neighbours on one sheet, at least
_OPPOSITE = -0.5  # cosine between normals that face opposite ways
_STEEP = 0.25  # slope of the line to a neighbour on another sheet, at least
_ALIKE = 0.9  # cosine between normals that look the same way
_FLAT = 3.0  # links of a point on a flat piece
_FEW = 3
_FIRST = 18  # neighbours that give the first plane
_LEAST = 4.0  # links that a plane needs to be drawn anew


def sheet_planes(xyz: Array, index: Integers) -> tuple[Array, Array]:
    """Return planes (N, 3) through points (N, 3), of either sign, and how much each neighbour is on the same one.

    index  (N, K) neighbours, nearest first

    The second (N, K) is negative where a linked plane has the other sign. Where two sheets of a wall lie close, the
    first plane is that of both; then only neighbours on the point's own sheet shape it.
    """
    normal = _first_planes(xyz, index, min(_FIRST, index.shape[1]))
    for widened in (2.0, 1.4):
        normal = _own_planes(xyz, normal, index, _links(xyz, normal, index, widened * _SLOPE))
    return normal, np.asarray(_links(xyz, normal, index, _SLOPE))


def stacked(xyz: Array, normals: Array, index: Integers, link: Array) -> float:
    """Return the share of points (N, 3) beside another sheet that looks the same way, closer than their neighbours.

    Between two such sheets of a solid there must be one that looks the other way: one of the two is wrong. Only
    points on flat pieces count, and only with three such neighbours, as the steps of a body have a few.
    """
    linked = np.abs(link).sum(1)
    away = xyz[index] - xyz[:, None]
    steep = _STEEP * np.linalg.norm(away, axis=2)
    off = np.abs(np.einsum("nkd,nd->nk", away, normals)) > steep
    off &= np.abs(np.einsum("nkd,nkd->nk", away, normals[index])) > steep
    off &= np.einsum("nkd,nd->nk", normals[index], normals) > _ALIKE
    off &= (linked[:, None] > _FLAT) & (linked[index] > _FLAT)
    return float((off.sum(1) >= _FEW).mean())


def torn(xyz: Array, normals: Array, index: Integers, link: Array) -> float:
    """Return the share of links between neighbours on one sheet whose normals face opposite ways.

    index, link  (N, K) neighbours and links of `sheet_planes`; normals (N, 3) unit vectors

    It is next to nothing where normals are right. Through a wall thinner than the spacing links reach its other side:
    there each point lies behind the other's plane. On one sheet as many lie before it, so that what lies behind and is
    not matched by such is a wall.
    """
    link = np.abs(link)
    away = xyz[index] - xyz[:, None]
    opposite = link * (np.einsum("nkd,nd->nk", normals[index], normals) < _OPPOSITE)
    here, there = np.einsum("nkd,nd->nk", away, normals), -np.einsum("nkd,nkd->nk", away, normals[index])
    behind = float(opposite[(here < 0) & (there < 0)].sum())
    before = float(opposite[(here > 0) & (there > 0)].sum())
    walls = max(behind - before, 0.0)
    return (float(opposite.sum()) - walls) / max(float(link.sum()), 1e-300)


@numba.njit(cache=True, nogil=True)
def _plane(xyz: Array, i: int, neighbours: Integers, weight: Array, out: Array) -> None:
    """Write the plane through point i and weighted neighbours into out (3,)."""
    x, y, z = xyz[i]
    total, sx, sy, sz = 1.0, 0.0, 0.0, 0.0
    xx, xy, xz, yy, yz, zz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for a in range(len(neighbours)):
        j, w = neighbours[a], abs(weight[a])
        dx, dy, dz = xyz[j, 0] - x, xyz[j, 1] - y, xyz[j, 2] - z
        total += w
        sx, sy, sz = sx + w * dx, sy + w * dy, sz + w * dz
        xx, xy, xz = xx + w * dx * dx, xy + w * dx * dy, xz + w * dx * dz
        yy, yz, zz = yy + w * dy * dy, yz + w * dy * dz, zz + w * dz * dz
    out[0], out[1], out[2] = least_axis(
        xx - sx * sx / total,
        xy - sx * sy / total,
        xz - sx * sz / total,
        yy - sy * sy / total,
        yz - sy * sz / total,
        zz - sz * sz / total,
    )


@numba.njit(cache=True, nogil=True)
def _first_planes(xyz: Array, index: Integers, count: int) -> Array:
    out, even = np.empty((len(xyz), 3)), np.ones(count)
    for i in range(len(xyz)):
        _plane(xyz, i, index[i, :count], even, out[i])
    return out


@numba.njit(cache=True, nogil=True)
def _own_planes(xyz: Array, normal: Array, index: Integers, link: Array) -> Array:
    out = normal.copy()
    for i in range(len(xyz)):
        total = 1.0
        for a in range(index.shape[1]):
            total += abs(link[i, a])
        if total >= _LEAST:
            _plane(xyz, i, index[i], link[i], out[i])
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
