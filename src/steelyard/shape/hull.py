"""Volume of the convex hull of points: a compiled quickhull for inner loops, SciPy's Qhull where it gives up.

A point is added where it lies more than a tolerance above a face; which faces it sees is then decided by the exact sign
of a determinant: in double precision with an error bound, in double-double where that cannot tell, and last without any
rounding. So the surface stays closed whatever the points (grids, coplanar faces, duplicates, slivers), and only points
within the tolerance of the hull are left out. Its topology is checked all the same: a fault is reported, never a wrong
volume.

Source: Barber, Dobkin, Huhdanpaa 1996, "The Quickhull algorithm for convex hulls" (outside sets, farthest point first);
Shewchuk 1997, "Adaptive precision floating-point arithmetic" (error bounds, exact differences and products).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import ArrayLike

from steelyard import check
from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.shape.mesh import Integers

# Of the extent: nearer to the hull, a point is on it. Rounding of turned, coplanar points is a thousandth.
TOLERANCE = 1e-13
# Rounding of a plane's determinant, of the product of the box's edges: at most 43 units of 1.1e-16. And of the
# double-double one, of the sum of its terms: 2^-98 holds its dozen roundings of 2^-102.
_ROUNDING = 6e-15
_ROUNDING_TWICE = 2.0**-98
_SPLIT = 134217729.0  # 2^27 + 1, halves the digits of a double


# Columns of the tables below.
_LINK, _FAN, _KEPT = 0, 1, 2
_CORNER, _BESIDE, _FIRST, _FAR, _STATE, _QUEUED = 0, 3, 6, 7, 8, 9
_OFFSET, _ABOVE, _MOST = 3, 4, 5
_QUEUE, _FREE, _SEEN, _FRESH = 0, 1, 2, 3
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
           made by it
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
        return self.point[:, _KEPT]


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


@numba.njit(cache=True, nogil=True)
def _product(a: float, b: float) -> tuple[float, float]:
    """Return a b as a sum of two numbers, exactly."""
    p = a * b
    t = _SPLIT * a
    a1 = t - (t - a)
    a2 = a - a1
    t = _SPLIT * b
    b1 = t - (t - b)
    b2 = b - b1
    return p, a2 * b2 - (((p - a1 * b1) - a2 * b1) - a1 * b2)


@numba.njit(cache=True, nogil=True)
def _difference(a: float, b: float) -> tuple[float, float]:
    """Return a - b as a sum of two numbers, exactly."""
    s = a - b
    t = s - a
    return s, (a - (s - t)) - (b + t)


@numba.njit(cache=True, nogil=True)
def _times(a: float, a2: float, b: float, b2: float) -> tuple[float, float]:
    p, e = _product(a, b)
    e += a * b2 + a2 * b
    s = p + e
    return s, e - (s - p)


@numba.njit(cache=True, nogil=True)
def _minus(a: float, a2: float, b: float, b2: float) -> tuple[float, float]:
    s, e = _difference(a, b)
    t, f = _difference(a2, b2)
    e += t
    u = s + e
    f += e - (u - s)
    v = u + f
    return v, f - (v - u)


@numba.njit(cache=True, nogil=True)
def _determinant(xyz: Array, a: int, b: int, c: int, p: int) -> float:
    """Return (b - a) x (c - a) . (p - a) of four rows, with its true sign."""
    bx, bx2 = _difference(xyz[b, 0], xyz[a, 0])
    by, by2 = _difference(xyz[b, 1], xyz[a, 1])
    bz, bz2 = _difference(xyz[b, 2], xyz[a, 2])
    cx, cx2 = _difference(xyz[c, 0], xyz[a, 0])
    cy, cy2 = _difference(xyz[c, 1], xyz[a, 1])
    cz, cz2 = _difference(xyz[c, 2], xyz[a, 2])
    total, rest, terms = 0.0, 0.0, 0.0
    for k in range(3):
        if k == 0:
            u, u2, v, v2, w, w2, z, z2 = by, by2, cz, cz2, bz, bz2, cy, cy2
        elif k == 1:
            u, u2, v, v2, w, w2, z, z2 = bz, bz2, cx, cx2, bx, bx2, cz, cz2
        else:
            u, u2, v, v2, w, w2, z, z2 = bx, bx2, cy, cy2, by, by2, cx, cx2
        m, m2 = _times(u, u2, v, v2)
        n, n2 = _times(w, w2, z, z2)
        d, d2 = _difference(xyz[p, k], xyz[a, k])
        terms += (abs(m) + abs(n)) * abs(d)
        m, m2 = _minus(m, m2, n, n2)
        m, m2 = _times(m, m2, d, d2)
        total, rest = _minus(total, rest, -m, -m2)
    if abs(total + rest) > _ROUNDING_TWICE * terms:
        return float(total + rest)
    return _exact_determinant(xyz, a, b, c, p)


@numba.njit(cache=True, nogil=True)
def _exact_determinant(xyz: Array, a: int, b: int, c: int, p: int) -> float:
    """Return the same from a sum without rounding: for four points nearly, or truly, on one line or plane."""
    sides = np.empty((3, 3, 2))
    for k in range(3):
        sides[0, k, 0], sides[0, k, 1] = _difference(xyz[b, k], xyz[a, k])
        sides[1, k, 0], sides[1, k, 1] = _difference(xyz[c, k], xyz[a, k])
        sides[2, k, 0], sides[2, k, 1] = _difference(xyz[p, k], xyz[a, k])
    parts = np.empty(200)  # of the sum so far, by rising size, none overlapping: 6 x 8 products of 4 parts at most
    used = 0
    for turn in range(6):
        i = turn % 3
        j, k = ((i + 1) % 3, (i + 2) % 3) if turn < 3 else ((i + 2) % 3, (i + 1) % 3)
        for bits in range(8):
            u, v, w = sides[0, i, bits & 1], sides[1, j, (bits >> 1) & 1], sides[2, k, bits >> 2]
            if u != 0.0 and v != 0.0 and w != 0.0:
                m, m2 = _product(u if turn < 3 else -u, v)
                for factor in (m2, m):
                    n, n2 = _product(factor, w)
                    used = _add_exactly(parts, used, n2)
                    used = _add_exactly(parts, used, n)
    return float(parts[used - 1]) if used > 0 else 0.0


@numba.njit(cache=True, nogil=True)
def _add_exactly(parts: Array, used: int, number: float) -> int:
    """Add a number to a sum kept in parts that do not overlap; return how many there are now, none of them zero."""
    kept = 0
    for k in range(used):
        number, rest = _difference(number, -parts[k])
        if rest != 0.0:
            parts[kept] = rest
            kept += 1
    if number != 0.0:
        parts[kept] = number
        kept += 1
    return kept


@numba.njit(cache=True, nogil=True)
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
    face[f, _FIRST] = -1
    face[f, _STATE] = _HULL


@numba.njit(cache=True, nogil=True)
def _sees(xyz: Array, plane: Array, face: Any, f: int, p: int, noise: float) -> bool:
    """Return whether point p lies strictly above face f."""
    height = plane[f, 0] * xyz[p, 0] + plane[f, 1] * xyz[p, 1] + plane[f, 2] * xyz[p, 2] - plane[f, _OFFSET]
    if abs(height) > noise:
        return bool(height > 0)
    return bool(_determinant(xyz, face[f, 0], face[f, 1], face[f, 2], p) > 0)


@numba.njit(cache=True, nogil=True)
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


@numba.njit(cache=True, nogil=True)
def _start(
    xyz: Array, point: Any, plane: Array, face: Any, stack: Any, count: int, axis: int, tolerance: float, noise: float
) -> int:
    """Make the first four faces; return the head of the list of other points, -2 where all points are flat."""
    a, b, c, d = _simplex(xyz, count, axis, tolerance, noise)
    if d < 0:
        return -2
    _place(xyz, plane, face, 0, a, b, c, tolerance)
    _place(xyz, plane, face, 1, a, d, b, tolerance)
    _place(xyz, plane, face, 2, b, d, c, tolerance)
    _place(xyz, plane, face, 3, c, d, a, tolerance)
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
                height = _determinant(xyz, face[f, 0], face[f, 1], face[f, 2], p)
            if height > plane[f, _ABOVE]:
                return f, height
    return -1, 0.0


@numba.njit(cache=True, nogil=True)
def _share_out(
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
            point[p, _LINK] = face[found, _FIRST]
            face[found, _FIRST] = p
            if most > plane[found, _MOST]:
                plane[found, _MOST] = most
                face[found, _FAR] = p
            if face[found, _QUEUED] == 0:
                face[found, _QUEUED] = 1
                stack[waiting, _QUEUE] = found
                waiting += 1
        p = following
    return waiting


@numba.njit(cache=True, nogil=True)
def _look(
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


@numba.njit(cache=True, nogil=True)
def _clear(point: Any, face: Any, stack: Any, faces: int, p: int, free: int) -> tuple[int, int]:
    """Remove the seen faces; return the head of the list of points above them, all but p, and the free slots."""
    loose = -1
    for i in range(faces):
        f = stack[i, _SEEN]
        q = face[f, _FIRST]
        while q >= 0:
            following = point[q, _LINK]
            if q != p:
                point[q, _LINK] = loose
                loose = q
            q = following
        face[f, _FIRST] = -1
        face[f, _STATE] = _GONE
        stack[free, _FREE] = f
        free += 1
    return loose, free


@numba.njit(cache=True, nogil=True)
def _cone(
    xyz: Array, point: Any, plane: Array, face: Any, stack: Any, rim: Any, p: int, edges: int, used: int, free: int,
    tolerance: float, noise: float,
) -> tuple[int, int]:  # fmt: skip
    """Join point p to the horizon's edges; return the slots used and free, -1 used where the horizon is no circle."""
    if edges > len(point):
        return -1, free
    for k in range(edges):
        u, v, g = rim[k, 0], rim[k, 1], rim[k, 2]
        if free > 0:
            free -= 1
            f = stack[free, _FREE]
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


@numba.njit(cache=True, nogil=True)
def _total(point: Any, plane: Array, face: Any, rows: Any, used: int) -> tuple[float, int]:
    """Return the volume inside the faces and the number of vertices; -1 where the faces are no sphere."""
    volume, faces, vertices = 0.0, 0, 0
    for f in range(used):
        if face[f, _STATE] == _HULL:
            faces += 1
            volume += plane[f, _OFFSET]
            for k in range(3):
                p = face[f, k]
                if point[p, _FAN] == -1:
                    point[p, _FAN] = -2
                    point[vertices, _KEPT] = rows[p]
                    vertices += 1
    return volume / 6, (vertices if faces == 2 * vertices - 4 else -1)


@numba.njit(cache=True, nogil=True)
def hull_volume(points: Array, rows: Any, count: int, tolerance: float, work: HullWork) -> tuple[float, int]:
    """Return the volume of the hull of points[rows[:count]] and how many vertices it has; -1 vertices is a fault.

    points     (N, 3)
    rows       numbers of points, the first `count` (at least one) are used; repeated and equal points do no harm
    tolerance  length; a point nearer to the hull of others is taken to be on it
    work       room for `count` points; `work.point[:vertices, 2]` receives the rows of the vertices

    Points flatter than the tolerance have volume 0, and all of them are kept. Numbers that are not finite, or whose
    product is not, are a fault.
    """
    xyz, point, plane, face, stack, rim = work
    low_x = low_y = low_z = np.inf
    high_x = high_y = high_z = -np.inf
    nothing = 0.0
    for k in range(count):
        x, y, z = points[rows[k], 0], points[rows[k], 1], points[rows[k], 2]
        nothing += 0.0 * (x + y + z)
        low_x, low_y, low_z = min(low_x, x), min(low_y, y), min(low_z, z)
        high_x, high_y, high_z = max(high_x, x), max(high_y, y), max(high_z, z)
    for k in range(count):
        x, y, z = points[rows[k], 0], points[rows[k], 1], points[rows[k], 2]
        xyz[k, 0], xyz[k, 1], xyz[k, 2] = x - low_x, y - low_y, z - low_z
    wide_x, wide_y, wide_z = high_x - low_x, high_y - low_y, high_z - low_z
    noise = _ROUNDING * wide_x * wide_y * wide_z
    if not noise + nothing < np.inf:
        return np.nan, -1
    axis = 0 if wide_x >= wide_y and wide_x >= wide_z else (1 if wide_y >= wide_z else 2)
    loose = _start(xyz, point, plane, face, stack, count, axis, tolerance, noise)
    if loose == -2:
        for k in range(count):
            point[k, _KEPT] = rows[k]
        return 0.0, count
    used, free = 4, 0
    waiting = _share_out(xyz, point, plane, face, stack, loose, 4, 0, used, noise)
    while waiting > 0:
        waiting -= 1
        f = stack[waiting, _QUEUE]
        face[f, _QUEUED] = 0
        if face[f, _FIRST] >= 0:
            p = face[f, _FAR]
            faces, edges = _look(xyz, plane, face, stack, rim, f, p, noise)
            loose, free = _clear(point, face, stack, faces, p, free)
            used, free = _cone(xyz, point, plane, face, stack, rim, p, edges, used, free, tolerance, noise)
            if used < 0:
                face[:, _QUEUED] = 0
                return np.nan, -1
            waiting = _share_out(xyz, point, plane, face, stack, loose, edges, waiting, used, noise)
    return _total(point, plane, face, rows, used)


def convex_hull(points: ArrayLike) -> tuple[float, Integers]:
    """Return the volume of the convex hull of points (N, 3), and which rows are its vertices, rising.

    Flat sets have volume 0, and every row counts as a vertex.
    """
    xyz = check.vectors("points", points)
    if xyz.ndim != 2 or not len(xyz):
        raise BadValue(f"a hull needs points (N, 3), N > 0; got {xyz.shape}.")
    work = hull_work(len(xyz))
    tolerance = TOLERANCE * float(np.ptp(xyz, axis=0).max())
    volume, vertices = hull_volume(xyz, np.arange(len(xyz)), len(xyz), tolerance, work)
    if vertices < 0:
        return qhull(xyz)
    return float(volume), np.sort(work.kept[:vertices]).astype(np.int64)


def qhull(points: Array) -> tuple[float, Integers]:
    """Return the same from SciPy's Qhull: thirty to three times slower, and another witness."""
    from scipy.spatial import ConvexHull, QhullError

    middle, size = points.mean(0), float(np.ptp(points, axis=0).max())
    try:
        hull = ConvexHull((points - middle) / size if size > 0 else points)
    except (QhullError, ValueError):
        return 0.0, np.arange(len(points))
    return float(hull.volume) * size**3, np.sort(hull.vertices).astype(np.int64)
