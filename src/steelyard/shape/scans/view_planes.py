"""The table as each view for itself has it, and how noisy depth is about it."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np

from steelyard.check import Array
from steelyard.shape.points.medians import MIDDLE_HALF, quantile

INCIDENCE = 0.7  # heights over a table, over depth errors: the cosine of incidence, about, of a wrist's arc of views
# Of the camera's distance: so far from where the cameras look the table is bare; and of the noise there and everywhere.
_AROUND, _CLEARLY = 0.35, 0.75
_FEW = 30  # points of one view that its noise is not told from
_JUDGING = 300  # of its points judge a plane
_LEAST = 0.2  # of a view's points near the table: fewer lie on a plane only where it cuts what is no plane, or steeper
_UNDER = 0.2  # of the points on a plane: so many on one lower plane are the table, and the first is a wide object's


def table_noise(sampled: Array, xyz: Array, distance: float, unit: float, views: int) -> float:
    """Return the standard deviation of depth at 1 m, of `views` views.

    sampled, xyz  points as `table_planes` takes them      distance  of the table [m]      unit  of depth [m]

    A wide, low object is no noise: what lies around tells where it is clearly more even. A cloth has folds there too.
    Of a table so small that it does not reach so far, the outer half lies around.
    """
    near, away = 0.03 * distance, np.hypot(xyz[:, 0], xyz[:, 1])
    whole, around = table_planes(sampled, xyz, near), np.empty(0)
    for inner in (_AROUND * distance, np.median(away[np.abs(xyz[:, 2]) < near])):
        if len(around) <= 0.5 * views:
            around = table_planes(sampled[away > inner], xyz[away > inner], near)
    found = noise_of(whole, unit, distance)
    if len(around) > 0.5 * views and (even := noise_of(around, unit, distance)) < _CLEARLY * found:
        return even
    return found


def noise_of(planes: Array, unit: float, distance: float) -> float:
    """Return the standard deviation of depth at 1 m: what each view's own plane leaves of its table points.

    planes  (K, 5) of the views, see `table_planes`      unit  of depth [m]      distance  of the table [m]
    """
    found = float(np.median(planes[:, 4])) / INCIDENCE if len(planes) else 0.0
    return max(found, float(unit / np.sqrt(12) / distance**2))


@numba.njit(cache=True, nogil=True)
def table_planes(sampled: Array, xyz: Array, near: float) -> Array:
    """Return the table as each view for itself has it (K, 5): number of the view, height a + b x + c y, spread.

    sampled  (N, 5) with the depth [m] and the number of the view in the last two columns, view by view
    xyz      (N, 3) the points in the table's frame
    near     height within which points belong to the table [m]

    The spread is that of the points about the plane, heights over squared depth [1/m]. Least squares, points beyond
    three spreads left out from the second round on. Views of few points have none.
    """
    out, count, a = np.empty((len(xyz) // _FEW + 1, 5)), 0, 0
    A, b, rest = np.empty((len(xyz), 3)), np.empty(len(xyz)), np.empty(len(xyz))
    while a < len(xyz):
        n, i, view = 0, a, sampled[a, 4]
        while i < len(xyz) and sampled[i, 4] == view:
            if abs(xyz[i, 2]) < near:
                scale = sampled[i, 3] ** 2
                A[n, 0], A[n, 1], A[n, 2], b[n] = 1 / scale, xyz[i, 0] / scale, xyz[i, 1] / scale, xyz[i, 2] / scale
                n += 1
            i += 1
        a = i
        if n < _FEW:
            continue
        plane, spread = np.zeros(3), np.inf
        for _ in range(3):
            plane = _plane(A[:n], b[:n], plane, 3 * max(spread, 1e-9))
            for j in range(n):
                rest[j] = b[j] - A[j, 0] * plane[0] - A[j, 1] * plane[1] - A[j, 2] * plane[2]
            spread = (quantile(rest, n, 0.75) - quantile(rest, n, 0.25)) / MIDDLE_HALF
        out[count, 0], out[count, 1:4], out[count, 4] = view, plane, spread
        count += 1
    return out[:count]


@numba.njit(cache=True, nogil=True)
def _plane(A: Any, b: Any, before: Any, most: float) -> Any:
    """Return the coefficients (3,) of least squares of the rows that those `before` leave less than `most`."""
    H, g = 1e-12 * np.eye(3), np.zeros(3)
    for j in range(len(b)):
        if abs(b[j] - A[j, 0] * before[0] - A[j, 1] * before[1] - A[j, 2] * before[2]) < most:
            for r in range(3):
                g[r] += A[j, r] * b[j]
                for c in range(3):
                    H[r, c] += A[j, r] * A[j, c]
    return np.linalg.solve(H, g)


@numba.njit(cache=True, nogil=True)
def lowest_planes(sampled: Array, reach: float, clear: float, steepest: float, drawn: Array) -> Array:
    """Return the table as each view for itself has it (K, 4), roughly: number of the view, height a + b x + c y.

    sampled   (N, 5) points in the table's frame, depth [m] and the number of the view, view by view
    reach     height within which the table is sought [m]
    clear     height from which on a point is not on a plane [m]
    steepest  slope that none has
    drawn     (T, 3) numbers in [0, 1) that choose the points of T planes to try

    The plane with most points on it, unless those under it have a plane of their own: so a wide object does not pass
    for the table. What hangs under a small table's edges has none. Views of few points have none, nor such as show
    no plane.
    """
    out, count, end = np.empty((len(sampled) // _FEW + 1, 4)), 0, 0
    near = np.empty(len(sampled), np.int64)
    while end < len(sampled):
        view, n = sampled[end, 4], 0
        while end < len(sampled) and sampled[end, 4] == view:
            if abs(sampled[end, 2]) < reach:
                near[n] = end
                n += 1
            end += 1
        if n < _FEW:
            continue
        tried = np.zeros((len(drawn) + 1, 3))  # the first is the level one
        for t in range(len(drawn)):
            tried[t + 1] = _through(sampled, near[(n * drawn[t]).astype(np.int64)])
        tried = tried[(np.abs(tried[:, 0]) <= reach) & (np.hypot(tried[:, 1], tried[:, 2]) <= steepest)]
        judges = sampled[near[: n : max(1, n // _JUDGING)], :3].T.copy()
        plane, most = _with_most(judges, tried, clear)
        if most < _LEAST * judges.shape[1]:
            continue
        while True:
            judges = judges[:, _heights(judges, plane) <= -clear].copy()
            lower, on = _with_most(judges, tried, clear)
            if on < _UNDER * most:
                break
            plane, most = lower, on
        out[count, 0], out[count, 1:] = view, plane
        count += 1
    return out[:count]


@numba.njit(cache=True, nogil=True)
def _with_most(points: Any, planes: Any, clear: float) -> tuple[Any, int]:
    """Return that of planes (K, 3) which most of points (3, N) lie on, and how many do."""
    best, most = planes[0], -1
    for plane in planes:
        on = 0
        for height in _heights(points, plane):
            on += abs(height) < clear
        if on > most:
            best, most = plane, on
    return best, most


@numba.njit(cache=True, nogil=True)
def _heights(points: Any, plane: Any) -> Any:
    """Return how high points (3, N) lie over a plane a + b x + c y [m]."""
    return points[2] - plane[0] - plane[1] * points[0] - plane[2] * points[1]


@numba.njit(cache=True, nogil=True)
def _through(xyz: Any, rows: Any) -> Any:
    """Return the height a + b x + c y (3,) of the plane through three points; one that is far off where none is."""
    first, one, other = xyz[rows[0]], xyz[rows[1]], xyz[rows[2]]
    x1, y1, z1 = one[0] - first[0], one[1] - first[1], one[2] - first[2]
    x2, y2, z2 = other[0] - first[0], other[1] - first[1], other[2] - first[2]
    area = x1 * y2 - x2 * y1
    if abs(area) < 1e-12:
        return np.full(3, np.inf)
    along, across = (z1 * y2 - z2 * y1) / area, (x1 * z2 - x2 * z1) / area
    return np.array([first[2] - along * first[0] - across * first[1], along, across])
