"""How sure a volume is whose views had to be moved until they agreed.

A surface lies where the views that measure it have it on average; so the volume goes with their steps, and is as sure
as these. Two sides of a sheet that no view shows together are held apart by little but the poses that were reported.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numba
import numpy as np
from scipy.spatial import cKDTree

from steelyard.check import Array
from steelyard.shape.scans.depth_images import Images
from steelyard.shape.scans.pose_errors import PoseErrors
from steelyard.shape.scans.view_steps import Sights, measured, weight_of

_NEIGHBOURS = 8
_SMOOTH = 0.9  # cosine with its neighbours' of a normal that is no edge's


def unsure_volume(sights: Sights, errors: PoseErrors, xyz: Array, normal: Array) -> float:
    """Return the standard deviation of the volume that poses leave open [m^3], by what is believed of them.

    xyz, normal  even points (N, 3) of all of the object's surface and their normals

    What ties views across an edge counts for nothing: normals there are of both its sides, and no view measures those.
    """
    area, _ = _surroundings(xyz, normal)
    slope = _slopes(sights.images, xyz, normal, area, sights.middle, sights.window, sights.noise)
    slope = (slope - slope.mean(0)).reshape(-1)  # the table goes along with all of them
    _, smooth = _surroundings(sights.xyz, sights.normal)
    H, _ = replace(sights, xyz=sights.xyz[smooth], normal=sights.normal[smooth]).together()
    H[np.diag_indices(len(H))] += 1.0
    return float(np.sqrt(slope @ np.linalg.solve(H + errors.information(), slope)))


def _surroundings(xyz: Array, normal: Array) -> tuple[Array, Array]:
    """Return how much surface [m^2] each of points (N, 3) stands for, and whether those about it all face as it does.

    What faces away, as the other side of a sheet does, is no surface of its side.
    """
    away, rows = cKDTree(xyz).query(xyz, np.arange(1, min(_NEIGHBOURS + 1, len(xyz)) + 1))
    cosine = np.einsum("nd,nkd->nk", normal, normal[rows])
    return np.pi * away[:, -1] ** 2 / (cosine > 0).sum(1), (cosine > _SMOOTH).all(1)


@numba.njit(cache=True, nogil=True)
def _slopes(images: Images, xyz: Any, normal: Any, area: Any, middle: Any, window: float, noise: float) -> Any:
    """Return how the volume under points that stand for areas (N,) changes with the steps (V, 6) of the views."""
    views = len(images.R)
    out, row, weight, heard = np.zeros((views, 6)), np.empty((views, 6)), np.empty(views), np.empty(views, np.bool_)
    for i in range(len(xyz)):
        total = 0.0
        for k in range(views):
            heard[k], over, sigma = measured(images, k, xyz[i], normal[i], row[k], middle, noise)
            heard[k] = heard[k] and abs(over) <= window
            if heard[k]:
                weight[k] = weight_of(over, sigma)
                total += weight[k]
        for k in range(views):
            if heard[k]:
                for r in range(6):
                    out[k, r] += area[i] * weight[k] / total * row[k, r]
    return out
