"""The plane that the object lies on, found in the points of all views."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.shape.views import TablePlane
from steelyard.spatial import Pose, Rotation

_TRIES, _JUDGED = 300, 3000  # planes tried, points that judge them
_NEAR = 0.012  # of the distance: a point this near a plane counts as on it
_LEAST = 0.2  # share of the points that must lie on the table
_ROUNDS = 8


def find_table(points: Array, cameras: Array, distance: float, start: TablePlane | None = None) -> TablePlane:
    """Return the plane with the most points that no camera is below, fitted robustly.

    points    (N, 3) of all views, in W [m]
    cameras   (V, 3) where the views were taken
    distance  typical distance of the points from the camera [m]
    start     a plane that is known to be near, then only fitted anew

    Raises CannotAnswer where fewer than a fifth of the points lie on one plane.
    """
    near = _NEAR * distance
    plane = start or _largest_plane(points, cameras, near)
    height = plane.height(points)
    if (share := float((np.abs(height) < near).mean())) < _LEAST:
        raise CannotAnswer(
            f"no table was found: {100 * share:.0f} % of the measured points lie on one plane below the cameras, "
            f"expected {100 * _LEAST:.0f} % or more. Give table.json, or move the camera so that more of it is seen."
        )
    for _ in range(_ROUNDS):
        on = np.abs(height) < near
        plane = _fitted(points[on], plane)
        height = plane.height(points)
        # A trimmed normal distribution: its middle half spans 1.35 standard deviations.
        near = max(min(near, 3 * float(np.subtract(*np.percentile(height[on], (75, 25)))) / 1.35), 1e-4)
    return plane


def _largest_plane(points: Array, cameras: Array, near: float) -> TablePlane:
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
        raise CannotAnswer("no table was found: no plane of measured points has all cameras above it. Give table.json.")
    return TablePlane(normal[best], float(offset[best]))


def _fitted(points: Array, plane: TablePlane) -> TablePlane:
    """Return the plane of least squares through points (N, 3), on the same side."""
    middle = points.mean(0)
    normal = np.linalg.eigh((points - middle).T @ (points - middle))[1][:, 0]
    normal = normal if normal @ plane.normal > 0 else -normal
    return TablePlane(normal, float(normal @ middle))


def table_frame(table: TablePlane, middle: Array) -> Pose:
    """Return X_WT: a frame whose z is the table's normal and whose origin is the foot of `middle` (3,) on the table."""
    z = table.normal
    x = np.array([1.0, 0, 0]) if abs(z[0]) < 0.9 else np.array([0, 1.0, 0])
    x = x - (x @ z) * z
    x /= np.linalg.norm(x)
    return Pose(Rotation.nearest(np.stack([x, np.cross(z, x), z], axis=1)), middle - table.height(middle) * z)
