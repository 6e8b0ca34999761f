"""Views that show no table, or do not agree: which single mistake of their description explains it.

Each usual mistake is undone in turn. One of them is named where most of what the cameras measured then lies on one
plane below them all; of views that are right nothing else does that, since a table seen from wrong poses falls apart.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from steelyard.errors import CannotAnswer
from steelyard.shape.scans.depth_images import Images, sampled, stride_of
from steelyard.shape.scans.pose_scale import pose_scale
from steelyard.shape.scans.table_plane import NEAR, largest_plane, looked_at
from steelyard.shape.views import FARTHEST, NEAREST, Intrinsics, Views
from steelyard.spatial import Pose, Rotation

_SAMPLES = 10_000  # points that judge a description
_MOST, _MORE = 0.5, 0.25  # of the points on one plane, and by how much more than as given: a mistake undone
# Depth units of cameras on the market, and of numbers in centimetres [m].
_UNITS = (0.001, 0.0001, 0.00025, 0.0002, 0.01)
# Images of the usual sizes, over the one that the intrinsics belong to.
_SIZES = (1 / 3, 0.5, 2 / 3, 1.5, 2.0, 3.0)
_ROLLS = (90, 180, -90)  # of the images against the axes of the poses [degrees]
_OPENGL = Rotation(np.diag([1.0, -1.0, -1.0]))
_BODY = Rotation(np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]))  # the optical axes seen from the body

_GENERAL = (
    "Move the camera so that more of the table is seen, or give table.json. Otherwise check that the poses are those "
    "of the camera in W, in metres, its axes x right, y down, z forward, each beside its image, and fx, fy, cx, cy and "
    "depth_unit_m in camera.json."
)


@dataclass(frozen=True, eq=False)
class _Given:
    """What says where the measured points are."""

    unit: float
    intrinsics: Intrinsics
    X_WC: Pose

    def turned(self, rotation: Rotation) -> _Given:
        return replace(self, X_WC=self.X_WC @ Pose(rotation, np.zeros(3)))

    def rotated(self, rotation: Rotation) -> _Given:
        return replace(self, X_WC=Pose(rotation, self.X_WC.position))

    def scaled(self, factor: float) -> _Given:
        return replace(self, X_WC=Pose(self.X_WC.rotation, factor * self.X_WC.position))

    def resized(self, factor: float) -> _Given:
        lens = self.intrinsics
        cx, cy = (lens.width - 1) / 2, (lens.height - 1) / 2
        return replace(self, intrinsics=replace(lens, fx=factor * lens.fx, fy=factor * lens.fy, cx=cx, cy=cy))


def _rolled(rotation: Rotation, by: int) -> Rotation:
    """Return the rotation whose quaternion has its numbers w, x, y, z moved on by so many places."""
    return Rotation.from_quaternion_wxyz(np.roll(rotation.quaternion_wxyz(), by, -1))


Mistake = tuple[str, str, Callable[[_Given], _Given]]
# What undoes it, what to do about it, and how it is undone.
_POSES: tuple[Mistake, ...] = (
    ("the quaternions read as x, y, z, w", "give them in the order qw, qx, qy, qz",
     lambda g: g.rotated(_rolled(g.X_WC.rotation, 1))),
    ("the columns qx, qy, qz, qw read as w, x, y, z", "name them qw, qx, qy, qz",
     lambda g: g.rotated(_rolled(g.X_WC.rotation, -1))),
    ("every pose inverted", "give the poses of the camera in W, not those of W in the camera",
     lambda g: replace(g, X_WC=g.X_WC.inverse())),
    ("every rotation inverted", "give the rotations from the camera's axes to those of W",
     lambda g: g.rotated(g.X_WC.rotation.inverse())),
    ("the camera's y and z turned round", "give poses of axes x right, y down, z forward, not those of OpenGL",
     lambda g: g.turned(_OPENGL)),
    ("x taken for the direction of sight", "give poses of axes x right, y down, z forward, not those of the body",
     lambda g: g.turned(_BODY)),
    ("x, y, z of the poses divided by 1000", "give them in metres", lambda g: g.scaled(0.001)),
    ("x, y, z of the poses divided by 100", "give them in metres", lambda g: g.scaled(0.01)),
    ("x, y, z of the poses times 1000", "give them in metres", lambda g: g.scaled(1000.0)),
)  # fmt: skip


def _of_roll(degrees: int) -> Mistake:
    undone = f"the images turned by {degrees} degrees"
    do = "give poses of axes x right, y down as the images are stored (is the camera mounted turned?)"
    return undone, do, lambda g: g.turned(Rotation.exp([0.0, 0.0, np.radians(degrees)]))


def _of_unit(unit: float) -> Mistake:
    return f'"depth_unit_m": {unit:g}', "correct it in camera.json", lambda g: replace(g, unit=unit)


def _of_size(factor: float) -> Mistake:
    undone = f"fx and fy times {factor:.3g} and cx, cy at the middle"
    return undone, "give the intrinsics of images of this size in camera.json", lambda g: g.resized(factor)


_MISTAKES = (*_POSES, *map(_of_roll, _ROLLS), *map(_of_unit, _UNITS), *map(_of_size, _SIZES))


def _of_scale(scale: float) -> Mistake:
    undone = f"x, y, z of the poses times {scale:.3g}"
    return undone, "give them in metres (poses from images alone have no scale)", lambda g: g.scaled(scale)


def _inverted_and_of_scale(scale: float) -> Mistake:
    undone = f"every pose inverted, and its x, y, z then times {scale:.3g}"
    do = "give the poses of the camera in W, in metres (COLMAP's are those of W in the camera, and have no scale)"
    return undone, do, lambda g: replace(g, X_WC=g.X_WC.inverse()).scaled(scale)


def likely_mistake(views: Views) -> str:
    """Return a sentence on the mistake in poses, depth unit or intrinsics that explains views; "" where none does."""
    given = _Given(views.depth_unit, views.intrinsics, views.X_WC)
    before = table_share(views, given)
    least = max(_MOST, before + _MORE)
    if said := _explained(views, given, _MISTAKES, before, least):
        return said
    inverted = views.posed(views.X_WC.inverse())
    scales = ((pose_scale(views), _of_scale), (pose_scale(inverted), _inverted_and_of_scale))
    mistakes = [mistake(scale) for scale, mistake in scales if scale]
    return _explained(views, given, mistakes, before, least) if mistakes else ""


def _explained(views: Views, given: _Given, mistakes: Sequence[Mistake], before: float, least: float) -> str:
    """Return a sentence on the one of `mistakes` that puts most points on a plane; "" where that is less than least."""
    shares = [table_share(views, undo(given)) for _, _, undo in mistakes]
    if max(shares) < least:
        return ""
    undone, do, _ = mistakes[int(np.argmax(shares))]
    return (
        f"With {undone}, {100 * max(shares):.0f} % of the measured points would lie on one plane instead of "
        f"{100 * before:.0f} %: {do}."
    )


def advice(views: Views) -> str:
    """Return what to do about views that show no table."""
    given = _Given(views.depth_unit, views.intrinsics, views.X_WC)
    if views.table is not None and (share := table_share(views, given)) > _MOST:
        return (
            f"Without table.json {100 * share:.0f} % would lie on one plane: give the one that the object itself "
            "stands on, as that of a stand, or leave it out."
        )
    return likely_mistake(views) or _GENERAL


def table_share(views: Views, given: _Given) -> float:
    """Return the share of the measured points on the plane that has most, all cameras above it; 0 without one."""
    R, p = given.X_WC.rotation.matrix, given.X_WC.position
    images = Images(views.depth, given.unit, given.intrinsics.vector, R, p)
    points = sampled(images, stride_of(views.depth, _SAMPLES))
    away = float(np.median(points[:, 3])) if len(points) else 0.0
    if not NEAREST <= away <= FARTHEST:
        return 0.0
    looks = looked_at(R, p)
    near = NEAR * min(away, float(np.median(np.linalg.norm(p - looks, axis=1))))
    try:
        plane = largest_plane(points[:, :3], p, near)
    except CannotAnswer:
        return 0.0
    return float((np.abs(plane.height(points[:, :3])) < near).mean())
