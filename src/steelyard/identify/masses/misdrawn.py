"""How far off the masses of parts are where a scan drew the borders between parts in slightly wrong places."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.identify.bars.effective import Effective
from steelyard.identify.masses.models import Masses
from steelyard.identify.masses.shape_error import ShapeError
from steelyard.parts.parts import Parts
from steelyard.spatial import Pose, Rotation

# A scan puts the centroids of its parts off by so much, one standard deviation per axis [m].
DRAWN = 1e-3


def misdrawn(data: Effective, parts: Parts, masses: Masses, error: ShapeError) -> Masses:
    """Return the masses of parts with what borders that a scan drew a little off add to their covariance.

    error  of the shape as a whole, by which the log was blurred for the masses

    To first order: a part k that is shifted by d misses m_k dB_k of phi, and C B^T F m_k dB_k of it goes to the
    masses. The whole does not feel it: the log alone holds that.
    """
    blurred = data.blurred(error.with_grasp(parts.whole(masses.mean)))
    gain = masses.covariance @ parts.per_mass.T @ blurred.information
    shifted = (parts.in_frame(Pose(Rotation.identity(), DRAWN * axis)).per_mass for axis in np.eye(3))
    steps = [gain @ ((moved - parts.per_mass) * masses.mean) for moved in shifted]
    return replace(masses, covariance=masses.covariance + sum(step @ step.T for step in steps))
