"""The plane that the object lies on, found in the points of all views."""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.shape.points.medians import middle_half_std
from steelyard.shape.views import TablePlane
from steelyard.spatial import Pose, Rotation

_TRIES, _JUDGED = 300, 3000  # planes tried, points that judge them
NEAR = 0.012  # of the distance: a point this near a plane counts as on it
_LEAST = 0.2  # share of the points that must lie on the table
_LEAST_GIVEN = 0.08  # the same of a table that is known: a stand or a tray is small
_SLICE, _FACE, _ON_FACE = 0.004, 0.75, 0.003  # of the distance, of the points in the slices beside it, of all points
_PARALLEL = np.cos(np.radians(5.0))  # to a stand's face: the table under it
_LOOKED_AT = 0.6  # of the distance: no object reaches so high over its table that cameras look there
_ROUNDS = 8


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
            f"no table was found: {100 * share:.0f} % of the measured points lie on "
            f"{'the plane in table.json' if start else 'one plane below the cameras'}, "
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


def table_of(points: Array, cameras: Array, distance: float, given: TablePlane) -> TablePlane:
    """Return a table that was given as its points have it, or, of a stand too small for that, as it is."""
    try:
        return find_table(points, cameras, distance, given)
    except CannotAnswer:
        if not _is_face(given.height(points), distance):
            raise
        if find_table(points, cameras, distance).normal @ given.normal < _PARALLEL:
            raise
        return given


def table_over_floor(points: Array, cameras: Array, looks: Array, distance: float) -> tuple[TablePlane, float]:
    """Return the table near the point (3,) that the cameras look at, and how far a floor is under it [m], inf without.

    Beside a small table the floor may show more than the table does, too low for anything on it to be looked at.
    """
    found = find_table(points, cameras, distance)
    if found.height(looks) > _LOOKED_AT * distance:
        with suppress(CannotAnswer):
            near = np.linalg.norm(points - looks, axis=1) < _LOOKED_AT * distance
            table = find_table(points[near], cameras, distance)
            if table.normal @ found.normal > _PARALLEL:
                return table, -float(table.height(found.offset * found.normal))
    return found, np.inf


def leveller(points: Array, cameras: Array, distance: float, stated: TablePlane) -> tuple[TablePlane, float]:
    """Return the plane that tells how views lie, and how far another one is under it [m], inf without.

    A plane that was given may be that of a stand: then it is that one, or the table under it, whichever shows more. A
    floor is too far off for that, and the wider it shows, the fewer views have much of it near.
    """
    with suppress(CannotAnswer):
        found = find_table(points, cameras, distance)
        step = -float(stated.height(found.offset * found.normal))
        if found.normal @ stated.normal > _PARALLEL and NEAR / 2 < step / distance < _LOOKED_AT:
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
