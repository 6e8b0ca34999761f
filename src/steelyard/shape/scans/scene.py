"""Views in the frame of the table, and how noisy their depth is there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.shape.scans import sight_lines
from steelyard.shape.scans.depth_images import Images, held, sampled, stride_of
from steelyard.shape.scans.table_plane import leveller, looked_at, table_frame, table_of, table_over_floor
from steelyard.shape.scans.view_mistakes import advice
from steelyard.shape.scans.view_planes import table_noise
from steelyard.shape.views import TablePlane, Views
from steelyard.spatial import Pose

LEAST_VIEWS = 3  # that must agree before something is believed
_SHOW = 4  # one view in so many sees a given place
OUTER = 0.2  # of what a place seen to be empty says: one before a surface, within its noise
WINDOW = 0.002  # how far from a settled point a measurement of it may lie, beside its noise [m]
_SAMPLES = 30_000  # points that find the table


@dataclass(eq=False)
class Scene:
    """The images with their poses in the frame of the table T: z up, the origin under where the cameras look.

    X_WT      the table in W
    R, p      rotations (V, 3, 3) and positions (V, 3) [m] of the cameras in T; they start where they were reported
    distance  typical one from a camera to where the cameras look [m]
    noise     standard deviation of depth at 1 m; it grows with the square of depth [1/m]
    stated    the table that was given, as the points have it, in W; None where it was to be found
    raised    whether a lower table shows beside this one, as beside a stand: what lies there is no object's
    floor     what is measured lower than this is not of the table [m]
    """

    views: Views
    X_WT: Pose
    R: Array
    p: Array
    distance: float
    noise: float
    stated: TablePlane | None = None
    raised: bool = False
    floor: float = -np.inf

    @property
    def table(self) -> TablePlane:
        """The plane that the object lies on, in W."""
        normal = self.X_WT.rotation.matrix[:, 2]
        return TablePlane(normal, float(normal @ self.X_WT.position))

    @property
    def given(self) -> Pose:
        """The poses (V,) of the cameras in T as they were reported."""
        return self.X_WT.inverse() @ self.views.X_WC

    @property
    def pixel(self) -> float:
        """Width of a pixel at the object [m]."""
        return self.distance / self.views.intrinsics.fx

    @property
    def sigma(self) -> float:
        """Standard deviation of depth at the object [m]."""
        return self.noise * self.distance**2

    @property
    def images(self) -> Images:
        """The images with the cameras where they now are."""
        return Images(self.views.depth, self.views.depth_unit, self.views.intrinsics.vector, self.R, self.p)

    @property
    def enough(self) -> int:
        """How many views must agree before something is believed: all of two, and two where few places show in more."""
        return min(LEAST_VIEWS if len(self.R) >= _SHOW * LEAST_VIEWS else LEAST_VIEWS - 1, len(self.R))

    def sampled(self, pixels: int) -> Array:
        """Return about so many even pixels as points (N, 5): x, y, z in T, depth [m] and number of the view."""
        return np.asarray(sampled(self.images, stride_of(self.views.depth, pixels)))

    def sampled_rgb(self, pixels: int) -> Array:
        """Return the colours (N, 3) of those pixels, 0..255, of views that have colour."""
        stride = stride_of(self.views.depth, pixels)
        every = (slice(None), slice(stride // 2, None, stride), slice(stride // 2, None, stride))
        return np.asarray(self.views.rgb)[every][self.views.depth[every] > 0].astype(float)

    def seen_empty(self, points: Array) -> Any:
        """Return past which of points (N, 3) enough views see."""
        return self.emptiness(points) == 1

    def emptiness(self, points: Array) -> Array:
        """Return how surely points (N, 3) lie outside the object (N,): 1 where enough views see past them.

        `OUTER` where most views have the surface that they measure there behind them; 0 where it is before them, and
        where nothing is measured.
        """
        past, outer = sight_lines.seen_past(self.images, points, 0.0, self.noise, LEAST_VIEWS).T
        return np.where(past >= self.enough, 1.0, np.where(outer > 0, OUTER, 0.0))

    def sights(self, points: Array) -> Array:
        """Return how many views see past each of points (N, 3), and how many measure something there: (N, 2)."""
        return np.asarray(sight_lines.sights(self.images, points, self.noise))

    def held(self, points: Array) -> Array:
        """Return how many images hold each of points (N, 3), and how densely their pixels lie there [1/m^2]: (N, 2)."""
        return np.asarray(held(self.images, points))

    def keep(self, rows: Any) -> None:
        """Leave out all views but those of `rows`."""
        if len(rows) < len(self.R):
            self.views, self.R, self.p = self.views.chosen(rows), self.R[rows], self.p[rows]


def scene_of(views: Views) -> Scene:
    """Return the images in the table's frame."""
    R, p = views.X_WC.rotation.matrix, views.X_WC.position
    images = Images(views.depth, views.depth_unit, views.intrinsics.vector, R, p)
    points = sampled(images, stride_of(views.depth, _SAMPLES))
    looks = looked_at(R, p)
    distance = float(np.median(np.linalg.norm(p - looks, axis=1)))
    try:
        if views.table is None:
            stated, (table, step) = None, table_over_floor(points[:, :3], p, looks, distance)
        else:
            stated = table_of(points[:, :3], p, distance, views.table)
            table, step = leveller(points[:, :3], p, distance, stated)
    except CannotAnswer as error:
        raise CannotAnswer(f"{error} {advice(views)}") from None
    X_WT = table_frame(table, looks)
    noise = table_noise(points, X_WT.inverse().apply(points[:, :3]), distance, views.depth_unit, len(views))
    X_TC = X_WT.inverse() @ views.X_WC
    R, p = np.ascontiguousarray(X_TC.rotation.matrix), np.ascontiguousarray(X_TC.position)
    return Scene(views, X_WT, R.copy(), p.copy(), distance, noise, stated, floor=-step / 2)
