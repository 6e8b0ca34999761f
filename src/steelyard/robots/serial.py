"""A serial arm: the pose of its last frame in its base from the positions of its joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from steelyard import check
from steelyard.check import Array
from steelyard.spatial import Pose, Rotation

Kind = Literal["revolute", "prismatic", "fixed"]


@dataclass(frozen=True, eq=False)
class Joint:
    """A joint: its frame at zero in the frame before it, and the unit axis (3,) that it moves about or along."""

    name: str
    kind: Kind
    origin: Pose
    axis: Array

    def pose(self, position: Array) -> Pose:
        """Return the pose (N,) of the frame behind the joint in the one before it, at positions (N,) [rad] or [m]."""
        moved = position[:, None] * self.axis
        if self.kind == "revolute":
            return self.origin @ Pose(Rotation.exp(moved), np.zeros_like(moved))
        return self.origin @ Pose(Rotation.identity(len(moved)), moved)


@dataclass(frozen=True, eq=False)
class SerialArm:
    """The joints from the base to a frame, in order."""

    joints: tuple[Joint, ...]

    @property
    def moving(self) -> tuple[Joint, ...]:
        """The joints that are not fixed."""
        return tuple(joint for joint in self.joints if joint.kind != "fixed")

    def pose(self, positions: ArrayLike) -> Pose:
        """Return poses (N,) of the last frame in the base, at positions (N, n) of the moving joints [rad] or [m]."""
        moving = self.moving
        q = check.vectors("joint positions", positions, len(moving))
        pose = Pose.identity(len(q))
        for joint in self.joints:
            pose = pose @ (joint.origin if joint.kind == "fixed" else joint.pose(q[:, moving.index(joint)]))
        return pose
