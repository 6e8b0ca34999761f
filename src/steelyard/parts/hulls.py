"""Hulls of clusters: their vertices and faces one after the other, in room that is used again as clusters are joined.

A hull has no more vertices than the two it is joined from, so those of the clusters there are never outnumber those of
the first ones. When the end of twice that room is reached, what belongs to no cluster any more is squeezed out.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numba
import numpy as np

from steelyard.shape.hulls.borrowed import borrowed, integer

_MOST = 2**15  # vertices whose numbers fit in two bytes; of hulls with more no face is kept


class Hulls(NamedTuple):
    """Hulls of clusters.

    vertex          (P,) rows of the vertices of all clusters
    face            (6 P,) corners of the faces, counter-clockwise seen from outside, numbers among the cluster's
                    vertices, from 6 times the place of its first vertex on: 2 vertices - 4 faces, or fewer and -1
    offset, length  (N,) the first vertex of every cluster, how many it has
    mark, rows      (V,) the last time that each point was met; the vertices of two clusters
    state           (2,) how much of `vertex` is filled; the time
    """

    vertex: Any
    face: Any
    offset: Any
    length: Any
    mark: Any
    rows: Any
    state: Any


def hulls_of(start: Any, member: Any, nodes: int, points: int) -> Hulls:
    """Return room for `nodes` clusters, of which the vertices of the first len(start) - 1 are given, without faces."""
    first, filled = len(start) - 1, len(member)
    vertex, face = np.empty(2 * filled, np.int32), np.full(12 * filled, -1, np.int16)
    offset, length = np.zeros(nodes, np.int64), np.zeros(nodes, np.int64)
    vertex[:filled], offset[:first], length[:first] = member, start[:-1], np.diff(start)
    mark, rows = np.full(points, -1, np.int64), np.empty(points, np.int32)
    return Hulls(vertex, face, offset, length, mark, rows, np.array([filled, 0], np.int64))


@numba.njit(cache=True, nogil=True)
def both(hulls: Hulls, a: int, b: int) -> int:
    """Write the vertices of two clusters into `hulls.rows`, each once, those of `a` first; return how many."""
    vertex, offset, length = borrowed(hulls.vertex), borrowed(hulls.offset), borrowed(hulls.length)
    mark, rows, state = borrowed(hulls.mark), borrowed(hulls.rows), borrowed(hulls.state)
    state[1] += 1
    stamp, count = state[1], 0
    for node in (a, b):
        for k in range(offset[node], offset[node] + length[node]):
            v = vertex[k]
            if mark[v] != stamp:
                mark[v] = stamp
                rows[count] = v
                count += 1
    return count


@numba.njit(cache=True, nogil=True)
def keep(hulls: Hulls, c: int, gone: Any, point: Any, corner: Any, kept: int, solid: bool) -> None:
    """Keep the hull of cluster c: `kept` vertices, point[:, 2], and, where it is solid, its faces, corner[:, :3]."""
    vertex, face = borrowed(hulls.vertex), borrowed(hulls.face)
    offset, length, state = borrowed(hulls.offset), borrowed(hulls.length), borrowed(hulls.state)
    if state[0] + kept > len(vertex):
        _squeeze(vertex, face, offset, length, state, gone, c)
    offset[c], length[c] = state[0], kept
    state[0] += kept
    _write(vertex, face, offset[c], point, corner, kept, solid)


@numba.njit(cache=True, nogil=True)
def keep_in_place(hulls: Hulls, c: int, point: Any, corner: Any, kept: int, solid: bool) -> None:
    """Keep the hull of a cluster where its points were."""
    hulls.length[c] = kept
    _write(hulls.vertex, hulls.face, hulls.offset[c], point, corner, kept, solid)


@numba.njit(cache=True, nogil=True, forceinline=True)
def _write(vertex: Any, face: Any, at: int, point: Any, corner: Any, kept: int, solid: bool) -> None:
    for i in range(kept):
        vertex[at + i] = point[i, 2]
    faces = 2 * kept - 4 if solid and kept <= _MOST else 0
    for i in range(faces):
        for k in range(3):
            face[6 * at + 3 * i + k] = corner[i, k]
    for i in range(6 * at + 3 * faces, 6 * (at + kept)):
        face[i] = -1


@numba.njit(cache=True, nogil=True)
def _squeeze(vertex: Any, face: Any, offset: Any, length: Any, state: Any, gone: Any, nodes: int) -> None:
    """Move the hulls of the clusters that are left to the front; they lie in the order of their numbers."""
    filled = integer(0)
    for c in range(nodes):
        if not gone[c]:
            at = offset[c]
            if at > filled:
                for i in range(length[c]):
                    vertex[filled + i] = vertex[at + i]
                for i in range(6 * length[c]):
                    face[6 * filled + i] = face[6 * at + i]
                offset[c] = filled
            filled += length[c]
    state[0] = filled
