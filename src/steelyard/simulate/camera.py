"""A wrist camera: its intrinsics, the arc it moves along, and the noise of its depth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from steelyard.check import Array
from steelyard.shape.views import Intrinsics
from steelyard.spatial import Pose, Rotation, unit_vectors

# Depth aligned to colour at 640 x 480, as the D435's own calibration gives it, rounded.
D435 = Intrinsics(640, 480, 615.0, 615.0, 320.0, 240.0)
VIEWS = 127  # the paper's scan
SWEEP = 330.0  # angle around the target that a pass covers [deg]
ELEVATIONS = (25.0, 45.0, 70.0)  # of the passes above the horizontal [deg]


@dataclass(frozen=True)
class DepthNoise:
    """How a stereo depth camera errs.

    subpixel   standard deviation of the disparity [pixels of the pair]; depth errs by z^2 subpixel / (focal base)
    focal      of the stereo pair [pixels]
    base       distance of the stereo pair [m]
    edge       share of pixels at depth edges that are lost; half as many more fly between both depths
    grazing    cosine of incidence below which pixels are more often lost than not
    speckle    share of pixels lost anywhere
    rgb        standard deviation of colour [levels]

    Errors of neighbouring pixels are correlated, since matching windows overlap.
    """

    subpixel: float = 0.08
    focal: float = 385.0
    base: float = 0.05
    edge: float = 0.5
    grazing: float = 0.17
    speckle: float = 0.005
    rgb: float = 3.0

    @property
    def per_square(self) -> float:
        """Standard deviation of depth at 1 m [m]; it grows with the square of the distance."""
        return self.subpixel / (self.focal * self.base)


def wrist_arc(
    target: Array,
    distance: float,
    count: int = VIEWS,
    *,
    start: float = 0.0,
) -> Pose:
    """Return camera poses X_WC (count,) that look at `target` (3,) [m]: to and fro around it, each pass higher up.

    distance  from the target [m]
    start     azimuth where the first pass begins [deg]
    """
    along = np.linspace(0, len(ELEVATIONS), count, endpoint=False)
    leg = along.astype(int)
    part = along - leg
    part = np.where(leg % 2, 1 - part, part)
    azimuth = np.radians(start + SWEEP * part)
    elevation = np.radians(np.array(ELEVATIONS)[leg] + 6 * np.sin(4 * azimuth))  # an arm does not draw circles
    out = np.stack([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)], 1)
    return looking(target + distance * out, target)


def looking(eye: Array, target: Array) -> Pose:
    """Return the poses (V,) of cameras at `eye` (V, 3) that look at `target` (3,), the top of the image upward."""
    forward = unit_vectors(target - eye)
    up = np.where(np.abs(forward[:, 2:]) > 0.999, [0.0, 1.0, 0.0], [0.0, 0.0, 1.0])
    right = unit_vectors(np.cross(forward, up))
    return Pose(Rotation.nearest(np.stack([right, np.cross(forward, right), forward], axis=2)), eye)


def disturbed(X_WC: Pose, std_mm: float, std_deg: float, rng: np.random.Generator) -> Pose:
    """Return poses as a robot would report them: each off by its own small rotation and shift about the camera."""
    n = X_WC.batch
    return X_WC @ Pose(
        Rotation.exp(np.radians(std_deg) * rng.normal(size=(*n, 3))), 1e-3 * std_mm * rng.normal(size=(*n, 3))
    )
