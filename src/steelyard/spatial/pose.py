"""Rotation and Pose: frozen, batch-first, matrices inside.

Monograms as in Drake: `R_AB` turns coordinates in B into coordinates in A, `X_AB = (R_AB, p_AB)`; neighbouring
letters cancel, `X_AB @ X_BC = X_AC`. A log of N poses is one Pose with batch shape (N,).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike

from steelyard import check
from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.spatial.vectors import Acceleration, Twist, Wrench, cross_matrix

_SMALL_ANGLE = 1e-6


@dataclass(frozen=True, eq=False)
class Rotation:
    """Rotations R_AB as matrices of shape (..., 3, 3)."""

    matrix: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "matrix", check.rotations("rotation matrix", self.matrix))

    @classmethod
    def identity(cls, *batch: int) -> Rotation:
        """Return the identity, repeated over the batch shape."""
        return cls(np.broadcast_to(np.eye(3), (*batch, 3, 3)))

    @classmethod
    def nearest(cls, matrix: ArrayLike) -> Rotation:
        """Return the rotation nearest to each (..., 3, 3) matrix in the Frobenius norm (SVD)."""
        u, _, vt = np.linalg.svd(check.matrices("matrix", matrix))
        u[..., :, 2] *= np.linalg.det(u @ vt)[..., None]
        return cls(u @ vt)

    @classmethod
    def from_quaternion_wxyz(cls, quaternion: ArrayLike) -> Rotation:
        """Return rotations from quaternions (..., 4), scalar first; any non-zero length is accepted."""
        q = check.vectors("quaternion", quaternion, 4)
        norm = np.linalg.norm(q, axis=-1, keepdims=True)
        if norm.size and float(norm.min()) < 1e-12:
            raise BadValue(f"quaternion must not be zero; {int((norm < 1e-12).sum())} of {norm.size} have norm zero.")
        w, x, y, z = np.moveaxis(q / norm, -1, 0)
        rows = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
        return cls(np.moveaxis(np.array(rows), (0, 1), (-2, -1)))

    @classmethod
    def from_quaternion_xyzw(cls, quaternion: ArrayLike) -> Rotation:
        """Return rotations from quaternions (..., 4), scalar last (ROS, SciPy)."""
        return cls.from_quaternion_wxyz(np.roll(check.vectors("quaternion", quaternion, 4), 1, axis=-1))

    @classmethod
    def from_rpy(cls, rpy: ArrayLike) -> Rotation:
        """Return R = Rz(yaw) Ry(pitch) Rx(roll) from (..., 3) roll, pitch, yaw [rad] (URDF, ROS)."""
        roll, pitch, yaw = np.moveaxis(check.vectors("rpy", rpy), -1, 0)
        zero = np.zeros_like(roll)
        about = [np.stack(v, -1) for v in ((zero, zero, yaw), (zero, pitch, zero), (roll, zero, zero))]
        return cls.exp(about[0]) @ cls.exp(about[1]) @ cls.exp(about[2])

    @classmethod
    def exp(cls, vector: ArrayLike) -> Rotation:
        """Return rotations about `vector` (..., 3) by its length [rad] (Rodrigues)."""
        v = check.vectors("rotation vector", vector)
        angle = np.linalg.norm(v, axis=-1)[..., None, None]
        k = cross_matrix(v)
        small = angle < _SMALL_ANGLE
        safe = np.where(small, 1.0, angle)
        a = np.where(small, 1 - angle**2 / 6, np.sin(safe) / safe)
        b = np.where(small, 0.5 - angle**2 / 24, (1 - np.cos(safe)) / safe**2)
        return cls(np.eye(3) + a * k + b * (k @ k))

    def log(self) -> Array:
        """Return rotation vectors (..., 3) [rad], length at most pi."""
        q = self.quaternion_wxyz()
        w, v = q[..., 0], q[..., 1:]
        sine = np.linalg.norm(v, axis=-1)
        angle = 2 * np.arctan2(sine, w)
        scale = np.where(sine < _SMALL_ANGLE, 2.0, angle / np.where(sine < _SMALL_ANGLE, 1.0, sine))
        return np.asarray(scale[..., None] * v)

    def quaternion_wxyz(self) -> Array:
        """Return unit quaternions (..., 4), scalar first and never negative."""
        m = self.matrix
        diagonal = np.einsum("...ii->...i", m)
        trace = diagonal.sum(-1, keepdims=True)
        squares = 1 + np.concatenate([trace, 2 * diagonal - trace], -1)
        big = np.argmax(squares, -1)
        products = _quaternion_products(m, squares)
        row = np.take_along_axis(products, big[..., None, None], -2)[..., 0, :]
        q = row / np.linalg.norm(row, axis=-1, keepdims=True)
        return np.asarray(np.where(q[..., :1] < 0, -q, q))

    def inverse(self) -> Rotation:
        """Return R_BA."""
        return Rotation(np.swapaxes(self.matrix, -1, -2))

    def apply(self, vector: ArrayLike) -> Array:
        """Return vectors (..., 3) given in B expressed in A."""
        return np.einsum("...ij,...j->...i", self.matrix, check.vectors("vector", vector))

    def angle(self) -> Array:
        """Return the rotation angle [rad], 0..pi."""
        return np.asarray(np.linalg.norm(self.log(), axis=-1))

    def __matmul__(self, other: Rotation) -> Rotation:
        return Rotation(self.matrix @ other.matrix)

    def __getitem__(self, index: Any) -> Rotation:
        return Rotation(self.matrix[index])

    @property
    def batch(self) -> tuple[int, ...]:
        """The batch shape."""
        return self.matrix.shape[:-2]


def _quaternion_products(m: Array, squares: Array) -> Array:
    """Return the (..., 4, 4) outer products 4 q q^T, from which the best-conditioned row is taken."""
    outer = np.empty((*m.shape[:-2], 4, 4))
    for i in range(4):
        outer[..., i, i] = squares[..., i]
    for i, (j, k) in enumerate(((2, 1), (0, 2), (1, 0))):
        outer[..., 0, i + 1] = outer[..., i + 1, 0] = m[..., j, k] - m[..., k, j]
    for i, j in ((0, 1), (0, 2), (1, 2)):
        outer[..., i + 1, j + 1] = outer[..., j + 1, i + 1] = m[..., i, j] + m[..., j, i]
    return outer


@dataclass(frozen=True, eq=False)
class Pose:
    """Poses X_AB = (rotation R_AB, position p_AB of B's origin in A, metres)."""

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
    def identity(cls, *batch: int) -> Pose:
        """Return the identity, repeated over the batch shape."""
        return cls(Rotation.identity(*batch), np.zeros((*batch, 3)))

    @classmethod
    def from_matrix(cls, matrix: ArrayLike) -> Pose:
        """Return poses from homogeneous matrices (..., 4, 4)."""
        m = check.matrices("pose matrix", matrix, 4, 4)
        return cls(Rotation(m[..., :3, :3]), m[..., :3, 3])

    def matrix(self) -> Array:
        """Return homogeneous matrices (..., 4, 4)."""
        out = np.zeros((*self.rotation.batch, 4, 4))
        out[..., :3, :3] = self.rotation.matrix
        out[..., :3, 3] = self.position
        out[..., 3, 3] = 1
        return out

    def inverse(self) -> Pose:
        """Return X_BA."""
        back = self.rotation.inverse()
        return Pose(back, -back.apply(self.position))

    def apply(self, point: ArrayLike) -> Array:
        """Return points (..., 3) given in B expressed in A [m]."""
        return np.asarray(self.rotation.apply(point) + self.position)

    @overload
    def __matmul__(self, other: Pose) -> Pose: ...
    @overload
    def __matmul__(self, other: Wrench) -> Wrench: ...
    @overload
    def __matmul__(self, other: Twist) -> Twist: ...
    def __matmul__(self, other: Pose | Wrench | Twist) -> Pose | Wrench | Twist:
        if isinstance(other, Pose):
            return Pose(self.rotation @ other.rotation, self.apply(other.position))
        if isinstance(other, Wrench):
            return self._move_wrench(other)
        return self._move_twist(other)

    def _move_wrench(self, wrench: Wrench) -> Wrench:
        """Express a wrench given at B's origin at A's origin: tau_A = R tau_B + p x f_A."""
        force = self.rotation.apply(wrench.force)
        return Wrench(self.rotation.apply(wrench.torque) + np.cross(self.position, force), force)

    def _move_twist(self, twist: Twist) -> Twist:
        """Express the twist of a rigid body given at B's origin at A's origin: v_A = R v_B + p x omega_A."""
        omega = self.rotation.apply(twist.angular)
        return Twist(omega, self.rotation.apply(twist.linear) + np.cross(self.position, omega))

    def move_acceleration(self, acceleration: Acceleration, angular_velocity: ArrayLike) -> Acceleration:
        """Express the classical acceleration of B's origin at A's origin (both fixed in one rigid body).

        `angular_velocity` (..., 3) [rad/s] is in B. The point moves by -p, so
        a_A = a_B - alpha x p - omega x (omega x p), all in A.
        """
        omega, alpha = self.rotation.apply(angular_velocity), self.rotation.apply(acceleration.angular)
        lever = np.cross(alpha, self.position) + np.cross(omega, np.cross(omega, self.position))
        return Acceleration(alpha, self.rotation.apply(acceleration.linear) - lever)

    def __getitem__(self, index: Any) -> Pose:
        return Pose(self.rotation[index], self.position[index])
