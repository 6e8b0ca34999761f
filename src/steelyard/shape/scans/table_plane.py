"""The plane that the object lies on, found in the points of all views."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import numba
import numpy as np

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.shape.points.medians import MIDDLE_HALF, middle_half_std, quantile
from steelyard.shape.views import TablePlane
from steelyard.spatial import Pose, Rotation

_TRIES, _JUDGED = 300, 3000  # planes tried, points that judge them
NEAR = 0.012  # of the distance: a point this near a plane counts as on it
INCIDENCE = 0.7  # heights over a table, over depth errors: the cosine of incidence, about, of a wrist's arc of views
_LEAST = 0.2  # share of the points that must lie on the table
_LEAST_GIVEN = 0.08  # the same of a table that is known: a stand or a tray is small
_SLICE, _FACE, _ON_FACE = 0.004, 0.75, 0.003  # of the distance, of the points in the slices beside it, of all points
_PARALLEL = np.cos(np.radians(5.0))  # to a stand's face: the table under it
# Of the camera's distance: so far from where the cameras look the table is bare; and of the noise there and everywhere.
_AROUND, _CLEARLY = 0.35, 0.75
_ROUNDS = 8
_FEW = 30  # points of one view that its noise is not told from
_JUDGING = 300  # of its points judge a plane
_UNDER = 4.0  # points on a plane that one under it outweighs: the table may be a fifth of what a view shows


def find_table(points: Array, cameras: Array, distance: float, start: TablePlane | None = None) -> TablePlane:
    """Return the plane with the most points that no camera is below, fitted robustly.

    points    (N, 3) of all views, in W [m]
    cameras   (V, 3) where the views were taken
    distance  typical distance of the points from the camera [m]
    start     a plane that is known to be near, then only fitted anew

    Raises CannotAnswer where fewer than a fifth of the points lie on one plane, of one that is known a twelfth.
    """
    if len(points) < 3:
        raise CannotAnswer("no table was found: the depth images hold next to no measurements.")
    near = NEAR * distance
    plane = start or largest_plane(points, cameras, near)
    height = plane.height(points)
    least = _LEAST_GIVEN if start else _LEAST
    if (share := float((np.abs(height) < near).mean())) < least:
        raise CannotAnswer(
            f"no table was found: {100 * share:.0f} % of the measured points lie on one plane below the cameras, "
            f"expected {100 * least:.0f} % or more."
        )
    on = np.abs(height) < near
    for _ in range(_ROUNDS):
        plane = _fitted(points[on], plane)
        height = plane.height(points)
        near = max(min(near, 3 * middle_half_std(height[on])), 1e-4)
        before, on = on, np.abs(height) < near
        if on.sum() < before.sum() / 2:
            # A low, flat object seen with little noise lifts the mean off the table, and not the median.
            on = np.abs(height - np.median(height[before])) < near
    return plane


def table_of(points: Array, cameras: Array, distance: float, given: TablePlane | None) -> TablePlane:
    """Return the table; one that is given as its points have it, or, of a stand too small for that, as it is."""
    try:
        return find_table(points, cameras, distance, given)
    except CannotAnswer:
        if given is None or not _is_face(given.height(points), distance):
            raise
        if find_table(points, cameras, distance).normal @ given.normal < _PARALLEL:
            raise
        return given


def leveller(points: Array, cameras: Array, distance: float, stated: TablePlane) -> tuple[TablePlane, float]:
    """Return the plane that tells how views lie, and how far another one is under it [m], inf without.

    A plane that was given may be that of a stand: then it is that one, or the table under it, whichever shows more.
    """
    with suppress(CannotAnswer):
        found = find_table(points, cameras, distance)
        step = -float(stated.height(found.offset * found.normal))
        if found.normal @ stated.normal > _PARALLEL and step > NEAR * distance / 2:
            return found, np.inf
        lower = points[stated.height(points) < -NEAR * distance]
        under = find_table(lower, cameras, distance)
        if under.normal @ stated.normal > _PARALLEL:
            return stated, -float(stated.height(under.offset * under.normal))
    return stated, np.inf


def _is_face(height: Array, distance: float) -> bool:
    """Whether heights (N,) of points over a plane show a small face in it, and no wall that it cuts."""
    within, around = (float((np.abs(height) < slices * _SLICE * distance).mean()) for slices in (1, 3))
    return within > max(_ON_FACE, _FACE * (around - within))


def looked_at(R: Array, p: Array) -> Array:
    """Return the point (3,) nearest to all optical axes; where they are parallel, half a metre along the first."""
    axis = R[:, :, 2]
    across = np.eye(3) - axis[:, :, None] * axis[:, None, :]
    # A weak pull, so that a single view has an answer too.
    start = p.mean(0) + 0.5 * axis.mean(0)
    H = across.sum(0) + 1e-3 * np.eye(3)
    return np.asarray(np.linalg.solve(H, np.einsum("vij,vj->i", across, p) + 1e-3 * start))


def largest_plane(points: Array, cameras: Array, near: float) -> TablePlane:
    """Return the plane that most of points (N, 3) are within `near` of, no camera (V, 3) below; or CannotAnswer."""
    rng = np.random.default_rng(0)
    a, b, c = points[rng.integers(len(points), size=(3, _TRIES))]
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    offset = (normal * a).sum(1)
    up = cameras.mean(0) @ normal.T < offset
    normal[up], offset[up] = -normal[up], -offset[up]
    judged = points[rng.permutation(len(points))[:_JUDGED]]
    votes = (np.abs(judged @ normal.T - offset) < near).sum(0)
    votes[((cameras @ normal.T - offset) < near).any(0)] = -1
    best = int(np.argmax(votes))
    if votes[best] <= 0:
        raise CannotAnswer("no table was found: no plane of measured points has all cameras above it.")
    return TablePlane(normal[best], float(offset[best]))


def _fitted(points: Array, plane: TablePlane) -> TablePlane:
    """Return the plane of least squares through points (N, 3), on the same side."""
    middle = points.mean(0)
    about = points - middle
    normal = np.linalg.eigh(about.T @ about)[1][:, 0]
    normal = normal if normal @ plane.normal > 0 else -normal
    return TablePlane(normal, float(normal @ middle))


def table_frame(table: TablePlane, middle: Array) -> Pose:
    """Return X_WT: a frame whose z is the table's normal and whose origin is the foot of `middle` (3,) on the table."""
    z = table.normal
    x = np.array([1.0, 0, 0]) if abs(z[0]) < 0.9 else np.array([0, 1.0, 0])
    x = x - (x @ z) * z
    x /= np.linalg.norm(x)
    return Pose(Rotation.nearest(np.stack([x, np.cross(z, x), z], axis=1)), middle - table.height(middle) * z)


def table_noise(sampled: Array, xyz: Array, distance: float, unit: float, views: int) -> float:
    """Return the standard deviation of depth at 1 m, of `views` views.

    sampled, xyz  points as `table_planes` takes them      distance  of the table [m]      unit  of depth [m]

    A wide, low object is no noise: what lies around tells where it is clearly more even. A cloth has folds there too.
    """
    found: list[float] = []
    near = 0.03 * distance
    for rows in (slice(None), np.hypot(xyz[:, 0], xyz[:, 1]) > _AROUND * distance):
        planes = table_planes(sampled[rows], xyz[rows], near)
        if len(planes) > 0.5 * views or not found:
            found.append(noise_of(planes, unit, distance))
    return found[-1] if found[-1] < _CLEARLY * found[0] else found[0]


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

    The plane with most points on it, those under it counted as so many that a wide object does not pass for the
    table: nothing lies under that. Views of few points have none.
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
        step, best, plane = max(1, n // _JUDGING), -np.inf, np.zeros(3)
        for t in range(-1, len(drawn)):  # the first is the level one
            tried = np.zeros(3) if t < 0 else _through(sampled, near[(n * drawn[t]).astype(np.int64)])
            if abs(tried[0]) > reach or np.hypot(tried[1], tried[2]) > steepest:
                continue
            score = 0.0
            for i in near[:n:step]:
                height = sampled[i, 2] - tried[0] - tried[1] * sampled[i, 0] - tried[2] * sampled[i, 1]
                score += 1.0 if abs(height) < clear else -_UNDER if height < 0 else 0.0
            if score > best:
                best, plane = score, tried
        out[count, 0], out[count, 1:] = view, plane
        count += 1
    return out[:count]


@numba.njit(cache=True, nogil=True)
def _through(xyz: Any, rows: Any) -> Any:
    """Return the height a + b x + c y (3,) of the plane through three points; one that is far off where none is."""
    A, b = np.ones((3, 3)), np.empty(3)
    for r in range(3):
        A[r, 1], A[r, 2], b[r] = xyz[rows[r], 0], xyz[rows[r], 1], xyz[rows[r], 2]
    if abs(np.linalg.det(A)) < 1e-12:
        return np.full(3, np.inf)
    return np.linalg.solve(A, b)
