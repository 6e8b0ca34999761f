"""Coloured points of a visible surface."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from steelyard import check
from steelyard.check import Array, Integers, Mask
from steelyard.errors import BadValue
from steelyard.shape.eight_bits import Colours, eight_bits
from steelyard.shape.known_space import Kept
from steelyard.shape.points.spacing import Neighbours
from steelyard.spatial import Pose

# Normals this near to unit vectors are left as they are.
_ONE = 1e-3


@dataclass(frozen=True, eq=False)
class Cloud:
    """N points of the visible surface in one frame.

    xyz      (N, 3) [m]
    rgb      (N, 3) uint8, None where colours are not known; given as floats 0..1 or numbers 0..255
    label    (N,) label of the true part that each point lies on, None where it is not known
    normals  (N, 3) unit vectors that leave the solid, None where they are not known
    seen     (N,) whether a camera saw the colour of each point; the rest have that of the nearest that one saw.
             Without colours, whether one saw the point. None where all were seen
    left_out how many further points were given without a finite place or normal
    kept     what the scan said that the cloud was written by; None where it comes from elsewhere
    """

    xyz: Array
    rgb: Colours | None = None
    label: Integers | None = None
    normals: Array | None = None
    seen: Mask | None = None
    left_out: int = field(default=0, kw_only=True)
    kept: Kept | None = field(default=None, kw_only=True, repr=False)

    def __post_init__(self) -> None:
        xyz = check.vectors("points", self.xyz)
        if xyz.ndim != 2 or not len(xyz):
            raise BadValue(f"a cloud needs points (N, 3), N > 0; got {xyz.shape}.")
        object.__setattr__(self, "xyz", xyz)
        if self.rgb is not None:
            object.__setattr__(self, "rgb", _column("colours", eight_bits(self.rgb), xyz.shape, np.uint8))
        if self.label is not None:
            label = check.whole("labels", self.label)
            object.__setattr__(self, "label", _column("labels", label, xyz.shape[:1], np.int64))
        if self.normals is not None:
            object.__setattr__(self, "normals", _unit(_column("normals", self.normals, xyz.shape, np.float64)))
        if self.seen is not None:
            object.__setattr__(self, "seen", _column("marks of what was seen", self.seen, xyz.shape[:1], np.bool_))

    def __len__(self) -> int:
        return len(self.xyz)

    @property
    def labels(self) -> Integers:
        """The label (N,) of each point; raises BadValue where the cloud has none."""
        if self.label is None:
            raise BadValue("this needs a cloud whose points carry the label of their part; it has none.")
        return self.label

    @property
    def diagonal(self) -> float:
        """Diagonal of the box around the points along the axes of their frame [m]."""
        return float(np.linalg.norm(np.ptp(self.xyz, axis=0)))

    @cached_property
    def near(self) -> Neighbours:
        """The nearest other points of each point [m]."""
        return Neighbours.of(self.xyz)

    def reordered(self, order: Integers) -> Cloud:
        """Return the same points in an order (N,) of all."""
        return self.chosen(order)._near_as(self.near.reordered(order))

    def chosen(self, rows: Any) -> Cloud:
        """Return the points of `rows`, numbers or a mask."""
        columns = (self.rgb, self.label, self.normals, self.seen)
        return Cloud(self.xyz[rows], *(None if column is None else column[rows] for column in columns))

    def in_frame(self, X_AB: Pose) -> Cloud:
        """Return the same points, given in B, seen from frame A."""
        normals = None if self.normals is None else X_AB.rotation.apply(self.normals)
        return replace(self, xyz=X_AB.apply(self.xyz), normals=normals)._near_as(vars(self).get("near"))

    def with_normals(self, normals: Array | None) -> Cloud:
        """Return the same points with other normals (N, 3), or with none."""
        return replace(self, normals=normals)._near_as(vars(self).get("near"))

    def _near_as(self, near: Neighbours | None) -> Cloud:
        """Return this cloud, which need not look for its neighbours any more where they are known."""
        if near is not None:
            vars(self)["near"] = near  # where the cached property keeps it
        return self


def _column(name: str, values: Any, shape: tuple[int, ...], dtype: type) -> Any:
    array: Any = np.array(values, dtype=dtype)
    if array.shape != shape:
        raise BadValue(f"a cloud of {shape[0]} points needs {name} of shape {shape}; got {array.shape}.")
    array.flags.writeable = False
    return array


def _unit(normals: Array) -> Array | None:
    """Return normals (N, 3) of length one; None, as if there were none, where any is zero or not a number."""
    length = np.linalg.norm(normals, axis=1)
    if not (np.isfinite(length).all() and (length > 0).all()):
        return None
    if np.abs(length - 1).max() < _ONE:
        return normals
    return check.frozen(normals / length[:, None])
