"""Whether joint angles can be those of an Omnid in the unit that was said; if not, columns or units are wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.robots.omnid import Omnid

# Readings may pass a stop by play and by the zero of an encoder; where most do by more than this [rad] they are others.
_BEYOND = np.deg2rad(25.0)


def require_likely(robot: Omnid, joints: Array) -> None:
    """Raise BadValue where joint angles (T, 6) [rad] are those of no Omnid, so that columns or units are others.

    Radians read as degrees keep every arm within two degrees of level, where the platform is below what it works at.
    """
    if not len(joints):
        return
    low, high = robot.arm_limits
    x, y, z = (stop + _BEYOND for stop in robot.gimbal_stops)
    wide = replace(robot, arm_limits=(low - _BEYOND, high + _BEYOND), gimbal_stops=(x, y, z))
    middle = np.median(joints, axis=0)
    if not _works(wide, middle, joints):
        for said, looks, factor in (("rad", "degrees", np.pi / 180), ("deg", "radians", 180 / np.pi)):
            if _works(wide, factor * middle, factor * joints):
                raise BadValue(
                    f'joint angles look like {looks} that are read as "{said}": they would be between '
                    f"{np.rad2deg(joints.min()):.3g} and {np.rad2deg(joints.max()):.3g} deg, where no Omnid works. Set "
                    f'unit = "{looks[:3]}" for "joint_position".'
                )
    try:
        wide.require_within(middle)
    except BadValue:
        wide.require_within(joints)


def _works(robot: Omnid, middle: Array, joints: Array) -> bool:
    """Return whether arms and gimbal are mostly within their stops and the platform no lower than it works."""
    try:
        robot.require_within(middle)
        robot.require_within(np.quantile(joints, (0.05, 0.95), axis=0))
        height = robot.pose(middle).position[2] + robot.home_height
    except BadValue:
        return False
    return bool(robot.work_box[2] <= height <= robot.work_box[3] + 0.1)
