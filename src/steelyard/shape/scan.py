"""From posed RGB-D views to one coloured, oriented cloud of the object on the table."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from steelyard.check import Array
from steelyard.findings import Finding
from steelyard.shape import sight_lines
from steelyard.shape.cloud import Cloud
from steelyard.shape.registration import agreed
from steelyard.shape.scene import LEAST_VIEWS, WINDOW, Scene, object_on_table, scene_of, surface_of, surfels
from steelyard.shape.thinning import in_cubes, spread, spread_to
from steelyard.shape.underside import Underside, closed_below
from steelyard.shape.views import TablePlane, Views

POINTS = 3000  # of the cloud, about
_CELLS = 8000  # of the grid under the object, about
_WRONG = 2.5  # times the depth noise: views that spread more are wrong in something else than their noise


@dataclass(frozen=True, eq=False)
class Scan:
    """What views say of an object on a table.

    cloud      points of its surface in W with colours and normals, underside closed
    spacing    least distance of two points [m]
    table      plane that it lies on, in W
    seen       points of the cloud that cameras saw; the rest close the underside
    views      how many were fused
    noise_std  depth noise at the object's distance, found on the table [m]
    disagree   spread of the views about the surface, in depth noise: 1 where they agree
    moved_m    rms shift of the cameras by registration, None where the poses were good enough
    findings   what you must know
    stages     CPU time of each step [s]
    empty      whether points (N, 3) of W are known to be outside the object
    """

    cloud: Cloud
    spacing: float
    table: TablePlane
    seen: int
    views: int
    noise_std: float
    disagree: float
    moved_m: float | None
    findings: tuple[Finding, ...]
    stages: dict[str, float]
    empty: Callable[[Array], Any] = field(repr=False)


def fuse(views: Views, points: int = POINTS) -> Scan:
    """Return the object that lies on the table as one cloud of about `points` points.

    Raises CannotAnswer where no table or no object on it is found.
    """
    clock = _Clock()
    scene, table = scene_of(views)
    clock.lap("table")
    mask, low, pitch, others = object_on_table(scene)
    clock.lap("object")
    patches = surfels(scene, mask, low, pitch)
    clock.lap("surfels")
    patches, disagree, shift = agreed(scene, patches, mask, low, pitch)
    clock.lap("registration")
    xyz, normal = surface_of(scene, patches, mask, low, pitch, points)
    clock.lap("surface")
    xyz, normal, seen, spacing, bottom = _closed(scene, xyz, normal, points)
    clock.lap("underside")
    rgb = _colours(scene, xyz, normal, seen)
    clock.lap("colour")
    cloud = Cloud(xyz, rgb, None, normal).in_frame(scene.X_WT)
    findings = _findings(scene, others, disagree)
    return Scan(
        cloud=cloud, spacing=spacing, table=table, seen=seen, views=len(views), noise_std=scene.sigma,
        disagree=disagree, moved_m=shift, findings=findings, stages=clock.laps, empty=_empty(scene, bottom),
    )  # fmt: skip


class _Clock:
    def __init__(self) -> None:
        self.laps: dict[str, float] = {}
        self._last = time.thread_time()

    def lap(self, name: str) -> None:
        now = time.thread_time()
        self.laps[name] = now - self._last
        self._last = now


def _closed(scene: Scene, xyz: Array, normal: Array, points: int) -> tuple[Array, Array, int, float, Underside]:
    """Return about `points` points, normals, how many of them were seen (first), their distance and the underside."""
    area = len(spread(xyz, normal, np.arange(len(xyz)), 3 * scene.pixel)) * (3 * scene.pixel) ** 2
    bottom = closed_below(scene, xyz, normal, max(1.5 * scene.pixel, float(np.sqrt(area / _CELLS))))
    below, down = bottom.points()
    xyz, normal, seen = np.concatenate([xyz, below]), np.concatenate([normal, down]), len(xyz)
    rows, radius = spread_to(xyz, normal, np.arange(len(xyz)), points, scene.pixel)
    rows = np.sort(rows)
    return xyz[rows], normal[rows], int((rows < seen).sum()), radius, bottom


def _colours(scene: Scene, xyz: Array, normal: Array, seen: int) -> Any:
    """Return colours (N, 3): of the first `seen` points from the views, of the rest from the nearest seen point."""
    if scene.views.rgb is None:
        return None
    rgb = sight_lines.colours(scene.views.rgb, *scene.images(), xyz[:seen], normal[:seen], WINDOW, scene.noise)
    return np.concatenate([rgb, rgb[cKDTree(xyz[:seen]).query(xyz[seen:])[1]]]) if seen < len(xyz) else rgb


def _empty(scene: Scene, bottom: Underside) -> Callable[[Array], Any]:
    back = scene.X_WT.inverse()

    def empty(points: Array) -> Any:
        at = back.apply(points)
        found = np.asarray(bottom.below(at))
        rows = np.flatnonzero(~found)
        rows = rows[in_cubes(at[rows], 8 * scene.pixel)] if len(rows) else rows
        past = sight_lines.seen_past(*scene.images(), at[rows], 0.0, scene.noise, LEAST_VIEWS)
        found[rows] = past >= min(LEAST_VIEWS, len(scene.R))
        return found

    return empty


def _findings(scene: Scene, others: int, disagree: float) -> tuple[Finding, ...]:
    found = []
    if others:
        found.append(
            Finding.of(
                "several-objects",
                f"{others + 1} separate objects stand on the table where the cameras look; the largest was kept.",
            )
        )
    if disagree > _WRONG:
        found.append(
            Finding.of(
                "views-disagree",
                f"The views of one surface spread {disagree:.1f} times as far as the depth noise of "
                f"{1e3 * scene.sigma:.2g} mm, even where moving the cameras was tried; expected below {_WRONG:g}.",
            )
        )
    return tuple(found)
