"""What a team with standing bases measures, and where everything is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.logs.log import Integers, Mask
from steelyard.logs.runs import distinct_rows
from steelyard.spatial import Pose, Rotation
from steelyard.team.adjoint import moved
from steelyard.team.poses.statistic import scatter
from steelyard.team.stacked import Stretch


@dataclass(frozen=True, eq=False)
class TeamMotion:
    """Measured poses of N grasps, each in the home of its robot, at T common times.

    poses  X_HG (T, N); where not `valid` they hold anything finite
    valid  (T, N) whether the robot has a pose at that time
    twist  (T, N, 6) of each grasp in its own axes per second that its stamps are late; None where not asked for
    share  (T,) how much each row counts; None where all count as one
    """

    poses: Pose
    valid: Mask
    twist: Array | None = None
    share: Array | None = None

    def __post_init__(self) -> None:
        # One layout, one compiled form of what passes over the rows.
        object.__setattr__(self, "valid", np.ascontiguousarray(self.valid))
        if self.twist is not None:
            object.__setattr__(self, "twist", np.ascontiguousarray(self.twist))

    @classmethod
    def of(cls, parts: Sequence[Stretch]) -> TeamMotion:
        """Return the poses of all recordings one after the other.

        Rows that one robot alone saw say nothing of grasps and are kept: the motion is still theirs. Raises
        CannotAnswer where nobody's poses were measured.
        """
        seen = np.concatenate([p.seen for p in parts])
        if not seen.any():
            raise CannotAnswer(
                "the joint fit from poses needs the pose of every grasp in its robot's home; there is none."
            )
        if len(parts) == 1:
            return cls(parts[0].poses, seen)
        place = np.concatenate([p.poses.position for p in parts])
        return cls(Pose(Rotation.joined([p.poses.rotation for p in parts]), place), seen)

    def rows(self, chosen: Any) -> TeamMotion:
        """Return some of the rows."""
        twist, share = (None if x is None else x[chosen] for x in (self.twist, self.share))
        return TeamMotion(self.poses[chosen], self.valid[chosen], twist, share)

    @property
    def twists(self) -> Array:
        """The twists, or (0, N, 6) where they were not asked for."""
        return np.zeros((0, self.count, 6)) if self.twist is None else self.twist

    @property
    def shares(self) -> Array:
        """How much each row (T,) counts."""
        return np.ones(len(self.valid)) if self.share is None else self.share

    @property
    def count(self) -> int:
        """Number of robots."""
        return int(self.valid.shape[1])

    @cached_property
    def complete(self) -> Mask:
        """Rows (T,) in which all robots have poses."""
        return np.asarray(self.valid.all(1))

    @cached_property
    def patterns(self) -> tuple[Mask, Integers]:
        """Return the different sets of robots that have poses (C, N), and which of them each row (T,) has."""
        return distinct_rows(self.valid)

    def motion_seen(self, grasps: Pose, homes: Pose) -> Pose:
        """Return the payload (T,) in the reference home as the first robot with a pose at that time sees it."""
        if self.valid[:, 0].all():
            return homes[0] @ self.poses[:, 0] @ grasps[0].inverse()
        first = np.argmax(self.valid, axis=1)
        return homes[first] @ self.poses[np.arange(len(first)), first] @ grasps[first].inverse()

    @cached_property
    def scatter(self) -> list[Array]:
        """Scatter (25 N, 25 N) of the features of every row per pattern; see `poses.statistic`."""
        found, place = self.patterns
        every = [self] if len(found) == 1 else [self.rows(place == k) for k in range(len(found))]
        return [scatter(r.poses.rotation.matrix, r.poses.position, r.twists, r.valid, r.share) for r in every]


def in_words(noise: Array) -> str:
    """Return the rms over robots of the noise (N, 2) [rad, m] of their turns and places, in deg and mm."""
    turn, place = np.sqrt((noise**2).mean(0))
    return f"{np.rad2deg(turn):.2g} deg and {1e3 * place:.2g} mm"


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

    def moved(self, steps: Array) -> Team:
        """Return the team with grasps, homes and delays a small step (N, 13) on, the motion where it is."""
        grasps, homes = moved(self.grasps, steps[:, :6]), moved(self.homes, steps[:, 6:12])
        return Team(grasps, homes, self.motion, self.delays + steps[:, 12])
