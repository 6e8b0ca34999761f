"""Walls thinner than the spacing of their points: neighbourhoods that are two layers, and which points lie on which.

A plane through the neighbours of a point on such a wall is that of both its sheets, and their sides are then told
alike: a cup of thin metal is filled. But if the points have little noise, their neighbourhood is one curved sheet twice
over: a quadric and the same quadric displaced leave next to nothing of the heights, where one leaves half the wall.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numba
import numpy as np

from steelyard.check import Array, Integers, Mask
from steelyard.shape.points.plane_axis import least_axis
from steelyard.shape.points.spacing import evenly, voxel_side

_NEIGHBOURS = 20  # that show two layers
_ROUNDS = 6  # of telling the layers apart and fitting them
_TWO = 0.12  # of the squared heights that one quadric leaves, what two leave at most: chance leaves a fifth
_BLURRED = 0.2  # the same where noise blurs two layers: chance leaves less at four tenths of the points
_FLAT = 0.005  # of the reach of a neighbourhood: heights over one sheet that are no larger are none
_FEWEST = 0.2  # of a neighbourhood that lies on the smaller layer, at least
_LOOKED_AT = 300  # points looked at first
_SOME, _SOME_BLURRED = 0.2, 0.5  # share of them on two layers, clear or blurred, below which there are none
_MANY, _MOST = 0.25, 0.6  # of all points that lie on two layers, clear or blurred, at least
_SOME_ON_ONE, _ON_ONE = 0.07, 0.03  # the same of one thin wall of an object that is else thick: looked at first, of all
_ALIKE = 0.9  # cosine between planes along one wall
_MOSTLY = 0.5  # of the neighbours that are on the same wall: teeth and threads have fewer
_THIN = 0.4  # of the spacing: the planes of thicker walls are those of their sheets anyway
_PARALLEL = 0.7  # cosine between the planes of neighbours on one wall, at least
_TERMS = 7  # of two quadrics: six of the lower one, and how far the other lies over it


class Layers(NamedTuple):
    """Two layers of points that lie closer to each other than their points.

    two        (N,) which of the points have a neighbourhood of two layers
    same       (N, K) which of their nearest neighbours lie on their own layer
    plane      (N, 3) unit normals of that layer, of either sign
    thickness  median distance between the layers, in the units of the points
    part       whether they are walls of an object that is else thick: grooves between teeth may look like them
    """

    two: Mask
    same: Mask
    plane: Array
    thickness: float
    part: bool = False

    @classmethod
    def of(cls, xyz: Array, index: Integers, spacing: float = 0.0) -> Layers | None:
        """Return the layers of points (N, 3) with neighbours (N, K), nearest first; None where they have one.

        The stairs of voxels are no layers.

        spacing  of the points; where it is given, a thin wall of an else thick object counts, too
        """
        near = np.ascontiguousarray(index[:, :_NEIGHBOURS])
        some = evenly(len(xyz), _LOOKED_AT)
        if near.shape[1] < _NEIGHBOURS or voxel_side(xyz, near):
            return None
        first = _layers(xyz, near, some)[0]
        if _two(first, _SOME, _SOME_BLURRED) is None and (first < _TWO).mean() < _SOME_ON_ONE:
            return None
        left, same, plane, apart = _layers(xyz, near, np.arange(len(xyz)))
        two = _two(left, _MANY, _MOST)
        if two is not None:
            return cls(two, same, plane, float(np.median(apart[two])))
        two = _on_one_wall(left < _TWO, plane, near)
        thickness = float(np.median(apart[two])) if two.mean() > _ON_ONE else np.inf
        return cls(two, same, plane, thickness, True) if thickness < _THIN * spacing else None

    def volume(self, area: Array) -> float:
        """Return what lies between the layers, each point standing for `area` (N,) of their surface."""
        return float(area[self.two].sum()) * self.thickness / 2

    def told(self, plane: Array, link: Array, index: Integers) -> tuple[Array, Array]:
        """Return planes (N, 3) and links (N, K) to neighbours, those of walls by their layers.

        A neighbour on the other layer looks the other way: its link is that of one on the same sheet, turned.
        """
        own = np.where(self.two[:, None], self.plane, plane)
        turn = np.einsum("nd,nkd->nk", own, own[index])
        told = np.zeros_like(link)
        count = self.same.shape[1]
        told[:, :count] = np.where(self.same, 1.0, -1.0) * turn[:, :count] * (np.abs(turn[:, :count]) > _PARALLEL)
        return own, np.where(self.two[:, None], told, np.abs(link) * np.sign(turn))


def _two(left: Array, many: float, most: float) -> Mask | None:
    """Return which points lie on two layers, by what these leave (N,) of one sheet's heights; None where too few do.

    Noise blurs the layers of single points, not how many there are: so of walls that are nearly all of a cloud less is
    asked.
    """
    for share, limit in ((many, _TWO), (most, _BLURRED)):
        if (left < limit).mean() > share:
            return left < limit
    return None


def _on_one_wall(two: Mask, plane: Array, near: Integers) -> Mask:
    """Return which points of two layers (N,) lie on walls, of which all around is: not on a tooth or a thread.

    plane  (N, 3) of each point's layer; on a wall it goes on
    near   (N, K) neighbours
    """
    alike = two[near] & (np.abs(np.einsum("nd,nkd->nk", plane, plane[near])) > _ALIKE)
    wall = two & (alike.mean(1) > _MOSTLY)
    return np.asarray(two & (wall | (alike & wall[near]).any(1)))


@numba.njit(cache=True, nogil=True)
def _layers(xyz: Array, index: Integers, rows: Integers) -> tuple[Array, Mask, Array, Array]:
    """Return for points `rows` what two layers leave of what one leaves, neighbours on theirs, its normal, their gap.

    1 is left where there are no two: in a plane, and where nearly all lie on one of them.
    """
    count = index.shape[1]
    share, same = np.ones(len(rows)), np.zeros((len(rows), count), np.bool_)
    plane, apart = np.zeros((len(rows), 3)), np.zeros(len(rows))
    terms, height = np.empty((count + 1, _TERMS)), np.empty(count + 1)
    high, left, matrix = np.empty(count + 1, np.bool_), np.empty(count + 1), np.empty((_TERMS, _TERMS))
    found = np.empty(_TERMS)
    for r in range(len(rows)):
        frame = _local(xyz, index[rows[r]], rows[r], terms, height)
        one = _fitted(terms, height, 6, matrix, found, left)
        for k in range(count + 1):
            high[k] = left[k] > 0
        both = one
        for _ in range(_ROUNDS):
            for k in range(count + 1):
                terms[k, 6] = 1.0 if high[k] else 0.0
            both = _fitted(terms, height, _TERMS, matrix, found, left)
            for k in range(count + 1):
                over = left[k] + found[6] * terms[k, 6]
                high[k] = abs(over - found[6]) < abs(over)
        upper = 0
        for k in range(count + 1):
            upper += high[k]
        least = min(upper, count + 1 - upper)
        if one > _FLAT**2 * (count + 1) / (frame[0] ** 2).sum() and least > _FEWEST * (count + 1):
            share[r] = both / one
        _normal(frame, terms[0], found, plane[r])
        # Heights are along the normal of the neighbourhood, which is that of both layers.
        apart[r] = abs(found[6])
        for k in range(count):
            same[r, k] = high[k + 1] == high[0]
    return share, same, plane, apart


@numba.njit(cache=True, nogil=True)
def _local(xyz: Array, near: Integers, i: int, terms: Array, height: Array) -> Any:
    """Write heights (K + 1,) of a point and its neighbours over their plane, and terms of a quadric; return axes."""
    count = len(near) + 1
    mean, frame = np.zeros(3), np.empty((3, 3))
    for k in range(count):
        j = i if k == 0 else near[k - 1]
        for d in range(3):
            mean[d] += xyz[j, d] / count
    c = np.zeros(6)
    for k in range(count):
        j = i if k == 0 else near[k - 1]
        x, y, z = xyz[j, 0] - mean[0], xyz[j, 1] - mean[1], xyz[j, 2] - mean[2]
        c += np.array([x * x, x * y, x * z, y * y, y * z, z * z])
    scale = math.sqrt((c[0] + c[3] + c[5]) / count)
    nx, ny, nz = least_axis(c[0], c[1], c[2], c[3], c[4], c[5])
    # Any two axes across the normal will do: the first is across the coordinate axis that it leaves most.
    if abs(nx) <= abs(ny) and abs(nx) <= abs(nz):
        ux, uy, uz = 0.0, -nz, ny
    elif abs(ny) <= abs(nz):
        ux, uy, uz = nz, 0.0, -nx
    else:
        ux, uy, uz = -ny, nx, 0.0
    size = math.sqrt(ux * ux + uy * uy + uz * uz)
    ux, uy, uz = ux / size, uy / size, uz / size
    frame[0] = np.array([ux, uy, uz])
    frame[1] = np.array([ny * uz - nz * uy, nz * ux - nx * uz, nx * uy - ny * ux])
    frame[2] = np.array([nx, ny, nz])
    for k in range(count):
        j = i if k == 0 else near[k - 1]
        a, b, h = 0.0, 0.0, 0.0
        for d in range(3):
            away = xyz[j, d] - mean[d]
            a, b, h = a + away * frame[0, d], b + away * frame[1, d], h + away * frame[2, d]
        a, b = a / scale, b / scale
        height[k] = h
        terms[k, 0], terms[k, 1], terms[k, 2] = 1.0, a, b
        terms[k, 3], terms[k, 4], terms[k, 5] = a * a, a * b, b * b
    frame[0] /= scale
    frame[1] /= scale
    return frame


@numba.njit(cache=True, nogil=True)
def _fitted(terms: Array, height: Array, used: int, matrix: Array, found: Array, left: Array) -> float:
    """Fit heights by the first `used` terms; write coefficients and what is left, return its sum of squares."""
    for m in range(used):
        for n in range(m + 1):
            total = 1e-9 if m == n else 0.0
            for k in range(len(height)):
                total += terms[k, m] * terms[k, n]
            matrix[m, n] = total
        found[m] = 0.0
        for k in range(len(height)):
            found[m] += terms[k, m] * height[k]
    for m in range(used):  # Cholesky, then both substitutions
        for n in range(m + 1):
            total = matrix[m, n]
            for k in range(n):
                total -= matrix[m, k] * matrix[n, k]
            matrix[m, n] = math.sqrt(max(total, 1e-12)) if m == n else total / matrix[n, n]
        for k in range(m):
            found[m] -= matrix[m, k] * found[k]
        found[m] /= matrix[m, m]
    for m in range(used - 1, -1, -1):
        for k in range(m + 1, used):
            found[m] -= matrix[k, m] * found[k]
        found[m] /= matrix[m, m]
    squares = 0.0
    for k in range(len(height)):
        left[k] = height[k]
        for m in range(used):
            left[k] -= terms[k, m] * found[m]
        squares += left[k] * left[k]
    return squares


@numba.njit(cache=True, nogil=True)
def _normal(frame: Array, terms: Array, found: Array, out: Array) -> None:
    """Write the unit normal (3,) of a quadric at a point with such terms."""
    a, b = terms[1], terms[2]
    along = found[1] + 2 * found[3] * a + found[4] * b
    across = found[2] + found[4] * a + 2 * found[5] * b
    size = 0.0
    for d in range(3):
        out[d] = frame[2, d] - along * frame[0, d] - across * frame[1, d]
        size += out[d] * out[d]
    for d in range(3):
        out[d] /= math.sqrt(size)
