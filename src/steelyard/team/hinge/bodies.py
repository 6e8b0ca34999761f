"""What can be told of each of two bodies with a hinge between them, and what a body with these moments can weigh."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding
from steelyard.inertia import InertialParameters
from steelyard.spatial import Pose
from steelyard.team.adjoint import exp
from steelyard.team.estimate import BodyEstimate, TeamEstimate
from steelyard.team.hinge.rows import COUNT, EXCHANGED, SECOND, SEVEN, WHOLE
from steelyard.team.payload.model import SHOWN
from steelyard.team.split import hinge_words

# Seven parameters of the whole in its ten: first moments across the hinge, second moments of mass, products.
FROM_TEN = np.zeros((SECOND, WHOLE))
FROM_TEN[0, 1] = FROM_TEN[1, 2] = FROM_TEN[4, 5] = FROM_TEN[5, 6] = FROM_TEN[6, 8] = 1.0
FROM_TEN[2, [4, 7, 9]] = -0.5, 0.5, 0.5
FROM_TEN[3, [4, 7, 9]] = 0.5, -0.5, 0.5
# Difference quotients of the least mass are taken over this share of its standard deviations.
SLIGHT = 1e-3


def least_mass(seven: Array) -> float:
    """Return the least mass [kg] of a body with these moments (7,) across the hinge, zero where no body has them.

    Mass at a distance makes a second moment: [[Sigma, h], [h^T, m]] must be no less than zero, so m >= h^T Sigma^-1 h.
    """
    spread = np.array([[seven[2], -seven[4]], [-seven[4], seven[3]]])
    if np.linalg.eigvalsh(spread)[0] <= 0:
        return 0.0
    return float(seven[:2] @ np.linalg.solve(spread, seven[:2]))


def second_body(parameters: Array) -> Array:
    """Return ten parameters (10,) of the second body that go with the seventeen (17,), all in the hinge's frame H.

    Its mass is in the middle of its range.

    How far it reaches along the hinge, which nothing shows, is taken from how far the whole does.
    """
    least = [least_mass(map_ @ parameters) for map_ in seven_rows()]
    mass = 0.5 * (least[1] + max(float(parameters[0]) - least[0], least[1]))
    share = mass / max(float(parameters[0]), 1e-300)
    along = FROM_ALONG @ parameters[:WHOLE]
    return np.asarray(SEVEN @ parameters[WHOLE:] + EXCHANGED @ (share * along))


def seen_from(ten: Array) -> Array:
    """Return how the ten parameters of a body move (10, 6) with a small motion of the frame that they are seen from."""
    steps = SLIGHT**2 * np.eye(6)
    sides = [InertialParameters(ten).in_frame(exp(sign * steps)).vector for sign in (-1, 1)]
    return np.asarray((sides[0] - sides[1]).T / (2 * SLIGHT**2))


# Mass, first and second moment along the hinge of ten parameters.
FROM_ALONG = np.zeros((3, WHOLE))
FROM_ALONG[0, 0] = FROM_ALONG[1, 3] = 1.0
FROM_ALONG[2, [4, 7, 9]] = 0.5, 0.5, -0.5


def seven_rows() -> tuple[Array, Array]:
    """Return what makes the seven of the first and of the second body of the seventeen, (7, 17) each."""
    second = np.zeros((SECOND, COUNT))
    second[:, WHOLE:] = np.eye(SECOND)
    first = -second
    first[:, :WHOLE] = FROM_TEN
    return first, second


def both_bodies(
    parameters: Array,
    spreads: Sequence[tuple[Array, Array]],
    variance: float,
    scale: Array,
    frame: Pose,
    robots: tuple[tuple[str, ...], ...],
) -> tuple[BodyEstimate, BodyEstimate]:
    """Return the first and the second body from the seventeen parameters in H.

    spreads   covariance (7, 7) of what is told of each, and of its first moment in R's axes (3, 3)
    variance  of the mass of both [kg^2]
    scale    (17,) units of mass and size     frame X_RH     robots who holds each
    """
    maps = seven_rows()
    least = [_least(map_ @ parameters, spread) for map_, (spread, _) in zip(maps, spreads, strict=True)]
    mass, mass_std = float(parameters[0]), float(np.sqrt(max(variance, 0.0)))
    across = frame.rotation.matrix[:, :2]
    made = []
    for k, (map_, names) in enumerate(zip(maps, robots, strict=True)):
        values, (spread, vector) = map_ @ parameters, spreads[k]
        moment, std = float(values[2] + values[3]), float(np.sqrt(max(spread[2:4, 2:4].sum(), 0.0)))
        first, first_std = across @ values[:2], np.sqrt(np.maximum(np.diag(vector), 0))
        along = first / max(float(np.linalg.norm(first)), 1e-300)
        lever_std = float(np.sqrt(max(float(along @ vector @ along), 0.0)))
        turned = 2 * std < SHOWN * scale[WHOLE + 2]
        levered = 2 * float(np.sqrt(max(float(np.linalg.eigvalsh(vector)[-1]), 0.0))) < SHOWN * scale[WHOLE]
        (low, low_std), (other, other_std) = least[k], least[1 - k]
        most = mass - other + 2 * float(np.hypot(mass_std, other_std))
        weighs = np.array([np.maximum(low - 2 * low_std, 0.0), most])
        made.append(
            BodyEstimate(
                names, moment if turned else np.nan, std if turned else np.nan, np.where(levered, first, np.nan),
                np.where(levered, first_std, np.nan), lever_std if levered else np.nan,
                np.where(turned and levered, weighs, np.nan),
            )
        )  # fmt: skip
    return made[0], made[1]


def hinge_findings(team: TeamEstimate) -> list[Finding]:
    """Return payload-jointed: who holds which body, the hinge, what is known of each, and what to move for the rest."""
    if team.hinge is None:
        return []
    hinge = team.hinge
    holders = [" and ".join(f"'{name}'" for name in body.robots) for body in hinge.bodies]
    said = hinge_words(holders, hinge.axis, hinge.point, hinge.swing, team.reference)
    said += " What is given is for both together with the hinge at the mean of its angles. "
    if np.isnan([body.mass_range[0] for body in hinge.bodies]).any():
        said += "Too little is shown of each body: open and close the hinge faster while tilting the payload."
    else:
        ranges = (f"{body.mass_range[0]:.3g} to {body.mass_range[1]:.3g} kg" for body in hinge.bodies)
        said += (
            f"No motion tells how their mass is shared: {' and '.join(ranges)} are possible. Weigh one body by itself."
        )
    return [Finding.of("payload-jointed", said)]


def _least(seven: Array, covariance: Array) -> tuple[float, float]:
    """Return the least mass and its standard deviation."""
    value, slope = least_mass(seven), np.zeros(SECOND)
    step = SLIGHT * np.sqrt(np.maximum(np.diag(covariance), 0))
    for k in np.flatnonzero(step > 0):
        moved = np.array([least_mass(seven + sign * step[k] * np.eye(SECOND)[k]) for sign in (1, -1)])
        slope[k] = (moved[0] - moved[1]) / (2 * step[k])
    return value, float(np.sqrt(max(float(slope @ covariance @ slope), 0.0)))
