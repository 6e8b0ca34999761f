"""How far the views of a scene are apart once they were moved."""

from __future__ import annotations

import numpy as np

from steelyard.shape.scans.scene import Scene
from steelyard.spatial import Pose, Rotation


def apart(scene: Scene, true: Pose) -> float:
    """Return how far the views have what lies under the cameras apart, rms [m]."""
    error = Pose(Rotation.nearest(scene.R), scene.p) @ (scene.X_WT.inverse() @ true).inverse()
    return float(np.sqrt(error.apply(np.zeros(3)).var(0).sum()))
