"""Parts: the homogeneous parts of one object, each known up to its density.

With the shape known, the ten parameters of a homogeneous part are its volume moments times its density, and those of
the object are linear in the masses of its parts: phi = B m.
Source: "The Sum of Its Parts", eq. 1-5.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from steelyard import check
from steelyard.check import Array, Integers
from steelyard.errors import BadValue
from steelyard.inertia import InertialParameters
from steelyard.parts.interior import Interior
from steelyard.spatial import Pose


@dataclass(frozen=True, eq=False)
class Parts:
    """P homogeneous parts in one frame.

    label    (P,) number of each part
    moments  (P, 10) the ten parameters of each part at a density of 1 kg/m^3: volume [m^3], first and second moments
    rgb      (P, 3) mean colour 0..255, None where it is not known
    interior where their volume is, None where only the moments are known
    com_std, stretch, turn_std   standard deviations of what the shape gives, where it says so itself (a scan): of the
             centre of mass per axis [m], of the second moments as a share of each, and of the turn of the whole about
             each axis [rad]; see `ShapeError`
    """

    label: Integers
    moments: Array
    rgb: Array | None = None
    interior: Interior | None = None
    com_std: float = 0.0
    stretch: float = 0.0
    turn_std: float = 0.0

    def __post_init__(self) -> None:
        moments = check.vectors("part moments", self.moments, 10)
        label = check.whole("part labels", self.label)
        if moments.ndim != 2 or label.shape != moments.shape[:1]:
            raise BadValue(
                f"parts need one label and ten moments each; got labels {label.shape} and moments {moments.shape}."
            )
        if not len(label):
            raise BadValue("an object needs at least one part; got none.")
        if len(np.unique(label)) < len(label):
            raise BadValue(f"part labels must differ; got {label.tolist()}.")
        if (moments[:, 0] <= 0).any():
            worst = int(np.argmin(moments[:, 0]))
            raise BadValue(
                f"part {label[worst]} has a volume of {moments[worst, 0]:.3g} m^3; volumes must be above zero. "
                "Check that its surface is closed and its triangles face outward."
            )
        object.__setattr__(self, "label", label)
        object.__setattr__(self, "moments", moments)
        if self.rgb is not None:
            object.__setattr__(self, "rgb", check.vectors("part colours", self.rgb))
        unsure = (self.com_std, self.stretch, self.turn_std)
        if not all(0 <= std < np.inf for std in unsure):
            raise BadValue(f"standard deviations of a shape must not be negative; got {', '.join(map(str, unsure))}.")

    def __len__(self) -> int:
        return len(self.label)

    @property
    def volume(self) -> Array:
        """Volume (P,) [m^3]."""
        return check.frozen(self.moments[:, 0])

    @property
    def centroid(self) -> Array:
        """Centroid (P, 3) [m]."""
        return np.asarray(self.moments[:, 1:4] / self.moments[:, :1])

    @property
    def per_mass(self) -> Array:
        """B (10, P): the ten parameters of each part per kilogram of it."""
        return np.asarray((self.moments / self.moments[:, :1]).T)

    def whole(self, masses: Array) -> InertialParameters:
        """Return the object whose parts have `masses` (..., P) [kg]."""
        return InertialParameters(np.asarray(masses) @ self.per_mass.T)

    def uniform(self, mass: float = 1.0) -> InertialParameters:
        """Return the object of `mass` [kg] whose parts have one density."""
        return self.whole(self.volume * (mass / self.volume.sum()))

    def in_frame(self, X_AB: Pose) -> Parts:
        """Return the same parts, given in B, seen from frame A."""
        interior = None if self.interior is None else self.interior.in_frame(X_AB)
        return replace(self, moments=InertialParameters(self.moments).in_frame(X_AB).vector, interior=interior)

    def merged(self, groups: Sequence[Sequence[int]]) -> Parts:
        """Return parts joined: each group is a list of indices; it takes the label of its first part."""
        rows = [list(g) for g in groups]
        if sorted(i for g in rows for i in g) != list(range(len(self))):
            raise BadValue(f"groups must hold every part 0..{len(self) - 1} once; got {rows}.")
        moments = np.stack([self.moments[g].sum(0) for g in rows])
        rgb = None
        if self.rgb is not None:
            rgb = np.stack([np.average(self.rgb[g], axis=0, weights=self.volume[g]) for g in rows])
        interior = None if self.interior is None else self.interior.merged(rows)
        return replace(self, label=self.label[[g[0] for g in rows]], moments=moments, rgb=rgb, interior=interior)
