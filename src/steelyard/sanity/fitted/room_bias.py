"""Does the wrench have a bias that keeps its direction in the room, and how large is it?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from steelyard.check import Array
from steelyard.logs.log import MotionLog
from steelyard.sanity.fitted.full_fit import Rows
from steelyard.sanity.fitted.sensor_matrix import sensor_matrix
from steelyard.sanity.fitted.misplaced import misplaced

TOLD = 1e-3


@dataclass(frozen=True, eq=False)
class RoomSight:
    sure: float
    left: float
    slowly: float
    tilt: float
    tilt_slowly: float


def room_sight(log: MotionLog, rotation: Array, gravity: Array, drift: bool = False) -> RoomSight | None:
    rows, pick = Rows.of(log, drift)
    if not rows.split:
        return None
    R = rotation[pick]
    level = np.linalg.svd(gravity[None])[2][1:].T
    columns = np.zeros((len(R), 6, 5))
    columns[:, :3, :3] = np.swapaxes(R, 1, 2)
    columns[:, 3:, 3:] = np.swapaxes(R, 1, 2) @ level
    told = rows.told(columns, TOLD)
    once = rows.solve()
    if not told.size or not once.left:
        return None
    fit = rows.solve(columns @ told, jackknife=True)
    sure = float((np.abs(fit.extra) / np.maximum(fit.extra_std, 1e-300)).max())
    slow = rows.slowly(once)
    tilting = rows.tilting(once.phi, R, gravity) @ level
    tilt = rows.solve(tilting)
    return RoomSight(sure, fit.beside(once), rows.slowly(fit, columns @ told) / slow, tilt.beside(once), rows.slowly(tilt, tilting) / slow)
