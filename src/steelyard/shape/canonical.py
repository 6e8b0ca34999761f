"""A frame and an order that belong to the points themselves, so that no answer hangs on how they were given."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array, Integers
from steelyard.spatial import Pose, Rotation


def canonical(xyz: Array) -> tuple[Pose, Integers]:
    """Return the pose X_CB of the frame B of points (N, 3) in a frame C of their own, and their order (N,) along it.

    C has its origin at their mean and its axes along their spread, longest first, each toward the longer tail. Bodies
    of revolution and the like have no frame of their own: for those it is one of the possible ones.
    """
    mean = xyz.mean(0)
    about = xyz - mean
    axes = np.linalg.eigh(about.T @ about)[1][:, ::-1]
    along = about @ axes
    axes = axes * np.where((along**3).sum(0) < 0, -1.0, 1.0)
    axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])
    R = Rotation.nearest(axes.T)
    X_CB = Pose(R, -R.apply(mean))
    x, y, z = X_CB.apply(xyz).T
    return X_CB, np.lexsort((z, y, x))
