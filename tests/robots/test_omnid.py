"""Omnid kinematics: round trips, derivatives against differences, work, limits."""

from __future__ import annotations

import numpy as np
import pytest

from steelyard.errors import BadValue
from steelyard.robots import Delta, Omnid
from steelyard.robots.omnid import gimbal_angles, gimbal_rotation

RNG = np.random.default_rng(5)


def some_joints(rows: int = 200) -> np.ndarray:
    arms = RNG.uniform(0.2, 1.2, (rows, 1)) + RNG.uniform(-0.15, 0.15, (rows, 3))
    return np.concatenate([arms, RNG.uniform(-0.6, 0.6, (rows, 2)), RNG.uniform(-3, 3, (rows, 1))], axis=1)


def test_joints_of_a_pose_are_those_it_came_from() -> None:
    omnid, joints = Omnid(), some_joints()
    assert np.abs(omnid.joints(omnid.pose(joints)) - joints).max() < 1e-12


def test_home_is_level_at_the_origin() -> None:
    delta = Delta()
    arms = delta.angles([0.0, 0.0, 0.42])
    home = Omnid().pose(np.concatenate([arms, np.zeros(3)]))
    assert np.abs(home.position).max() < 1e-15
    assert np.abs(home.rotation.matrix - np.eye(3)).max() == 0


def test_upper_links_keep_their_length() -> None:
    delta, angles = Delta(), some_joints()[:, :3]
    azimuth = 2 * np.pi * np.arange(3) / 3
    out = np.stack([np.cos(azimuth), np.sin(azimuth), 0 * azimuth], 1)
    knee = (delta.base_radius + delta.driven_link * np.cos(angles))[..., None] * out
    knee[..., 2] = delta.driven_link * np.sin(angles)
    ankle = delta.position(angles)[:, None] + delta.platform_radius * out
    assert np.abs(np.linalg.norm(ankle - knee, axis=-1) - delta.upper_link).max() < 1e-12


def test_jacobian_is_the_slope_of_the_pose() -> None:
    omnid, joints, step = Omnid(), some_joints(50), 1e-6
    for k in range(6):
        away = step * np.eye(6)[k]
        before, after = omnid.pose(joints - away), omnid.pose(joints + away)
        here = omnid.pose(joints)
        turned = (before.rotation.inverse() @ after.rotation).log() / (2 * step)
        moved = here.rotation.inverse().apply(after.position - before.position) / (2 * step)
        slope = omnid.jacobian(joints)[..., k]
        assert np.abs(np.concatenate([turned, moved], 1) - slope).max() < 1e-8


def test_springs_do_the_work_of_the_force() -> None:
    omnid, joints = Omnid(), some_joints()
    rates, force = RNG.standard_normal((200, 6)), RNG.standard_normal((200, 3))
    torques = omnid.spring_torques(joints, force)
    work = (force * omnid.twist(joints, rates).linear).sum(1)
    assert np.abs((torques * rates[:, :3]).sum(1) - work).max() < 1e-12
    wrench = omnid.wrench(joints, torques)
    assert np.abs(wrench.force - force).max() < 1e-12
    assert not wrench.torque.any()


def test_stiffness_with_locked_motors_is_that_of_the_real_robot() -> None:
    delta = Delta()
    slope = delta.jacobian(delta.angles([0.0, 0.0, 0.36]))
    back = np.linalg.inv(slope)
    spring = 17.0  # of each series-elastic joint [N m/rad]
    assert np.round(np.diag(back.T @ (spring * back))).tolist() == [383, 383, 572]


@pytest.mark.parametrize(("height", "radius"), [(0.30, 0.345), (0.36, 0.31), (0.42, 0.265), (0.48, 0.19)])
def test_reach_is_that_of_the_real_geometry(height: float, radius: float) -> None:
    turn = np.linspace(0, 2 * np.pi, 60)

    def ring(r: float) -> np.ndarray:
        return np.column_stack([r * np.cos(turn), r * np.sin(turn), np.full(60, height)])

    assert Delta().reaches(ring(radius - 0.01)).all()
    assert not Delta().reaches(ring(radius + 0.01)).all()


def test_gimbal_angles_and_rotation_undo_each_other() -> None:
    angles = RNG.uniform(-1.5, 1.5, (300, 3))
    assert np.abs(gimbal_angles(gimbal_rotation(angles)) - angles).max() < 1e-12


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ((0, 0, np.deg2rad(85)), r"Delta joint 1 must be within 0.0 to 80.0 deg; 1 of 3 rows .* row 1 at 85.0"),
        ((1, 4, 0.7), r"gimbal joint y must be within -38.2 to 38.2 deg; 1 of 3 rows .* row 2 at 40.1"),
        ((2, 5, 0.9), r"gimbal joint z must travel at most 40.5 deg; it travels 51.6 deg"),
    ],
)  # fmt: skip
def test_limits_are_named(change: tuple[int, int, float], message: str) -> None:
    joints = np.tile([0.8, 0.8, 0.8, 0, 0, 0.0], (3, 1))
    Omnid().require_within(joints)
    joints[change[0], change[1]] = change[2]
    with pytest.raises(BadValue, match=message):
        Omnid().require_within(joints)


def test_a_clamped_gripper_shifts_the_zero_of_the_last_joint() -> None:
    Omnid().require_within(np.tile([0.8, 0.8, 0.8, 0, 0, 2.5], (3, 1)))


def test_out_of_reach_is_said() -> None:
    with pytest.raises(
        BadValue, match=r"within reach of the Delta; 1 of 2 are not, the first at \(0.000, 0.000, 0.600\)"
    ):
        Delta().angles([[0, 0, 0.4], [0, 0, 0.6]])
    with pytest.raises(BadValue, match="can close on"):
        Delta(base_radius=0.5, upper_link=0.3).position([0.0, 0.0, 0.0])
    with pytest.raises(BadValue, match="quarter turn about y"):
        gimbal_angles(gimbal_rotation([0.1, np.pi / 2, 0.2]))
