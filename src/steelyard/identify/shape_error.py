"""ShapeError: how wrong the given shape and grasp may be, and what that does to the answer."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.identify.people import half_trace_com, parameter_jacobian
from steelyard.inertia import InertialParameters
from steelyard.spatial import Pose, Rotation


@dataclass(frozen=True)
class ShapeError:
    """Standard deviations of what is taken as known.

    com_m           of the centre of mass that the shape gives, per axis [m]
    inertia_share   of the inertia, as a share of half its trace
    grasp_m, grasp_rad   of the pose of the object in the sensor, per axis [m, rad]
    """

    com_m: float = 0.0
    inertia_share: float = 0.0
    grasp_m: float = 0.0
    grasp_rad: float = 0.0

    def __post_init__(self) -> None:
        values = (self.com_m, self.inertia_share, self.grasp_m, self.grasp_rad)
        if not all(np.isfinite(v) and v >= 0 for v in values):
            raise BadValue(f"standard deviations of shape and grasp must not be negative; got {values}.")

    def at_least(self, com_m: float, inertia_share: float) -> ShapeError:
        """Return the error with its shape part no less than this."""
        return replace(self, com_m=max(self.com_m, com_m), inertia_share=max(self.inertia_share, inertia_share))

    def scaled(self, factor: float) -> ShapeError:
        """Return the error with its shape part `factor` times as large, not below that of a measured shape."""
        com = factor * max(self.com_m, MEASURED.com_m)
        return replace(self, com_m=com, inertia_share=factor * max(self.inertia_share, MEASURED.inertia_share))

    def grasp_steps(self) -> list[Pose]:
        """Return displacements of one standard deviation along and about each axis that has one."""
        if not (self.grasp_m or self.grasp_rad):
            return []
        steps = [Pose(Rotation.identity(), self.grasp_m * axis) for axis in np.eye(3) if self.grasp_m]
        return steps + [Pose(Rotation.exp(self.grasp_rad * axis), np.zeros(3)) for axis in np.eye(3) if self.grasp_rad]

    def covariance(self, body: InertialParameters) -> Array:
        """Return the covariance (10, 10) that a wrong shape gives the parameters of a body, its mass known."""
        phi, variance = body.vector.copy(), np.zeros(10)
        variance[1:4], variance[4:] = self.com_m**2, (self.inertia_share * half_trace_com(phi)) ** 2
        back = parameter_jacobian(phi)
        return np.asarray((back * variance) @ back.T)

    def with_grasp(self, body: InertialParameters) -> Array:
        """Return the covariance (10, 10) that a wrong shape and a wrong grasp give the parameters of a body."""
        out = self.covariance(body)
        for X in self.grasp_steps():
            off = (body.in_frame(X).vector - body.in_frame(X.inverse()).vector) / 2
            out += np.outer(off, off)
        return out


EXACT = ShapeError()
# What a mesh of a real tool is wrong by even when it is right.
MEASURED = ShapeError(com_m=1e-4, inertia_share=3e-3)
# A scan puts the centroids of its parts off by so much, one standard deviation per axis [m].
DRAWN = 1e-3
