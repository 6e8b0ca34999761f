"""What a team with standing bases measures, and where everything is."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.logs.log import Integers, Mask
from steelyard.spatial import Pose
from steelyard.team import pose_rows


@dataclass(frozen=True, eq=False)
class TeamMotion:
    """Measured poses of N grasps, each in the home of its robot, at T common times.

    poses  X_HG (T, N); where not `valid` they hold anything finite
    valid  (T, N) whether the robot has a pose at that time
    twist  (T, N, 6) of each grasp in its own axes per second that its stamps are late; None where not asked for
    """

    poses: Pose
    valid: Mask
    twist: Array | None = None

    def rows(self, chosen: Any) -> TeamMotion:
        """Return some of the rows."""
        return TeamMotion(self.poses[chosen], self.valid[chosen], None if self.twist is None else self.twist[chosen])

    @property
    def count(self) -> int:
        """Number of robots."""
        return int(self.valid.shape[1])

    @cached_property
    def patterns(self) -> tuple[Mask, Integers]:
        """Return the different sets of robots that have poses (C, N), and which of them each row (T,) has."""
        if self.valid.all():
            return np.ones((1, self.count), np.bool_), np.zeros(len(self.valid), np.int64)
        found, place = np.unique(self.valid, axis=0, return_inverse=True)
        return found, place.ravel()

    def motion_seen(self, grasps: Pose, homes: Pose) -> Pose:
        """Return the payload (T,) in the reference home as the first robot with a pose at that time sees it."""
        if self.valid[:, 0].all():
            return homes[0] @ self.poses[:, 0] @ grasps[0].inverse()
        first = np.argmax(self.valid, axis=1)
        return homes[first] @ self.poses[np.arange(len(first)), first] @ grasps[first].inverse()

    @cached_property
    def scatter(self) -> list[Array]:
        """Scatter (25 N, 25 N) of the features of every row per pattern; see pose_rows."""
        twist = np.zeros((*self.valid.shape, 6)) if self.twist is None else self.twist
        rows = pose_rows.features(self.poses.rotation.matrix, self.poses.position, twist, self.valid)
        found, place = self.patterns
        if len(found) == 1:
            return [rows.T @ rows]
        chosen = [rows[place == k] for k in range(len(found))]
        return [F.T @ F for F in chosen]


@dataclass(frozen=True, eq=False)
class Team:
    """Where everything is.

    grasps   G (N,) in the reference grasp; the reference's own is the identity
    homes    Z (N,) in the reference home; the reference's own is the identity
    motion   X (T,) the reference grasp in the reference home
    delays   (N,) [s] how late each clock stamps
    """

    grasps: Pose
    homes: Pose
    motion: Pose
    delays: Array
