"""By what factor the positions of cameras are too small: those found from images alone have a scale of their own.

Each view measures how far the camera is above the table. Between two views that differs by as much as the heights of
the cameras along the table's normal do, once these are metres.
"""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.shape.scans.depth_images import Images, sampled, stride_of
from steelyard.shape.scans.table_plane import NEAR, largest_plane
from steelyard.shape.views import Views

_VIEWS, _FEW = 40, 3  # views that are asked, and how many must show a plane
_SAMPLES = 10_000  # pixels of each


def pose_scale(views: Views) -> float | None:
    """Return the factor that makes the positions metres, by depth; None where the views do not tell."""
    asked = np.unique(np.linspace(0, len(views) - 1, min(len(views), _VIEWS)).astype(int))
    planes = {int(k): plane for k in asked if (plane := _plane(views, int(k))) is not None}
    if len(planes) < _FEW:
        return None
    seen = np.array(list(planes.values()))
    X_WC = views.X_WC[list(planes)]
    normal = np.median(np.einsum("vij,vj->vi", X_WC.rotation.matrix, seen[:, :3]), 0)
    one, other = np.triu_indices(len(seen), 1)
    height = X_WC.position @ normal
    step, apart = height[one] - height[other], seen[one, 3] - seen[other, 3]
    clear = np.abs(step) >= max(float(np.median(np.abs(step))), 1e-9)
    scale = float(np.linalg.norm(normal) * np.median(apart[clear] / step[clear])) if clear.any() else 0.0
    return scale if scale > 0 else None


def _plane(views: Views, k: int) -> Array | None:
    """Return the normal of the plane that most of a view lies on, in the camera's axes, and its distance [m]."""
    depth, eye = views.depth[k : k + 1], np.zeros((1, 3))
    images = Images(depth, views.depth_unit, views.intrinsics.vector, np.eye(3)[None], eye)
    points = sampled(images, stride_of(depth, _SAMPLES))
    if len(points) < _FEW:
        return None
    with suppress(CannotAnswer):
        plane = largest_plane(points[:, :3], eye, NEAR * float(np.median(points[:, 3])))
        return np.append(plane.normal, -plane.offset)
    return None
