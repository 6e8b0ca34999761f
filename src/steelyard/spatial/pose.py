"""Pose: frozen, batch-first, a Rotation and a position inside.

Monograms as in Drake: `X_AB = (R_AB, p_AB)` turns coordinates in B into coordinates in A, and neighbouring
letters cancel, `X_AB @ X_BC = X_AC`. A log of N poses is one Pose with batch shape (N,).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike

from steelyard import check
from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.spatial.rotation import Rotation
from steelyard.spatial.vectors import Acceleration, Twist, Wrench, cross, lever_acceleration


@dataclass(frozen=True, eq=False)
class Pose:
    """Poses X_AB of one batch shape: `rotation` R_AB and `position` p_AB (..., 3) of B's origin in A [m]."""

    rotation: Rotation
    position: Array

    def __post_init__(self) -> None:
        position = check.vectors("position", self.position)
        if position.shape[:-1] != self.rotation.batch:
            raise BadValue(
                f"rotation and position must have one batch shape; got {self.rotation.batch} and {position.shape[:-1]}."
            )
        object.__setattr__(self, "position", position)

    @classmethod
    def trusted(cls, rotation: Rotation, position: Array) -> Pose:
        """Wrap what poses make of each other, finite and of one batch shape by construction."""
        pose = object.__new__(cls)
        position = np.ascontiguousarray(position)
        position.flags.writeable = False
        object.__setattr__(pose, "rotation", rotation)
        object.__setattr__(pose, "position", position)
        return pose

    @classmethod
    def identity(cls, *batch: int) -> Pose:
        """Return the identity, repeated over the batch shape."""
        return cls(Rotation.identity(*batch), np.zeros((*batch, 3)))

    @classmethod
    def from_matrix(cls, matrix: ArrayLike) -> Pose:
        """Return poses from homogeneous matrices (..., 4, 4) [m]; raises BadValue where one is none."""
        m = check.matrices("pose matrix", matrix, 4, 4)
        off = np.abs(m[..., 3, :] - [0, 0, 0, 1]).max(initial=0.0)
        if off > 1e-9:
            raise BadValue(f"pose matrix must end in the row 0 0 0 1; it is off by {off:.2g}.")
        return cls(Rotation(m[..., :3, :3]), m[..., :3, 3])

    @classmethod
    def stacked(cls, poses: Sequence[Pose]) -> Pose:
        """Return poses of one batch shape as one, along a new first axis."""
        turns = Rotation.trusted(np.stack([pose.rotation.matrix for pose in poses]))
        return cls(turns, np.stack([pose.position for pose in poses]))

    def matrix(self) -> Array:
        """Return homogeneous matrices (..., 4, 4) [m]."""
        out = np.zeros((*self.rotation.batch, 4, 4))
        out[..., :3, :3] = self.rotation.matrix
        out[..., :3, 3] = self.position
        out[..., 3, 3] = 1
        return out

    def inverse(self) -> Pose:
        """Return X_BA."""
        back = self.rotation.inverse()
        return Pose.trusted(back, -back.turned(self.position))

    def apply(self, point: ArrayLike) -> Array:
        """Return points (..., 3) given in B expressed in A [m]; the batch shapes broadcast."""
        return np.asarray(self.rotation.apply(point) + self.position)

    @overload
    def __matmul__(self, other: Pose) -> Pose: ...
    @overload
    def __matmul__(self, other: Wrench) -> Wrench: ...
    @overload
    def __matmul__(self, other: Twist) -> Twist: ...
    def __matmul__(self, other: Pose | Wrench | Twist) -> Pose | Wrench | Twist:
        if isinstance(other, Pose):
            return Pose.trusted(self.rotation @ other.rotation, self.rotation.turned(other.position) + self.position)
        if isinstance(other, Wrench):
            return self._move_wrench(other)
        if isinstance(other, Twist):
            return self._move_twist(other)
        if isinstance(other, Acceleration):
            raise BadValue("An acceleration moves with the angular velocity of its body: use move_acceleration.")
        return NotImplemented

    def _move_wrench(self, wrench: Wrench) -> Wrench:
        """Express a wrench given at B's origin at A's origin: f_A = R f_B, tau_A = R tau_B + p x f_A."""
        force = self.rotation.apply(wrench.force)
        return Wrench(self.rotation.apply(wrench.torque) + cross(self.position, force), force)

    def _move_twist(self, twist: Twist) -> Twist:
        """Express the twist of a rigid body given at B's origin at A's origin: v_A = R v_B + p x omega_A."""
        omega = self.rotation.apply(twist.angular)
        return Twist(omega, self.rotation.apply(twist.linear) + cross(self.position, omega))

    def move_acceleration(self, acceleration: Acceleration, angular_velocity: ArrayLike) -> Acceleration:
        """Express the classical acceleration of B's origin at A's origin, both fixed in one rigid body.

        acceleration      of B's origin, in B's axes
        angular_velocity  (..., 3) [rad/s] of the body, in B's axes

        The point moves by -p_AB, so a_A = R a_B - alpha x p - omega x (omega x p), all in A's axes.
        """
        omega, alpha = self.rotation.apply(angular_velocity), self.rotation.apply(acceleration.angular)
        lever = lever_acceleration(omega, alpha, self.position)
        return Acceleration(alpha, self.rotation.apply(acceleration.linear) - lever)

    def __getitem__(self, index: Any) -> Pose:
        rotation, position = self.rotation[index], self.position[index]
        if position.shape != (*rotation.batch, 3):
            raise BadValue(f"an index must choose among the batch {self.batch}; {index!r} cuts into the positions.")
        return Pose.trusted(rotation, position)

    @property
    def batch(self) -> tuple[int, ...]:
        """The batch shape."""
        return self.rotation.batch
