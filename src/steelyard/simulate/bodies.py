"""Bodies with a known answer: unions of homogeneous boxes whose edges are parallel to the axes of S."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from steelyard import check
from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.inertia import InertialParameters, solids
from steelyard.spatial import Pose, Rotation


@dataclass(frozen=True, eq=False)
class BoxUnion:
    """Boxes with edges `size` (K, 3) [m], centres `centre` (K, 3) [m] in S and `density` (K,) [kg/m^3].

    Where boxes overlap both count, so that the masses simply add.
    """

    size: Array
    centre: Array
    density: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "size", check.vectors("box sizes", self.size))
        object.__setattr__(self, "centre", check.vectors("box centres", self.centre))
        object.__setattr__(self, "density", check.vectors("box densities", self.density, len(self.size)))
        if self.size.shape != self.centre.shape or self.size.ndim != 2 or not len(self.size):
            raise BadValue(f"box sizes and centres must both be (K, 3); got {self.size.shape}, {self.centre.shape}.")

    def parameters(self) -> InertialParameters:
        """Return the ten parameters about the origin of S."""
        total = InertialParameters(np.zeros(10))
        for size, centre, density in zip(self.size, self.centre, self.density, strict=True):
            box = solids.box(float(size[0]), float(size[1]), float(size[2]), float(density))
            total = total + box.in_frame(Pose(Rotation.identity(), centre))
        return total

    def bounds(self) -> Array:
        """Return the lower and upper corner (2, 3) [m] of the bounding box in S."""
        return np.stack([(self.centre - self.size / 2).min(0), (self.centre + self.size / 2).max(0)])
