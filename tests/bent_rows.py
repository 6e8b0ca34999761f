"""A bent row of equal boxes: parts whose masses a log can tell apart."""

from __future__ import annotations

import numpy as np

from steelyard.inertia.solids import box
from steelyard.parts.parts import Parts
from steelyard.spatial import Pose, Rotation


def bent_row(count: int) -> Parts:
    """Return `count` boxes of 40 x 20 x 30 mm in a row along x, every other one shifted."""
    places = [np.array([0.04 * k + 0.05, 0.02 * (k % 2), 0.01 * (k % 3)]) for k in range(count)]
    one = box(0.04, 0.02, 0.03, 1.0)
    return Parts(np.arange(count), np.array([one.in_frame(Pose(Rotation.identity(), at)).vector for at in places]))
