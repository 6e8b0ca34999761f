"""Where the log puts the centre of mass, against where the parts can have it: is the object where it is said to be?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from steelyard.check import Array
from steelyard.errors import NoMasses
from steelyard.findings import OTHER_FRAME, Finding
from steelyard.identify.bars.effective import Effective
from steelyard.identify.cost.linear import inverse_scaled
from steelyard.identify.estimate import Estimate
from steelyard.identify.masses.nonnegative import nonnegative_masses
from steelyard.identify.masses.shape_error import ShapeError
from steelyard.inertia import InertialParameters, forms
from steelyard.parts.parts import Parts

# A gap counts where it is so many standard deviations wide, and wider than meshes are exact [m].
CLEAR, LEAST = 4.0, 1e-4
# Parts whose masses do not explain a log lie elsewhere from such a gap on [m]; below it they are only drawn badly.
ELSEWHERE = 3e-3
# Half the length of a rod over its radius of gyration: no convex part reaches much farther from its centroid.
REACH = float(np.sqrt(3.0))
# Weight of "the shares add up to one" beside distances over the size of the object.
_WHOLE = 1e3


def misplaced(data: Effective, parts: Parts, least: float = LEAST) -> str:
    """Return a sentence where the centre of mass that the log shows lies off the parts, "" where it lies among them.

    data   what the log says, blurred by the errors of shape and grasp
    least  a gap that is no more than this is none [m]
    """
    return off(data.best, inverse_scaled(data.information), parts, least)


def off(phi: Array, covariance: Array, parts: Parts, least: float = LEAST) -> str:
    """Return the sentence of `misplaced` for a body phi (10,) that is known up to `covariance` (10, 10)."""
    gap = gap_of(phi, covariance, parts)
    if gap is None or gap.distance < least:
        return ""
    if gap.outside:
        return (
            f"The log puts the centre of mass {1e3 * gap.outside:.1f} mm outside the object: pose_in_sensor is wrong "
            "by at least that much."
        )
    return (
        f"The log puts the centre of mass {1e3 * gap.distance:.1f} mm from where any masses of even parts would: "
        "unless one is uneven, pose_in_sensor is wrong by at least that much."
    )


@dataclass(frozen=True)
class Gap:
    """How far a centre of mass lies from where even parts can have it, and outside them, 0.0 where that is open [m]."""

    distance: float
    outside: float


def gap_of(phi: Array, covariance: Array, parts: Parts) -> Gap | None:
    """Return the gap of a body phi (10,) that is known up to `covariance` (10, 10), None where it may be none."""
    mass = float(phi[0])
    if mass <= 0:
        return None
    com = phi[1:4] / mass
    nearest = _among(parts.centroid, com)
    gap = com - nearest
    distance = float(np.linalg.norm(gap))
    ahead = gap / max(distance, 1e-12)
    slope = np.append(-(ahead @ com), ahead) / mass  # of the gap with mass and first moment
    std = float(np.sqrt(max(float(slope @ covariance[:4, :4] @ slope), 0.0)))
    if distance < CLEAR * std:
        return None
    outside = float(ahead @ com) - float((parts.centroid @ ahead + REACH * _gyration(parts, ahead)).max())
    return Gap(distance, outside if outside > CLEAR * std else 0.0)


def no_masses(mass: float, parts: Parts) -> str:
    """Return the words for parts that cannot have the mass [kg] that the log weighs where they are."""
    return (
        f"No masses of these parts explain the wrench, that of {mass:.3g} kg: the shape, of "
        f"{1e6 * parts.volume.sum():.3g} cm^3, has another size or place."
    )


def contradicted(estimate: Estimate, parts: Parts) -> Finding:
    """Return the finding on parts that cannot follow a log, of which `estimate` is the answer without them."""
    where = off(estimate.parameters.vector, estimate.covariance, parts) or no_masses(estimate.mass, parts)
    text = f"{where} The shape cannot follow this log, and was left out: the answer is the log's alone."
    return Finding.of("part-not-homogeneous", text).instead(OTHER_FRAME)


def lies_elsewhere(alone: Estimate, explained: bool, parts: Parts, error: ShapeError) -> bool:
    """Tell whether the log contradicts the place of the parts beyond doubt, by more than shape and grasp may be wrong.

    alone      what the log says by itself of the object
    explained  whether a density that changes within parts explains the log: then only a centre of mass that lies
               outside the object cannot be
    """
    body = alone.parameters
    gap = gap_of(body.vector, alone.covariance + error.with_grasp(body), parts)
    return gap is not None and (gap.outside > 0 or (not explained and gap.distance >= ELSEWHERE))


def with_mass(parts: Parts, mean: Array, data: Effective, least: float = 0.0) -> InertialParameters:
    """Return the body of parts of masses `mean` (P,) [kg]; raises NoMasses below the `least` share of the log's."""
    if (body := parts.whole(mean)).mass > least * data.best[0]:
        return body
    raise refused(parts, data)


def consistent(parts: Parts, body: InertialParameters) -> InertialParameters:
    """Return the body if it is one, else one density of the same mass: the size of a shape error needs a body."""
    if body.validity().consistent:
        return body
    return parts.uniform(abs(float(body.mass)))


def refused(parts: Parts, data: Effective) -> NoMasses:
    """Return the error for parts that a log of this mass shows to lie elsewhere, or to be of another size."""
    return NoMasses(f"{no_masses(data.best[0], parts)} Check the unit of its points, pose_in_sensor.")


def _among(points: Array, goal: Array) -> Array:
    """Return the point (3,) nearest to `goal` that is a mean of `points` (P, 3) with weights not below zero."""
    size = max(float(np.abs(points - goal).max()), 1e-9)
    rows = np.column_stack([(points - goal) / size, np.full(len(points), _WHOLE)])
    weight = nonnegative_masses(np.ascontiguousarray(rows @ rows.T), rows[:, 3] * _WHOLE)
    return np.asarray(weight @ points / weight.sum())


def _gyration(parts: Parts, axis: Array) -> Array:
    """Return the rms distance (P,) of the volume of each part from its centroid along a unit vector [m]."""
    second = forms.pseudo_inertia(parts.moments)[:, :3, :3] / parts.volume[:, None, None]
    along = np.einsum("pij,i,j->p", second, axis, axis) - (parts.centroid @ axis) ** 2
    return np.asarray(np.sqrt(np.maximum(along, 0.0)))
