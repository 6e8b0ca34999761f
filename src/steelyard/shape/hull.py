"""Volume of the convex hull of points: a compiled quickhull for inner loops, and SciPy's Qhull.

A point is added where it lies more than a tolerance above a face; which faces it sees is then decided by the exact sign
of a determinant: in double precision with an error bound, and without any rounding where that cannot tell. Points are
taken on a grid of 2^53 steps along each edge of their box, so that their differences are exact and no product vanishes.
Every surface is then convex to the last digit, and what a point sees of one is a disk: the next one is closed, too,
whatever the points (grids, coplanar faces, duplicates, slivers), and only points within the tolerance of the hull are
left out. Its topology is checked all the same: a fault is reported, never a wrong volume.

Source: Barber, Dobkin, Huhdanpaa 1996, "The Quickhull algorithm for convex hulls" (outside sets, farthest point first);
Shewchuk 1997, "Adaptive precision floating-point arithmetic" (error bounds, exact differences and products).
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np

from steelyard.check import Array, Integers
from steelyard.shape.hulls.borrowed import borrowed, integer
from steelyard.shape.hulls.hull_faces import (
    FAR,
    FIRST,
    KEPT,
    QUEUE,
    QUEUED,
    HullWork,
    clear,
    cone,
    hull_work,
    look,
    share_out,
    start,
    total,
)  # fmt: skip

__all__ = ["TOLERANCE", "HullWork", "hull_volume", "hull_work", "qhull"]

# Of the extent: nearer to the hull, a point is on it. Rounding of turned, coplanar points is a thousandth.
TOLERANCE = 1e-13
# Rounding of a plane's determinant, of the product of the box's edges: at most 43 units of 1.1e-16.
_ROUNDING = 6e-15


@numba.njit(cache=True, nogil=True)
def hull_volume(points: Array, rows: Any, count: int, tolerance: float, work: HullWork) -> tuple[float, int]:
    """Return the volume of the hull of points[rows[:count]] and how many vertices it has; -1 vertices is a fault.

    points     (N, 3)
    rows       numbers of points, the first `count` (at least one) are used; repeated and equal points do no harm
    tolerance  length; a point nearer to the hull of others is taken to be on it
    work       room for `count` points; `work.point[:vertices, 2]` receives the rows of the vertices, and, if
               the volume is not 0, `work.stack[: 2 * vertices - 4, :3]` the corners of the faces, numbers among those

    Points flatter than the tolerance have volume 0, and all of them are kept. Numbers that are not finite, or whose
    product is not, are a fault.
    """
    xyz, point, plane = borrowed(work.xyz), borrowed(work.point), borrowed(work.plane)
    face, stack, rim = borrowed(work.face), borrowed(work.stack), borrowed(work.rim)
    low_x = low_y = low_z = np.inf
    high_x = high_y = high_z = -np.inf
    nothing = 0.0
    for k in range(count):
        x, y, z = points[rows[k], 0], points[rows[k], 1], points[rows[k], 2]
        nothing += 0.0 * (x + y + z)
        low_x, low_y, low_z = min(low_x, x), min(low_y, y), min(low_z, z)
        high_x, high_y, high_z = max(high_x, x), max(high_y, y), max(high_z, z)
    wide_x, wide_y, wide_z = high_x - low_x, high_y - low_y, high_z - low_z
    for k in range(count):
        x, y, z = points[rows[k], 0], points[rows[k], 1], points[rows[k], 2]
        # Adding the box's edge rounds to the grid, and taking it away again is exact.
        xyz[k, 0] = x - low_x + wide_x - wide_x
        xyz[k, 1] = y - low_y + wide_y - wide_y
        xyz[k, 2] = z - low_z + wide_z - wide_z
    noise = _ROUNDING * wide_x * wide_y * wide_z
    if not noise + nothing < np.inf:
        return np.nan, -1
    axis = 0 if wide_x >= wide_y and wide_x >= wide_z else (1 if wide_y >= wide_z else 2)
    loose = start(xyz, point, plane, face, stack, count, axis, tolerance, noise)
    if loose == -2:
        for k in range(count):
            point[k, KEPT] = rows[k]
        return 0.0, count
    # Whole numbers of one type, plain constants being another: else what they are passed to is compiled twice.
    used, free, waiting = integer(4), integer(0), integer(0)
    waiting = share_out(xyz, point, plane, face, stack, loose, used, waiting, used, noise)
    while waiting > 0:
        waiting -= 1
        f = integer(stack[waiting, QUEUE])
        face[f, QUEUED] = 0
        if face[f, FIRST] >= 0:
            p = integer(face[f, FAR])
            faces, edges = look(xyz, plane, face, stack, rim, f, p, noise)
            loose, free = clear(point, face, stack, faces, p, free)
            used, free = cone(xyz, point, plane, face, stack, rim, p, edges, used, free, tolerance)
            if used < 0:
                face[:, QUEUED] = 0
                return np.nan, -1
            waiting = share_out(xyz, point, plane, face, stack, loose, edges, waiting, used, noise)
    return total(point, plane, face, stack, rows, used)


def qhull(points: Array) -> tuple[float, Integers]:
    """Return volume and vertices, rising, by SciPy's Qhull: three to thirty times slower, and another witness.

    Qhull gives up on some sets that are not flat; those it is given again, joggled.
    """
    from scipy.spatial import ConvexHull, QhullError

    middle, size = points.mean(0), float(np.ptp(points, axis=0).max())
    spread = np.linalg.svd(points - middle, compute_uv=False)
    if len(points) < 4 or spread[2] <= TOLERANCE * spread[0]:
        return 0.0, np.arange(len(points))
    scaled = (points - middle) / size
    try:
        hull = ConvexHull(scaled)
    except QhullError:
        hull = ConvexHull(scaled, qhull_options="QJ")
    return float(hull.volume) * size**3, np.sort(hull.vertices).astype(np.int64)
