"""Mass and centre of mass of the payload from wrenches while it is held still.

Source: "Cooperative Payload Estimation by a Team of Mocobots", III-C, eq. 9-16.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from steelyard import check
from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.spatial import cross_matrix

# Least spread of the directions of gravity [rad]: below it the height of the centre of mass is not fixed.
LEAST_TILT = 1e-3
# What must still hold the payload up when wrists of known mass are taken out.
WITHOUT_WRISTS = "the forces, without the wrists' weight,"


@dataclass(frozen=True, eq=False)
class MassAndCom:
    """Mass [kg] and centre of mass (3,) [m] in R, with formal standard deviation and covariance (3, 3).

    residual_force, residual_moment  rms left per axis [N, N m]
    tilt     largest spread of gravity's directions about their mean [rad]: it decides how well the height is known
    samples  rows used
    """

    mass: float
    com: Array
    mass_std: float
    com_covariance: Array
    residual_force: float
    residual_moment: float
    tilt: float
    samples: int


def mass(gravity: Array, force: Array) -> tuple[float, float]:
    """Return the mass [kg] and its formal standard deviation from still rows (K, 3) (eq. 11-13).

    gravity  [m/s^2] and force [N], the sum over the team, both in R's axes
    """
    gravity = check.rows("gravity", gravity)
    force = check.rows("force", force, of=("gravity", gravity))
    size = np.linalg.norm(gravity, axis=1)
    lifted = -(gravity * force).sum(1) / size
    found = float((lifted * size).sum() / (size**2).sum())
    left = lifted - found * size
    return found, float(np.sqrt((left**2).sum() / max(len(left) - 1, 1) / (size**2).sum()))


def require_lift(mass_kg: float, forces: str) -> None:
    """Raise CannotAnswer where `forces` pull the payload down, or are none: no mass is negative."""
    if not mass_kg > 0:
        raise CannotAnswer(
            f"{forces} must hold the payload up; they add up to a mass of {mass_kg:.3g} kg. Check the sign of the "
            'forces: set wrench = "on-sensor" in [team] or a [[robot]] ("on-object" if that is "on-sensor"); and '
            "gravity in the home frames."
        )


def com(gravity: Array, moment: Array, mass_kg: float) -> tuple[Array, Array]:
    """Return the centre of mass (3,) [m] and its formal covariance from still rows (K, 3) (eq. 14-16).

    moment  about R's origin [N m], the sum over the team; at rest it is -m c x g, that is m [g]x c
    Raises CannotAnswer where gravity has one direction only: the height along it stays open.
    """
    gravity = check.rows("gravity", gravity)
    moment = check.rows("moment", moment, of=("gravity", gravity))
    stacked = mass_kg * cross_matrix(gravity)
    normal = np.einsum("kij,kil->jl", stacked, stacked)
    values, axes = np.linalg.eigh(normal)
    if not values[0] > (LEAST_TILT**2) * values[2]:
        along = ", ".join(f"{x:.2f}" for x in axes[:, 0])
        spread = np.sqrt(max(values[0], 0) / values[2])
        raise CannotAnswer(
            "the still poses must tilt the payload to tell how high its centre of mass is; gravity keeps the direction "
            f"({along}) of the reference grasp to within {spread:.1g} rad. Add still poses that are tilted by several "
            "degrees."
        )
    found = np.linalg.solve(normal, np.einsum("kij,ki->j", stacked, moment))
    left = moment - np.einsum("kij,j->ki", stacked, found)
    variance = float((left**2).sum()) / max(3 * len(left) - 3, 1)
    return found, np.asarray(variance * np.linalg.inv(normal))


def mass_and_com(gravity: Array, wrench: Array) -> MassAndCom:
    """Return mass and centre of mass from still rows.

    gravity  (K, 3) [m/s^2] in R's axes
    wrench   (K, 6) [N m, N] sum over the team, about R's origin in R's axes
    Raises CannotAnswer where the mass comes out negative (a sign is wrong) or gravity has one direction only.
    """
    gravity = check.rows("gravity", gravity)
    wrench = check.rows("wrench", wrench, 6, of=("gravity", gravity))
    if not len(gravity):
        raise CannotAnswer("mass and centre of mass need rows at rest; there are none. Record still poses.")
    found, mass_std = mass(gravity, wrench[:, 3:])
    require_lift(found, "the still forces")
    place, covariance = com(gravity, wrench[:, :3], found)
    unit = gravity / np.linalg.norm(gravity, axis=1, keepdims=True)
    tilt = float(np.sqrt(np.linalg.eigvalsh(np.cov(unit.T, bias=True))[2])) if len(unit) > 1 else 0.0
    return MassAndCom(
        found,
        place,
        mass_std,
        covariance,
        float(np.sqrt(((wrench[:, 3:] + found * gravity) ** 2).mean())),
        float(np.sqrt(((wrench[:, :3] - found * np.cross(gravity, place)) ** 2).mean())),
        tilt,
        len(gravity),
    )
