"""Surfaces made ready for drawing: the skin of each part, thinned, with normals that keep sharp edges sharp."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array, Integers
from steelyard.shape.points.thinning import cubes
from steelyard.shape.tets import FACES, TetMesh
from steelyard.spatial import area_vectors, summed, unit_vectors

CREASE = np.cos(np.deg2rad(42.0))  # faces that turn by more than this keep their edge
_ROUNDS = 3  # of evening
_FINE = 0.1  # of the size of a surface: where edges are longer on average, corners are its shape and not its noise
_IN, _OUT = 0.5, -0.53  # share of the way to the mean of the neighbours, and then away from it


def part_skins(solid: TetMesh, labels: Integers) -> list[tuple[int, Integers]]:
    """Return label and triangles (F, 3) of each part's boundary, towards the outside and towards other parts."""
    behind = solid.neighbours.ravel()
    own = np.repeat(labels, 4)
    other = np.where(behind < 0, -1, labels[behind])
    faces = solid.tets[:, FACES].reshape(-1, 3)
    return [(int(k), faces[(own == k) & (other != k)]) for k in np.unique(labels)]


def evened(vertices: Array, triangles: Integers) -> Array:
    """Return vertices (V, 3) without what triangles (F, 3) of a noisy surface stick out, for drawing only.

    Every vertex goes toward the mean of its neighbours and a little farther back, so that the whole hardly shrinks. It
    goes by a share of the length of its edges, and rounds corners by as much: vertices of long edges stay.
    Source: Taubin 1995, a signal processing approach to fair surface design.
    """
    ends = np.concatenate([triangles, np.roll(triangles, 1, axis=1)], axis=0).ravel()
    others = np.concatenate([np.roll(triangles, 1, axis=1), triangles], axis=0).ravel()
    count = np.bincount(ends, minlength=len(vertices))
    length = np.bincount(ends, np.linalg.norm(vertices[ends] - vertices[others], axis=1), len(vertices))
    fine = (count > 0) & (length <= _FINE * count * float(np.ptp(vertices, axis=0).max()))
    even = vertices.copy()
    for _ in range(_ROUNDS):
        for share in (_IN, _OUT):
            total = summed(ends, even[others], len(vertices))
            even[fine] += share * (total[fine] / count[fine, None] - even[fine])
    return even


def compact(vertices: Array, triangles: Integers) -> tuple[Array, Integers]:
    """Return the vertices (V, 3) that triangles (T, 3) use, and the triangles in numbers of these."""
    used, corners = np.unique(triangles, return_inverse=True)
    return vertices[used], corners.reshape(-1, 3)


def thinned(vertices: Array, triangles: Integers, most: int) -> tuple[Array, Integers]:
    """Return vertices (V, 3), triangles (T, 3) of at most `most`: vertices in one cell of a grid become their mean.

    The grid is as fine as it can be to a fifth; a surface that is small enough is returned as it is.
    """
    vertices, triangles = compact(vertices, triangles)
    area = np.linalg.norm(area_vectors(vertices[triangles]), axis=1).sum()
    # A sheet of cells has about two triangles per cell.
    cell = 0.5 * float(np.sqrt(2 * area / max(most, 1)))
    while len(triangles) > most and cell > 0:
        group = np.unique(cubes(vertices, cell), axis=0, return_inverse=True)[1].ravel()
        count = np.bincount(group)
        means = summed(group, vertices) / count[:, None]
        merged = group[triangles]
        whole = (merged != np.roll(merged, 1, axis=1)).all(1)
        first = np.unique(np.sort(merged[whole], axis=1), axis=0, return_index=True)[1]
        if len(first) <= most:
            return compact(means, merged[whole][np.sort(first)])
        cell *= 1.2
    return vertices, triangles


def corner_normals(vertices: Array, triangles: Integers) -> Array:
    """Return a unit normal (F, 3, 3) at every corner: the mean, by area, of the faces there that turn little."""
    areas = area_vectors(vertices[triangles])
    unit = unit_vectors(areas)
    corner = triangles.ravel()
    order = np.argsort(corner, kind="stable")
    count = np.bincount(corner, minlength=len(vertices))
    start = np.cumsum(count) - count
    # Every corner against every corner at the same vertex.
    many = count[corner]
    mine = np.repeat(np.arange(len(corner)), many)
    step = np.arange(len(mine)) - np.repeat(np.cumsum(many) - many, many)
    theirs = order[start[corner[mine]] + step]
    alike = (unit[mine // 3] * unit[theirs // 3]).sum(1) > CREASE
    total = summed(mine[alike], areas[theirs[alike] // 3], len(corner))
    length = np.linalg.norm(total, axis=1, keepdims=True)
    flat = np.repeat(unit, 3, axis=0)
    return np.asarray(np.where(length > 0, total / np.maximum(length, 1e-300), flat).reshape(-1, 3, 3))
