"""Ball pivoting: the triangles on which a ball can rest without holding a point, small balls first.

A triangle that a ball rests on is a face of the Delaunay tetrahedralisation, so instead of rolling the ball from edge
to edge every such face is tried at once: the result does not depend on where a ball starts.
Source: Bernardini, Mittleman, Rushmeier, Silva, Taubin 1999, "The ball-pivoting algorithm for surface reconstruction".
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numba
import numpy as np
from scipy.spatial import Delaunay, QhullError, cKDTree

from steelyard import check
from steelyard.check import Array, Integers, Mask
from steelyard.errors import BadValue
from steelyard.shape.tets import FACES
from steelyard.spatial import area_vectors, unit_vectors

_TOUCHES = 1e-6  # of the radius: the three corners themselves lie on the ball


def ball_pivoting(xyz: Array, normals: Array, radii: Sequence[float]) -> Integers:
    """Return triangles (F, 3) over points (N, 3) [m], turned to the side of the normals (N, 3).

    radii  of the balls [m], used in this order; later ones only fill what is open. No edge gets a third triangle.
    """
    xyz, normals = check.vectors("points", xyz), check.vectors("normals", normals)
    corners, centre, radius = _faces(xyz, normals)
    edges = _edges(corners)
    taken = np.zeros(len(corners), np.bool_)
    used, open_edges = np.zeros(edges.max(initial=-1) + 1, np.int64), np.zeros(len(xyz), np.int64)
    touched = np.zeros(len(xyz), np.bool_)
    for ball in radii:
        rests = _rests(xyz, corners, centre, radius, ball)
        order = np.flatnonzero(rests)[np.argsort(radius[rests], kind="stable")]
        _grow(order, corners, edges, taken, used, open_edges, touched)
    return np.asarray(corners[taken])


def _faces(xyz: Array, normals: Array) -> tuple[Integers, Array, Array]:
    """Return every Delaunay face (F, 3) turned to its normals' side, the centre of its circle and the radius."""
    try:
        tets = Delaunay(xyz).simplices.astype(np.int64)
    except QhullError:
        raise BadValue("a surface needs points that are not all in one plane; these are.") from None
    corners = np.unique(np.sort(tets[:, FACES].reshape(-1, 3), axis=1), axis=0)
    a, b, c = np.moveaxis(xyz[corners], 1, 0)
    across = np.cross(b - a, c - a)
    turned = (across * normals[corners].sum(1)).sum(1) < 0
    corners[turned] = corners[turned][:, [0, 2, 1]]
    b, c = b - a, c - a
    double = (across**2).sum(1)
    with np.errstate(divide="ignore", invalid="ignore"):
        way = ((b**2).sum(1)[:, None] * np.cross(c, across) + (c**2).sum(1)[:, None] * np.cross(across, b)) / (
            2 * double[:, None]
        )
    radius = np.linalg.norm(way, axis=1)
    good = np.isfinite(radius)
    return corners[good], (a + way)[good], radius[good]


def _rests(xyz: Array, corners: Integers, centre: Array, radius: Array, ball: float) -> Mask:
    """Return whether a ball of this radius rests on each face, on its front side, with no point inside."""
    rests = radius < ball
    front = unit_vectors(area_vectors(xyz[corners[rests]]))
    middle = centre[rests] + np.sqrt(ball**2 - radius[rests] ** 2)[:, None] * front
    rests[rests] = cKDTree(xyz).query(middle)[0] > (1 - _TOUCHES) * ball
    return rests


def _edges(triangles: Integers) -> Integers:
    """Return the number (F, 3) of each triangle's three edges, the same for both sides of an edge."""
    start, end = triangles, np.roll(triangles, -1, axis=1)
    size = int(triangles.max(initial=0)) + 1
    keys = np.minimum(start, end) * size + np.maximum(start, end)
    return np.unique(keys, return_inverse=True)[1].reshape(-1, 3)


@numba.njit(cache=True)
def _grow(
    order: Integers, corners: Integers, edges: Integers, taken: Any, used: Integers, open_edges: Integers, touched: Any
) -> None:
    """Take faces in this order, again and again until none fits; changes the last four arrays.

    A face fits if no edge of it has two faces yet and each corner is new or at the rim; the first ball may start
    anywhere, later ones only where a rim is.
    """
    first = not taken.any()
    grown = True
    while grown:
        grown = False
        for f in order:
            if taken[f]:
                continue
            fits, at_rim = True, first
            for j in range(3):
                v = corners[f, j]
                fits = fits and used[edges[f, j]] < 2 and (not touched[v] or open_edges[v] > 0)
                at_rim = at_rim or used[edges[f, j]] == 1
            if not (fits and at_rim):
                continue
            taken[f] = grown = True
            for j in range(3):
                e = edges[f, j]
                used[e] += 1
                change = 1 if used[e] == 1 else -1
                touched[corners[f, j]] = True
                open_edges[corners[f, j]] += change
                open_edges[corners[f, (j + 1) % 3]] += change
