"""The direction of gravity in W as the wrench and the motion show it: a base that is not level."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array
from steelyard.logs.log import MotionLog
from steelyard.sanity.fitted.full_fit import Rows
from steelyard.sanity.words import direction_words
from steelyard.spatial import Rotation

_ROUNDS, _FEWEST_ROWS = 4, 8


@dataclass(frozen=True, eq=False)
class FittedGravity:
    """Gravity (3,) [m/s^2] in W that fits best, its angle to the given one with std [rad], residual variance left."""

    gravity: Array
    angle: float
    angle_std: float
    left: float

    @property
    def words(self) -> str:
        """Say how far and where to."""
        size = f"{np.degrees(self.angle):.1f} ± {np.degrees(self.angle_std):.1g} degrees"
        return f"{size} (along ({direction_words(self.gravity)}) of W)"


def fitted_gravity(log: MotionLog, rotation: Array, gravity: Array, acceleration_from: str) -> FittedGravity | None:
    """Return the gravity that fits best, None where the log shows nothing of it.

    rotation (N, 3, 3) S to W at the rows of the log; gravity (3,) [m/s^2] in W as it was used. The fit is linearised
    anew about each direction found. An accelerometer's a - g knows nothing of W: then gravity alone is compared.
    """
    if len(log) < _FEWEST_ROWS:
        return None
    if acceleration_from == "specific_force":
        log = replace(log, acceleration=np.zeros_like(log.acceleration))
    given, pick = Rows.of(log)
    R = rotation[pick]
    level = given.solve()
    found, phi = gravity, level.phi
    for _ in range(_ROUNDS):
        # The weights are kept.
        rows = replace(given, columns=Rows.columns_of(replace(given.log, gravity=np.swapaxes(R, 1, 2) @ found)))
        columns, axes = _visible(rows, rows.tilting(phi, R, found))
        if columns is None:
            return None
        fit = rows.solve(columns, jackknife=True)
        turn, spread = axes @ fit.extra, np.abs(axes) @ fit.extra_std
        found, phi = Rotation.exp(turn).apply(found), fit.phi
        if np.linalg.norm(turn) < 1e-4:
            break
    angle = float(np.arccos(np.clip(found @ gravity / (gravity @ gravity), -1, 1)))
    return FittedGravity(found, angle, float(np.linalg.norm(spread)), fit.beside(level))


def levelled(log: MotionLog, rotation: Array, gravity: Array, acceleration_from: str) -> MotionLog:
    """Return the log for gravity (3,) [m/s^2] in W; what an accelerometer read as a - g stays as it was read."""
    turned = np.einsum("nji,j->ni", rotation, gravity)
    if acceleration_from != "specific_force":
        return replace(log, gravity=turned)
    return replace(log, gravity=turned, acceleration=log.acceleration - log.gravity + turned)


def _visible(rows: Rows, columns: Array) -> tuple[Array | None, Array]:
    """Return tilt columns (N, 6, k) along the axes (3, k) that the log shows beside a free bias."""
    centred = (columns - columns.mean(0)) * np.sqrt(rows.weights)[:, :, None]
    scatter = np.einsum("nik,nil->kl", centred, centred)
    values, axes = np.linalg.eigh(scatter)
    kept = axes[:, values > 0.02 * max(float(values[-1]), 1e-12)]
    return (columns @ kept, kept) if kept.shape[1] else (None, kept)
