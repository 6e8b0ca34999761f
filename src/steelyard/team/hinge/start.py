"""Where to begin with a payload of two bodies: grasps from twists, the hinge from what they leave, homes from both."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from steelyard.check import Array
from steelyard.spatial import Pose, Rotation, axial_vector
from steelyard.team.hinge.poses import Hinged
from steelyard.team.poses.measured import TeamMotion


def from_twists(first: Array, second: Array) -> Pose:
    """Return the pose of a grasp in another from their twists (T, 6): M in second = M first is Ad^-1 but for noise.

    A hinge's own motion, which M cannot hold, is averaged out of it.
    """
    M = np.linalg.lstsq(first, second, rcond=1e-6)[0].T
    turn = Rotation.nearest(M[:3, :3].T)
    lever = -turn.matrix @ M[3:, :3]
    return Pose(turn, 0.5 * axial_vector(lever))


def first_hinged(
    data: TeamMotion, twist: Array, reference: int, second: Sequence[int], line: tuple[Array, Array]
) -> Hinged:
    """Return a first team; twist (T', N, 6) of all grasps, line (axis, point) of the hinge in grasp second[0]."""
    count = data.count
    made = [Pose.identity() if i == reference else from_twists(twist[:, reference], twist[:, i]) for i in range(count)]
    one = second[0]
    for i in second[1:]:
        # Grasps of the second body hang together better than each with the first.
        made[i] = made[one] @ from_twists(twist[:, one], twist[:, i])
    grasps = Pose.from_matrix(np.array([pose.matrix() for pose in made]))
    held = np.zeros(count, np.bool_)
    held[list(second)] = True
    rows = data.valid[:, reference]
    measured = data.poses[:, reference]
    homes = [Pose.identity()] * count
    for i in range(count):
        both = rows & data.valid[:, i]
        if i != reference and both.any():
            every = (measured[both] @ grasps[i]) @ data.poses[both, i].inverse()
            turn = Rotation.nearest(every.rotation.matrix.mean(0))
            homes[i] = Pose(turn, every.position.mean(0))
    place = Pose.from_matrix(np.array([home.matrix() for home in homes]))
    first = [i for i in range(count) if not held[i]]
    seer = np.array(first)[np.argmax(data.valid[:, first], axis=1)]
    motion = place[seer] @ data.poses[np.arange(len(seer)), seer] @ grasps[seer].inverse()
    axis, point = grasps[one].rotation.apply(line[0]), grasps[one].apply(line[1])
    return Hinged(grasps, place, held, axis, point, motion, np.zeros(len(seer)), np.zeros(count))
