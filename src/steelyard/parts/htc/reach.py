"""The hull of a cluster and the points of its neighbour, from the cluster's own hull: a bound cheaper than a hull.

Point after point is joined to the faces that are there: those it lies above are replaced by a cone over their border.
What the hull gains is the sum of the tets between the point and the faces it sees. All faces are looked at for every
point, in long loops without branches: for the dozens of faces of most clusters nothing is faster.

The sum never exceeds the hull of both, but for rounding. A point is joined only where every face is clearly below it or
clearly above, by more than what rounding can do to the determinant: then the faces that it sees are the true ones, the
new faces make convex edges with what is left, and the surface stays that of a convex hull. A point level with a face is
left out, and the hull of fewer points is no larger.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numba
import numpy as np

from steelyard.check import Array
from steelyard.shape.hulls.borrowed import borrowed, integer

# Points of both; of more than that no bound is made: a table has the square of it.
MOST = 512
# Rounding of a plane's determinant, of the product of the box's edges: three times that of the hull kernel, which
# takes its points as they are moved to the box's corner.
_ROUNDING = 2e-14


class Points(NamedTuple):
    """The points of a hull (MOST,), from the lower corner of their box."""

    x: Any
    y: Any
    z: Any


class Faces(NamedTuple):
    """The faces of a hull, up to 4 MOST.

    nx, ny, nz, of  of each: its normal, twice the area long; the product of that with a corner
    corner          (4 MOST, 3) numbers of points
    """

    nx: Any
    ny: Any
    nz: Any
    of: Any
    corner: Any


class Room(NamedTuple):
    """Room for one hull of up to MOST points.

    height  of a point above each face, times the normal's length
    seen    faces below the point that is joined
    rim     (4 MOST, 2) edges of their border
    edge    (MOST^2,) the last point joined that saw a face with this edge, from and to
    """

    points: Points
    faces: Faces
    height: Any
    seen: Any
    rim: Any
    edge: Any


def room() -> Room:
    """Return room for the hulls of clusters."""
    n, m = MOST, 4 * MOST
    return Room(
        Points(np.empty(n), np.empty(n), np.empty(n)),
        Faces(np.empty(m), np.empty(m), np.empty(m), np.empty(m), np.empty((m, 3), np.int32)),
        np.empty(m), np.empty(m, np.int32), np.empty((m, 2), np.int32), np.zeros(n * n, np.int64),
    )  # fmt: skip


@numba.njit(cache=True, nogil=True)
def reach(
    xyz: Array, rows: Any, length: int, count: int, face: Any, at: int, hull: float, stamp: int, room: Any
) -> float:
    """Return a volume that the hull of xyz[rows[:count]] holds: that of the first `length`, grown by the others.

    xyz, rows  points (N, 3), and numbers of those asked for
    face, at  corners of the faces of the first, numbers among them, are face[at : at + 3 (2 length - 4)], as in `Hulls`
    hull      the volume of those faces
    stamp     a positive number; that of the next call in the same room is at least `count` larger
    """
    room_p, room_f = room.points, room.faces
    points = Points(borrowed(room_p.x), borrowed(room_p.y), borrowed(room_p.z))
    faces = Faces(
        borrowed(room_f.nx), borrowed(room_f.ny), borrowed(room_f.nz), borrowed(room_f.of),
        borrowed(room_f.corner),
    )  # fmt: skip
    x, y, z = points
    nx, ny, nz, of, corner = faces
    height, seen, rim, edge = borrowed(room.height), borrowed(room.seen), borrowed(room.rim), borrowed(room.edge)
    noise = _placed(xyz, rows, count, points)
    made = integer(0)
    for f in range(at, at + 3 * (2 * length - 4), 3):
        if face[f] >= 0:
            _plane(points, faces, made, integer(face[f]), face[f + 1], face[f + 2])
            made += 1
    grown = 0.0
    for p in range(length, count):
        px, py, pz = x[p], y[p], z[p]
        for f in range(made):
            height[f] = nx[f] * px + ny[f] * py + nz[f] * pz - of[f]
        above, gain = _above(height, seen, made, noise)
        if above > 0:
            grown += gain
            rims = _border(corner, seen, above, rim, edge, count, stamp + p)
            for i in range(rims):
                if i < above:
                    f = integer(seen[i])
                else:
                    f = made
                    made += 1
                _plane(points, faces, f, integer(rim[i, 0]), rim[i, 1], p)
            for i in range(above - 1, rims - 1, -1):  # fewer faces than before: the last fill the holes
                f = integer(seen[i])
                made -= 1
                nx[f], ny[f], nz[f], of[f] = nx[made], ny[made], nz[made], of[made]
                corner[f, 0], corner[f, 1], corner[f, 2] = corner[made, 0], corner[made, 1], corner[made, 2]
    return hull + grown / 6


@numba.njit(cache=True, nogil=True, forceinline=True)
def _placed(xyz: Array, rows: Any, count: int, points: Points) -> float:
    """Write the points from the lower corner of their box; return the rounding of a determinant of them."""
    x, y, z = points
    low_x = low_y = low_z = np.inf
    high_x = high_y = high_z = -np.inf
    for p in range(count):
        v = rows[p]
        x[p], y[p], z[p] = xyz[v, 0], xyz[v, 1], xyz[v, 2]
        low_x, low_y, low_z = min(low_x, x[p]), min(low_y, y[p]), min(low_z, z[p])
        high_x, high_y, high_z = max(high_x, x[p]), max(high_y, y[p]), max(high_z, z[p])
    for p in range(count):
        x[p] -= low_x
        y[p] -= low_y
        z[p] -= low_z
    return float(_ROUNDING * (high_x - low_x) * (high_y - low_y) * (high_z - low_z))


@numba.njit(cache=True, nogil=True, forceinline=True)
def _plane(points: Points, faces: Faces, f: int, a: int, b: int, c: int) -> None:
    """Make face f of three points."""
    x, y, z = points
    nx, ny, nz, of, corner = faces
    corner[f, 0], corner[f, 1], corner[f, 2] = a, b, c
    ax, ay, az = x[a], y[a], z[a]
    ux, uy, uz = x[b] - ax, y[b] - ay, z[b] - az
    vx, vy, vz = x[c] - ax, y[c] - ay, z[c] - az
    i, j, k = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    nx[f], ny[f], nz[f] = i, j, k
    of[f] = i * ax + j * ay + k * az


@numba.njit(cache=True, nogil=True, forceinline=True)
def _above(height: Array, seen: Any, faces: int, noise: float) -> tuple[int, float]:
    """List the faces below a point; return their number, 0 if it is level with any, and the sum of the heights."""
    above, gain = integer(0), 0.0
    for f in range(faces):
        h = height[f]
        if h > noise:
            seen[above] = f
            above += 1
            gain += h
        elif h >= -noise:
            return integer(0), 0.0
    return above, gain


@numba.njit(cache=True, nogil=True, forceinline=True)
def _border(corner: Any, seen: Any, above: int, rim: Any, edge: Any, count: int, mine: int) -> int:
    """List the edges of the faces seen whose other side is not; return their number."""
    for i in range(above):
        f = seen[i]
        a, b, c = corner[f, 0], corner[f, 1], corner[f, 2]
        edge[a * count + b] = edge[b * count + c] = edge[c * count + a] = mine
    rims = integer(0)
    for i in range(above):
        f = seen[i]
        a, b, c = corner[f, 0], corner[f, 1], corner[f, 2]
        for u, v in ((a, b), (b, c), (c, a)):
            if edge[v * count + u] != mine:
                rim[rims, 0], rim[rims, 1] = u, v
                rims += 1
    return int(rims)
