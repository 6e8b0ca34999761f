"""Posed RGB-D images: what a camera at the wrist saw, and from where."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from steelyard import check
from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.shape.eight_bits import Colours
from steelyard.spatial import Pose

Depths = np.ndarray[Any, np.dtype[np.uint16]]

FARTHEST = 10.0  # a table-top camera looks at nothing beyond this [m]
NEAREST = 0.02  # nor nearer than this
_WIDEST = 20.0  # focal length, in image widths, beyond which no lens is meant


@dataclass(frozen=True)
class Intrinsics:
    """A pinhole camera without distortion: pixel (u, v) looks along ((u - cx)/fx, (v - cy)/fy, 1).

    width, height  of the images [pixels]
    fx, fy         focal lengths [pixels]
    cx, cy         principal point [pixels], pixel centres at whole numbers
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float

    def __post_init__(self) -> None:
        if self.width < 8 or self.height < 8:
            raise BadValue(f"images must be at least 8 x 8 pixels; the camera has {self.width} x {self.height}.")
        for name, value in (("fx", self.fx), ("fy", self.fy)):
            if not 0 < value < _WIDEST * self.width:
                raise BadValue(
                    f"the camera's {name} must be a focal length in pixels, between 0 and {_WIDEST * self.width:g}; "
                    f"got {value:g}."
                )
        for name, value, size in (("cx", self.cx, self.width), ("cy", self.cy, self.height)):
            if not -0.5 <= value <= size - 0.5:
                raise BadValue(
                    f"the camera's {name} must lie inside the image, 0..{size - 1}; got {value:g}. "
                    "Give the intrinsics of images of this size."
                )

    @property
    def vector(self) -> Array:
        """fx, fy, cx, cy (4,) [pixels]."""
        return np.array([self.fx, self.fy, self.cx, self.cy])


@dataclass(frozen=True)
class TablePlane:
    """The plane n . p = offset that objects lie on, in W.

    normal  (3,) unit vector away from the table, toward the cameras
    offset  [m]
    """

    normal: Array
    offset: float

    def __post_init__(self) -> None:
        normal = check.vectors("the table's normal", self.normal)
        length = float(np.linalg.norm(normal))
        if normal.shape != (3,) or abs(length - 1) > 1e-3:
            raise BadValue(f"the table's normal must be one unit vector of 3 numbers; its length is {length:.4g}.")
        if not np.isfinite(self.offset):
            raise BadValue(f"the table's offset must be a finite length in metres; got {self.offset}.")
        object.__setattr__(self, "normal", check.frozen(normal / length))

    def height(self, points: Array) -> Array:
        """Return how far points (..., 3) lie above the plane (...) [m]."""
        return np.asarray(points @ self.normal - self.offset)


@dataclass(frozen=True, eq=False)
class Views:
    """V posed RGB-D images of one camera.

    depth       (V, H, W) uint16, 0 where nothing was measured; along the optical axis
    rgb         (V, H, W, 3) uint8, None without colour
    intrinsics  of depth and colour alike
    X_WC        poses (V,) of the camera (optical: x right, y down, z forward) in W
    depth_unit  one step of `depth` [m]
    table       the plane the object lies on, None where it is to be found
    names       of the views, () where they have none
    """

    depth: Depths
    rgb: Colours | None
    intrinsics: Intrinsics
    X_WC: Pose
    depth_unit: float = 0.001
    table: TablePlane | None = None
    names: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        size = (self.intrinsics.height, self.intrinsics.width)
        depth = np.ascontiguousarray(self.depth)
        if depth.ndim != 3 or not len(depth) or depth.shape[1:] != size:
            raise BadValue(f"depth images must have shape (V, {size[0]}, {size[1]}), V > 0; got {depth.shape}.")
        if depth.dtype != np.uint16:
            raise BadValue(f"depth must be uint16 in steps of the depth unit; got {depth.dtype}.")
        if self.X_WC.batch != depth.shape[:1]:
            raise BadValue(f"{len(depth)} views need as many poses; got batch {self.X_WC.batch}.")
        check.positive("the depth unit", self.depth_unit)
        object.__setattr__(self, "depth", depth)
        if self.rgb is not None:
            rgb = np.ascontiguousarray(self.rgb)
            if rgb.shape != (*depth.shape, 3) or rgb.dtype != np.uint8:
                raise BadValue(f"colour images must be uint8 {(*depth.shape, 3)}; got {rgb.dtype} {rgb.shape}.")
            object.__setattr__(self, "rgb", rgb)
        if self.names and len(self.names) != len(depth):
            raise BadValue(f"{len(depth)} views need as many names; got {len(self.names)}.")
        _require_depth(depth, self.depth_unit)

    def __len__(self) -> int:
        return len(self.depth)

    def chosen(self, rows: Sequence[int] | Any) -> Views:
        """Return some of the views, numbers or a mask."""
        rgb = None if self.rgb is None else self.rgb[rows]
        names = tuple(np.array(self.names)[rows].tolist()) if self.names else ()
        return replace(self, depth=self.depth[rows], rgb=rgb, X_WC=self.X_WC[rows], names=names)

    def posed(self, X_WC: Pose) -> Views:
        """Return the same images at other poses."""
        return replace(self, X_WC=X_WC)


def _require_depth(depth: Depths, unit: float) -> None:
    """Raise BadValue where nothing was measured, or at a distance that no table-top camera has."""
    some = depth[:, ::8, ::8]
    some = some[some > 0]
    if not len(some):
        raise BadValue(f"none of the {len(depth)} depth images holds a measured depth: all pixels looked at are 0.")
    middle = float(np.median(some)) * unit
    if not NEAREST <= middle <= FARTHEST:
        raise BadValue(
            f"the depth unit of {unit:g} m puts the scene {middle:.3g} m away (median), "
            f"expected {NEAREST:g} to {FARTHEST:g} m. Correct depth_unit_m: 0.001 is for depth in millimetres."
        )
