"""Where the log puts the centre of mass, against where the parts can have it: is the object where it is said to be?"""

from __future__ import annotations

import numpy as np

from steelyard.check import Array
from steelyard.identify.effective import Effective
from steelyard.identify.linear import inverse_scaled
from steelyard.identify.nonnegative import nonnegative_masses
from steelyard.inertia import forms
from steelyard.parts.parts import Parts

# A gap counts where it is so many standard deviations wide, and wider than meshes are exact [m].
CLEAR, LEAST = 4.0, 1e-4
# Half the length of a rod over its radius of gyration: no convex part reaches much farther from its centroid.
REACH = float(np.sqrt(3.0))
# Weight of "the shares add up to one" beside distances over the size of the object.
_WHOLE = 1e3


def misplaced(data: Effective, parts: Parts, least: float = LEAST) -> str:
    """Return a sentence where the centre of mass that the log shows lies off the parts, "" where it lies among them.

    data   what the log says, blurred by the errors of shape and grasp
    least  a gap that is no more than this is none [m]
    """
    mass = float(data.best[0])
    if mass <= 0:
        return ""
    com = data.best[1:4] / mass
    nearest = _among(parts.centroid, com)
    gap = com - nearest
    distance = float(np.linalg.norm(gap))
    ahead = gap / max(distance, 1e-12)
    slope = np.einsum("i,ij->j", ahead, forms.com_jacobian(data.best)[:3])
    std = float(np.sqrt(max(slope @ inverse_scaled(data.information) @ slope, 0.0)))
    if distance < max(CLEAR * std, least):
        return ""
    outside = float(ahead @ com) - float((parts.centroid @ ahead + REACH * _gyration(parts, ahead)).max())
    if outside > CLEAR * std:
        return (
            f"The log puts the centre of mass {1e3 * outside:.1f} mm outside the object: pose_in_sensor is wrong by at "
            "least that much."
        )
    return (
        f"The log puts the centre of mass {1e3 * distance:.1f} mm from where any masses of even parts would: unless "
        "one is uneven, pose_in_sensor is wrong by at least that much."
    )


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
