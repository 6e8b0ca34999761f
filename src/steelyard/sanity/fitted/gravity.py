"""The direction of gravity in W as the wrench and the motion show it: a base that is not level."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadValue, CannotAnswer
from steelyard.logs.alignment import Aligned
from steelyard.logs.log import MotionLog
from steelyard.sanity.fitted.full_fit import Rows
from steelyard.sanity.words import direction_words
from steelyard.spatial import Rotation

_ROUNDS, _FEWEST_ROWS = 4, 8
# A tilt is told where a body of another mass and a bias leave this share of what it does: turns about one axis alone
# leave nothing of the tilt that makes the weight across that axis larger. What is told badly has wide bars.
TOLD = 1e-3


@dataclass(frozen=True, eq=False)
class FittedGravity:
    """The direction of gravity that fits best.

    gravity    (3,) [m/s^2] in W
    angle      [rad] to that given, and its standard deviation
    left       residual variance, as a share of that with gravity as given
    slowly     the same of means over a second, which hold hardly any white noise
    tilts      (k, 3) [rad] turns in W of one standard deviation each, independent of one another: two where the log
               tells the direction, one where it tells one angle only
    """

    gravity: Array
    angle: float
    angle_std: float
    left: float
    slowly: float
    tilts: Array

    @property
    def within(self) -> Array:
        """Gravity (k, 3) as it would be one standard deviation off."""
        return Rotation.exp(self.tilts).apply(self.gravity)

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
        tilts = _across(found)
        columns = rows.tilting(phi, R, found) @ tilts
        told = rows.told(columns, TOLD)
        if not told.size:
            return None
        axes = tilts @ told
        fit = rows.solve(columns @ told, jackknife=True)
        turn, spread = axes @ fit.extra, np.abs(axes) @ fit.extra_std
        found, phi = Rotation.exp(turn).apply(found), fit.phi
        if np.linalg.norm(turn) < 1e-4:
            break
    variance, own = np.linalg.eigh(fit.extra_covariance)
    tilts = (axes @ own * np.sqrt(np.maximum(variance, 0))).T
    angle = float(np.arccos(np.clip(found @ gravity / (gravity @ gravity), -1, 1)))
    slowly = rows.slowly(fit, columns @ told) / max(given.slowly(level), 1e-300)
    return FittedGravity(found, angle, float(np.linalg.norm(spread)), fit.beside(level), slowly, tilts)


def levelled(log: MotionLog, rotation: Array, gravity: Array, acceleration_from: str) -> MotionLog:
    """Return the log for gravity (3,) [m/s^2] in W; what an accelerometer read as a - g stays as it was read."""
    turned = np.einsum("nji,j->ni", rotation, gravity)
    if acceleration_from != "specific_force":
        return replace(log, gravity=turned)
    return replace(log, gravity=turned, acceleration=log.acceleration - log.gravity + turned)


def as_levelled(aligned: Aligned, gravity: Array) -> tuple[Aligned, FittedGravity]:
    """Return the log for the direction of gravity that it shows itself, and that; `gravity` (3,) as it was given.

    Raises BadValue without rotations, CannotAnswer where the log does not show it.
    """
    if aligned.rotation is None:
        raise BadValue('gravity "unknown" needs the rotation of the sensor; the log has none. Add a rotation stream.')
    rotation = aligned.rotation.matrix
    found = fitted_gravity(aligned.log, rotation, gravity, aligned.acceleration_from)
    if found is None or len(found.tilts) < 2:
        raise CannotAnswer("The log does not show the direction of gravity: turn the sensor about two different axes.")
    log = levelled(aligned.log, rotation, found.gravity, aligned.acceleration_from)
    return replace(aligned, log=log), found


def _across(gravity: Array) -> Array:
    """Return the two axes (3, 2) about which a turn tilts gravity (3,): those across it."""
    return np.asarray(np.linalg.svd(gravity[None])[2][1:].T)
