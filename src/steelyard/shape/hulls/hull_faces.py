"""The faces of a growing convex hull, in tables: which points lie above which, what a point sees, its cone."""

from __future__ import annotations

from typing import Any, NamedTuple

import numba
import numpy as np

from steelyard.check import Array
from steelyard.shape.hulls.borrowed import integer
from steelyard.shape.hulls.exact_sign import determinant

# Columns of the tables below.
_LINK, _FAN, KEPT = 0, 1, 2
_BESIDE, FIRST, FAR, _STATE, QUEUED = 3, 6, 7, 8, 9  # after three corners
_OFFSET, _ABOVE, _MOST = 3, 4, 5
QUEUE, _FREE, _SEEN, _FRESH = 0, 1, 2, 3
_GONE, _HULL, _VISIBLE, _BEHIND = 0, 1, 2, 3  # states of a face


class HullWork(NamedTuple):
    """Room for one hull of up to n points, and m = 2 n + 8 faces; few tables, since every one costs time to pass on.

    xyz    (n, 3) the points, from the lower corner of their box
    point  (n, 3) of each point: the next one in the list of points above a face; the new face that starts at it on the
           horizon; and, apart from the point, the answer: rows of the vertices
    plane  (m, 6) of each face: its normal, twice the area long; the product of that with a corner; the least height,
           times the normal's length, of a point above the face, and the greatest that was met
    face   (m, 10) its corners; the faces across the edge from each corner to the next; the first point above it, the
           farthest one; its state; whether it is queued
    stack  (m, 4) lists of faces: queued with points above them; slots without a face; seen from the point being added;
           made by it; and, in the end, the corners of each face of the hull, numbers among the vertices
    rim    (3 m, 3) edges of its horizon: from, to, the face behind
    """

    xyz: Any
    point: Any
    plane: Any
    face: Any
    stack: Any
    rim: Any

    @property
    def kept(self) -> Any:
        """Rows of the vertices of the hull that was made last."""
        return self.point[:, KEPT]


@numba.njit(cache=True, nogil=True)
def hull_work(points: int) -> HullWork:
    """Return room for hulls of up to `points` points."""
    n, m = points, 2 * points + 8
    return HullWork(
        np.empty((n, 3)),
        np.empty((n, 3), np.int32),
        np.empty((m, 6)),
        np.zeros((m, 10), np.int32),
        np.empty((m, 4), np.int32),
        np.empty((3 * m, 3), np.int32),
    )


@numba.njit(cache=True, nogil=True, forceinline=True)
def _place(xyz: Array, plane: Array, face: Any, f: int, a: int, b: int, c: int, tolerance: float) -> None:
    """Make face f of three points, and its plane; no point lies above it yet."""
    face[f, 0], face[f, 1], face[f, 2] = a, b, c
    ax, ay, az = xyz[a, 0], xyz[a, 1], xyz[a, 2]
    ux, uy, uz = xyz[b, 0] - ax, xyz[b, 1] - ay, xyz[b, 2] - az
    vx, vy, vz = xyz[c, 0] - ax, xyz[c, 1] - ay, xyz[c, 2] - az
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    plane[f, 0], plane[f, 1], plane[f, 2] = nx, ny, nz
    plane[f, _OFFSET] = nx * ax + ny * ay + nz * az
    plane[f, _ABOVE] = tolerance * np.sqrt(nx * nx + ny * ny + nz * nz)
    plane[f, _MOST] = 0.0
    face[f, FIRST] = -1
    face[f, _STATE] = _HULL


@numba.njit(cache=True, nogil=True, forceinline=True)
def _sees(xyz: Array, plane: Array, face: Any, f: int, p: int, noise: float) -> bool:
    """Return whether point p lies strictly above face f."""
    height = plane[f, 0] * xyz[p, 0] + plane[f, 1] * xyz[p, 1] + plane[f, 2] * xyz[p, 2] - plane[f, _OFFSET]
    if abs(height) > noise:
        return bool(height > 0)
    return bool(determinant(xyz, face[f, 0], face[f, 1], face[f, 2], p) > 0)


@numba.njit(cache=True, nogil=True, forceinline=True)
def _simplex(xyz: Array, count: int, axis: int, tolerance: float, noise: float) -> tuple[int, int, int, int]:
    """Return four points far apart, the first three counter-clockwise seen from outside; -1 last where all are flat."""
    a = b = 0
    for p in range(count):
        if xyz[p, axis] < xyz[a, axis]:
            a = p
        if xyz[p, axis] > xyz[b, axis]:
            b = p
    ax, ay, az = xyz[a, 0], xyz[a, 1], xyz[a, 2]
    ux, uy, uz = xyz[b, 0] - ax, xyz[b, 1] - ay, xyz[b, 2] - az
    c, most = 0, -1.0
    nx = ny = nz = 0.0
    for p in range(count):
        vx, vy, vz = xyz[p, 0] - ax, xyz[p, 1] - ay, xyz[p, 2] - az
        x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        square = x * x + y * y + z * z
        if square > most:
            c, most, nx, ny, nz = p, square, x, y, z
    d, height = 0, 0.0
    for p in range(count):
        h = nx * (xyz[p, 0] - ax) + ny * (xyz[p, 1] - ay) + nz * (xyz[p, 2] - az)
        if abs(h) > abs(height):
            d, height = p, h
    if not abs(height) > max(noise, tolerance * np.sqrt(most)):
        return a, b, c, -1
    return (a, c, b, d) if height > 0 else (a, b, c, d)


@numba.njit(cache=True, nogil=True, forceinline=True)
def start(
    xyz: Array, point: Any, plane: Array, face: Any, stack: Any, count: int, axis: int, tolerance: float, noise: float
) -> int:
    """Make the first four faces; return the head of the list of other points, -2 where all points are flat."""
    a, b, c, d = _simplex(xyz, count, axis, tolerance, noise)
    if d < 0:
        return -2
    for f, u, v, w in ((0, a, b, c), (1, a, d, b), (2, b, d, c), (3, c, d, a)):
        _place(xyz, plane, face, f, u, v, w, tolerance)
    face[0, 3], face[0, 4], face[0, 5] = 1, 2, 3
    face[1, 3], face[1, 4], face[1, 5] = 3, 2, 0
    face[2, 3], face[2, 4], face[2, 5] = 1, 3, 0
    face[3, 3], face[3, 4], face[3, 5] = 2, 1, 0
    for k in range(4):
        stack[k, _FRESH] = k
    loose = -1
    for p in range(count):
        point[p, _FAN] = -1
        if p != a and p != b and p != c and p != d:
            point[p, _LINK] = loose
            loose = p
    return loose


@numba.njit(cache=True, nogil=True)
def _face_below(xyz: Array, plane: Array, face: Any, used: int, p: int, noise: float) -> tuple[int, float]:
    """Return a face that point p lies more than the tolerance above, and its height; -1 where there is none."""
    for f in range(used):
        if face[f, _STATE] == _HULL:
            height = plane[f, 0] * xyz[p, 0] + plane[f, 1] * xyz[p, 1] + plane[f, 2] * xyz[p, 2] - plane[f, _OFFSET]
            if abs(height) <= noise and plane[f, _ABOVE] < noise:
                height = determinant(xyz, face[f, 0], face[f, 1], face[f, 2], p)
            if height > plane[f, _ABOVE]:
                return f, height
    return -1, 0.0


@numba.njit(cache=True, nogil=True, forceinline=True)
def share_out(
    xyz: Array, point: Any, plane: Array, face: Any, stack: Any,
    loose: int, fresh: int, waiting: int, used: int, noise: float,
) -> int:  # fmt: skip
    """Hand the points of a list to the first face that they lie above, drop the rest; return the faces waiting.

    A point outside lies above a new face. Only one that is level with a new face may have been handed, by a hair, to
    the wrong side before, or need more digits: then all faces are tried.
    """
    p = loose
    while p >= 0:
        following = point[p, _LINK]
        x, y, z = xyz[p, 0], xyz[p, 1], xyz[p, 2]
        found, most, level = -1, 0.0, False
        for k in range(fresh):
            f = stack[k, _FRESH]
            height = plane[f, 0] * x + plane[f, 1] * y + plane[f, 2] * z - plane[f, _OFFSET]
            above = max(noise, plane[f, _ABOVE])
            if height > above:
                found, most = f, height
                break
            level = level or height > -above
        if found < 0 and level:
            found, most = _face_below(xyz, plane, face, used, p, noise)
        if found >= 0:
            point[p, _LINK] = face[found, FIRST]
            face[found, FIRST] = p
            if most > plane[found, _MOST]:
                plane[found, _MOST] = most
                face[found, FAR] = p
            if face[found, QUEUED] == 0:
                face[found, QUEUED] = 1
                stack[waiting, QUEUE] = found
                waiting += 1
        p = following
    return waiting


@numba.njit(cache=True, nogil=True, forceinline=True)
def look(
    xyz: Array, plane: Array, face: Any, stack: Any, rim: Any, start: int, p: int, noise: float
) -> tuple[int, int]:
    """Find the faces that point p sees, from face `start` on, and the horizon's edges; return the number of each."""
    stack[0, _SEEN] = start
    face[start, _STATE] = _VISIBLE
    faces, edges, i = 1, 0, 0
    while i < faces:
        f = stack[i, _SEEN]
        i += 1
        for k in range(3):
            g = face[f, _BESIDE + k]
            if face[g, _STATE] == _HULL:
                if _sees(xyz, plane, face, g, p, noise):
                    face[g, _STATE] = _VISIBLE
                    stack[faces, _SEEN] = g
                    faces += 1
                else:
                    face[g, _STATE] = _BEHIND
            if face[g, _STATE] == _BEHIND:
                rim[edges, 0], rim[edges, 1], rim[edges, 2] = face[f, k], face[f, k + 1 if k < 2 else 0], g
                edges += 1
    for k in range(edges):
        face[rim[k, 2], _STATE] = _HULL
    return faces, edges


@numba.njit(cache=True, nogil=True, forceinline=True)
def clear(point: Any, face: Any, stack: Any, faces: int, p: int, free: int) -> tuple[int, int]:
    """Remove the seen faces; return the head of the list of points above them, all but p, and the free slots."""
    loose = -1
    for i in range(faces):
        f = stack[i, _SEEN]
        q = face[f, FIRST]
        while q >= 0:
            following = point[q, _LINK]
            if q != p:
                point[q, _LINK] = loose
                loose = q
            q = following
        face[f, FIRST] = -1
        face[f, _STATE] = _GONE
        stack[free, _FREE] = f
        free += 1
    return loose, free


@numba.njit(cache=True, nogil=True, forceinline=True)
def cone(
    xyz: Array, point: Any, plane: Array, face: Any, stack: Any, rim: Any, p: int, edges: int, used: int, free: int,
    tolerance: float,
) -> tuple[int, int]:  # fmt: skip
    """Join point p to the horizon's edges; return the slots used and free, -1 used where the horizon is no circle."""
    if edges > len(point):
        return -1, free
    for k in range(edges):
        u, v, g = integer(rim[k, 0]), integer(rim[k, 1]), rim[k, 2]
        if free > 0:
            free -= 1
            f = integer(stack[free, _FREE])
        else:
            f = used
            used += 1
        if point[u, _FAN] >= 0 or f >= len(face):
            return -1, free
        _place(xyz, plane, face, f, u, v, p, tolerance)
        point[u, _FAN] = f
        stack[k, _FRESH] = f
        face[f, _BESIDE] = g
        for e in range(3):
            if face[g, e] == v and face[g, e + 1 if e < 2 else 0] == u:
                face[g, _BESIDE + e] = f
    for k in range(edges):
        f, g = stack[k, _FRESH], point[rim[k, 1], _FAN]
        if g < 0:
            return -1, free
        face[f, _BESIDE + 1] = g
        face[g, _BESIDE + 2] = f
    for k in range(edges):
        point[rim[k, 0], _FAN] = -1
    return used, free


@numba.njit(cache=True, nogil=True, forceinline=True)
def total(point: Any, plane: Array, face: Any, stack: Any, rows: Any, used: int) -> tuple[float, int]:
    """Return the volume inside the faces and the number of vertices; -1 where the faces are no sphere."""
    volume, faces, vertices = 0.0, 0, 0
    for f in range(used):
        if face[f, _STATE] == _HULL:
            volume += plane[f, _OFFSET]
            for k in range(3):
                p = face[f, k]
                if point[p, _FAN] == -1:
                    point[p, _FAN] = -2
                    point[p, _LINK] = vertices
                    point[vertices, KEPT] = rows[p]
                    vertices += 1
                stack[faces, k] = point[p, _LINK]
            faces += 1
    return volume / 6, (vertices if faces == 2 * vertices - 4 else -1)
