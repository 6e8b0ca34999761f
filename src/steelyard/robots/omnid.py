"""Omnid: a Delta with series-elastic joints that carries a passive three-axis gimbal.

Six joint angles, three of the Delta and then the gimbal's about x, y and z, give the pose of the grasp in the home
frame (the Delta's base axes, origin at the platform's home). The gimbal bears no moment: the wrench is a force, and the
springs of the Delta tell it.
Source: "Cooperative Payload Estimation by a Team of Mocobots", IV-B and eq. 34-35; sizes and stops of the
published firmware (2018-2020).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from steelyard import check
from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.robots.delta import Delta
from steelyard.spatial import Pose, Rotation, Twist, Wrench


@dataclass(frozen=True)
class Omnid:
    """Delta and limits of one Omnid.

    home_height  of the platform above the Delta's base plane in the home configuration [m]
    arm_limits   of the Delta's joints [rad]
    gimbal_stops half travel about x, y, z [rad]; about z it bounds the travel and not the reading, whose zero depends
                 on how the gripper was clamped
    work_box     half widths in x and y, lowest and highest z of the platform above the base plane [m]
    """

    delta: Delta = field(default_factory=Delta)
    home_height: float = 0.42
    arm_limits: tuple[float, float] = (0.0, np.deg2rad(80.0))
    gimbal_stops: tuple[float, float, float] = (0.6674, 0.6674, 0.35377)
    work_box: tuple[float, float, float, float] = (0.10, 0.10, 0.20, 0.45)

    def pose(self, joints: ArrayLike) -> Pose:
        """Return the grasp's pose T_i0 (...) in the home frame from joint angles (..., 6) [rad] (eq. 34)."""
        q = check.vectors("joint angles", joints, 6)
        position = self.delta.position(q[..., :3]) - self._home
        return Pose(gimbal_rotation(q[..., 3:]), position)

    def joints(self, pose: Pose) -> Array:
        """Return the joint angles (..., 6) [rad] that bring the grasp to `pose` in the home frame.

        Raises BadValue where the Delta does not reach or the gimbal is at its singular quarter turn about y.
        """
        arms = self.delta.angles(pose.position + self._home)
        return np.concatenate([arms, gimbal_angles(pose.rotation)], axis=-1)

    def reaches(self, position: ArrayLike) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
        """Return where (...) the Delta can bring the grasp to `position` (..., 3) [m] in the home frame."""
        return self.delta.reaches(check.vectors("position", position) + self._home)

    def jacobian(self, joints: ArrayLike) -> Array:
        """Return the body Jacobian (..., 6, 6): twist of the grasp in its own axes, angular first, per joint rate."""
        q = check.vectors("joint angles", joints, 6)
        out = np.zeros((*q.shape, 6))
        out[..., :3, 3:] = gimbal_jacobian(q[..., 3:])
        turned = np.swapaxes(gimbal_rotation(q[..., 3:]).matrix, -1, -2)
        out[..., 3:, :3] = turned @ self.delta.jacobian(q[..., :3])
        return out

    def twist(self, joints: ArrayLike, rates: ArrayLike) -> Twist:
        """Return the grasp's body twist (...) from joint angles and rates (..., 6) [rad, rad/s] (eq. 35)."""
        rate = check.vectors("joint rates", rates, 6)
        return Twist.from_array(np.einsum("...ij,...j->...i", self.jacobian(joints), rate))

    def wrench(self, joints: ArrayLike, torques: ArrayLike) -> Wrench:
        """Return the wrench (...) applied to the payload, in the grasp's axes: zero moment and f = J^-T tau.

        joints   (..., 6) [rad]
        torques  (..., 3) of the Delta's springs [N m]
        """
        q = check.vectors("joint angles", joints, 6)
        force = gimbal_rotation(q[..., 3:]).inverse().apply(self.delta.force(q[..., :3], torques))
        return Wrench(np.zeros_like(force), force)

    def spring_torques(self, joints: ArrayLike, force: ArrayLike) -> Array:
        """Return the spring torques (..., 3) [N m] while the grasp applies `force` (..., 3) [N], in its own axes."""
        q = check.vectors("joint angles", joints, 6)
        return self.delta.torques(q[..., :3], gimbal_rotation(q[..., 3:]).apply(force))

    def require_within(self, joints: ArrayLike) -> None:
        """Raise BadValue where joint angles (..., 6) [rad] are beyond an arm's limit or a gimbal stop."""
        q = check.vectors("joint angles", joints, 6).reshape(-1, 6)
        low, high = self.arm_limits
        for k in range(3):
            _refuse(q[:, k], low, high, f"Delta joint {k + 1}")
        for k, axis in enumerate("xy"):
            _refuse(q[:, 3 + k], -self.gimbal_stops[k], self.gimbal_stops[k], f"gimbal joint {axis}")
        travel = float(np.ptp(np.unwrap(q[:, 5]))) if len(q) else 0.0
        if travel > 2 * self.gimbal_stops[2]:
            raise BadValue(
                f"gimbal joint z must travel at most {np.rad2deg(2 * self.gimbal_stops[2]):.1f} deg; it travels "
                f"{np.rad2deg(travel):.1f} deg. Check the order of the joint columns and their unit."
            )

    @property
    def _home(self) -> Array:
        return np.array([0.0, 0.0, self.home_height])


def gimbal_rotation(angles: ArrayLike) -> Rotation:
    """Return R = Rx Ry Rz (...) from gimbal angles (..., 3) [rad] about x, y and z, from the base outwards."""
    q = check.vectors("gimbal angles", angles)
    (sx, sy, sz), (cx, cy, cz) = np.moveaxis(np.sin(q), -1, 0), np.moveaxis(np.cos(q), -1, 0)
    rows = [
        [cy * cz, -cy * sz, sy],
        [cx * sz + sx * sy * cz, cx * cz - sx * sy * sz, -sx * cy],
        [sx * sz - cx * sy * cz, sx * cz + cx * sy * sz, cx * cy],
    ]
    return Rotation(np.moveaxis(np.array(rows), (0, 1), (-2, -1)))


def gimbal_angles(rotation: Rotation) -> Array:
    """Return gimbal angles (..., 3) [rad], y within a quarter turn; raises BadValue at that quarter turn itself."""
    m = rotation.matrix
    flat = np.hypot(m[..., 0, 0], m[..., 0, 1])
    if (flat < 1e-9).any():
        raise BadValue("the gimbal is turned a quarter turn about y, where its x and z axes are one: no angles fit.")
    x = np.arctan2(-m[..., 1, 2], m[..., 2, 2])
    z = np.arctan2(-m[..., 0, 1], m[..., 0, 0])
    return np.stack([x, np.arctan2(m[..., 0, 2], flat), z], axis=-1)


def gimbal_jacobian(angles: ArrayLike) -> Array:
    """Return d (angular velocity in the grasp's axes) / d (gimbal rates), (..., 3, 3)."""
    q = check.vectors("gimbal angles", angles)
    (_, sy, sz), (_, cy, cz) = np.moveaxis(np.sin(q), -1, 0), np.moveaxis(np.cos(q), -1, 0)
    zero, one = np.zeros_like(sy), np.ones_like(sy)
    rows = [[cy * cz, sz, zero], [-cy * sz, cz, zero], [sy, zero, one]]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def _refuse(angle: Array, low: float, high: float, name: str) -> None:
    """Raise BadValue where `angle` (N,) is outside low..high [rad]."""
    outside = (angle < low) | (angle > high)
    if outside.any():
        row = int(np.argmax(outside))
        raise BadValue(
            f"{name} must be within {np.rad2deg(low):.1f} to {np.rad2deg(high):.1f} deg; {int(outside.sum())} of "
            f"{len(angle)} rows are not, the first is row {row + 1} at {np.rad2deg(angle[row]):.1f} deg. Check the "
            "order of the joint columns and their unit."
        )
