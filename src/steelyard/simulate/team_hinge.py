"""A payload of two bodies with a hinge between them: where the grasps go and what they bear."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array
from steelyard.inertia import InertialParameters
from steelyard.simulate.motions import Kinematics, needed
from steelyard.simulate.team_cases import DOWN, Hinge
from steelyard.simulate.team_payload import Load, TeamPayload, grasp_load, grasp_map
from steelyard.spatial import Pose, Rotation, cross, lever_acceleration


def hinged_load(payload: TeamPayload, motion: Kinematics, six_axis: list[int], hinge: Hinge, swing: Array) -> Load:
    """Return what the grasps must do and bear: those of the second body move with it, and alone turn it on its hinge.

    swing  (3, T) angle of the hinge [rad] and its two derivatives
    """
    single = grasp_load(payload, motion, six_axis)
    rotation, position, omega, demand = single.rotation, single.position, single.twist[..., :3].copy(), single.demand
    angle, rate, change = swing
    axis, point = hinge.axis / np.linalg.norm(hinge.axis), hinge.point
    turn = Rotation.exp(angle[:, None] * axis)
    second = InertialParameters.from_com(hinge.mass, hinge.centre, np.diag(hinge.moments))
    wrench = needed(second, _second_motion(motion, turn, axis, point, rate, change), DOWN)
    back = Pose(turn, point - turn.apply(point))  # the second body's frame seen from C
    force = turn.apply(wrench[:, 3:])
    moment = turn.apply(wrench[:, :3]) + cross(back.position, force)
    about = moment - cross(np.broadcast_to(point, force.shape), force)
    held = sorted(hinge.robots)
    places, turns = np.repeat(position, len(angle), 0), np.repeat(rotation, len(angle), 0)
    places[:, held] = point + np.einsum("tij,tnj->tni", turn.matrix, places[:, held] - point)
    turns[:, held] = turn.matrix[:, None] @ turns[:, held]
    velocity = motion.velocity[:, None] + cross(omega, places)
    velocity[:, held] += cross(rate[:, None, None] * axis, places[:, held] - point)
    omega[:, held] += rate[:, None, None] * axis
    maps = grasp_map(places, six_axis)
    row = np.zeros((len(maps), 1, maps.shape[2]))
    robots = places.shape[1]
    for i in held:
        row[:, 0, 3 * i : 3 * i + 3] = cross(np.broadcast_to(axis, places[:, i].shape), places[:, i] - point)
    for k, i in enumerate(six_axis):
        if i in hinge.robots:
            row[:, 0, 3 * (robots + k) : 3 * (robots + k) + 3] = axis
    total = demand + np.concatenate([moment, force], 1)
    return Load(
        turns, places, np.concatenate([omega, velocity], -1), np.concatenate([maps, row], 1),
        np.column_stack([total, about @ axis]),
    )  # fmt: skip


def _second_motion(
    motion: Kinematics, turn: Rotation, axis: Array, point: Array, rate: Array, change: Array
) -> Kinematics:
    """Return the motion of the second body's frame, which is C when the hinge is at zero."""
    into = turn.inverse()
    omega = into.apply(motion.angular_velocity)
    spin = rate[:, None] * axis
    turning = omega + spin
    growing = into.apply(motion.angular_acceleration) + change[:, None] * axis + cross(omega, spin)
    lever = lever_acceleration(motion.angular_velocity, motion.angular_acceleration, point)
    at_hinge = into.apply(motion.acceleration + lever)
    acceleration = at_hinge - lever_acceleration(turning, growing, point)
    return Kinematics(
        motion.time, motion.rotation @ turn, motion.position, motion.velocity, acceleration, turning, growing,
        motion.pose,
    )  # fmt: skip
