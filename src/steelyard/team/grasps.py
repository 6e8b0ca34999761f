"""Grasps: where every robot holds the payload, seen from one reference grasp."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.spatial import Pose, Rotation, cross


@dataclass(frozen=True, eq=False)
class Grasps:
    """Poses X_RG (N,) of every grasp in the reference grasp R, in the order of `names`; R's own is the identity."""

    names: tuple[str, ...]
    poses: Pose
    reference: str

    def __post_init__(self) -> None:
        if self.poses.batch != (len(self.names),):
            raise BadValue(f"{len(self.names)} robots need as many grasps; got batch shape {self.poses.batch}.")

    @classmethod
    def of(cls, poses: Mapping[str, Pose], reference: str) -> Grasps:
        """Return the grasps of single poses by name."""
        turns = np.array([pose.rotation.matrix for pose in poses.values()])
        places = np.array([pose.position for pose in poses.values()])
        return cls(tuple(poses), Pose(Rotation(turns), places), reference)

    def __getitem__(self, name: str) -> Pose:
        return self.poses[self.names.index(name)]

    def total_wrench(self, wrench: Array) -> Array:
        """Return the sum (T, 6) [N m, N] over the team of wrenches (N, T, 6) given at the grasps, at R's origin."""
        turn, place = self.poses.rotation.matrix, self.poses.position
        force = np.einsum("nij,ntj->nti", turn, wrench[..., 3:])
        moment = np.einsum("nij,ntj->nti", turn, wrench[..., :3])
        levers = cross(np.broadcast_to(place[:, None], force.shape), force)
        return np.asarray(np.concatenate([moment + levers, force], -1).sum(0))
