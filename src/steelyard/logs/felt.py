"""The wrench of a stream as it was given, and what it is in S once it is known how S stood."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array, Integers, Mask
from steelyard.logs.recording import Stream, no_rotation
from steelyard.spatial import Rotation

_PARTS = ("torque", "force")


@dataclass(frozen=True, eq=False)
class Felt:
    """The wrench (N, 6) that the robot applies to the object; a part may still be in W.

    stream  name it is told by
    values  moment and force, each in S or, where `world` names it, in W
    world   which of "torque" and "force" are in W
    arm     (3,) [m] from the S origin, in S, to where moments are about
    dead    channels [tau, f] of S that do not measure
    """

    stream: str
    values: Array
    world: frozenset[str]
    arm: Array
    dead: tuple[bool, ...] = (False,) * 6

    @classmethod
    def of(cls, stream: Stream, sign: int, dead: tuple[bool, ...] = (False,) * 6) -> Felt:
        """Return the wrench of a stream; `sign` +1 where it is on the object, -1 on the sensor."""
        world = frozenset(filter(stream.in_world, _PARTS))
        parts = [stream.channels[part] for part in _PARTS]
        if stream.turn is not None:
            parts = [v if part in world else stream.turn.apply(v) for part, v in zip(_PARTS, parts, strict=True)]
        arm = np.zeros(3) if stream.arm is None else stream.arm
        felt = cls(stream.name, sign * np.concatenate(parts, 1), world, arm, dead)
        # What is all in S is moved to the S origin once and for all.
        return felt if world else replace(felt, values=felt.in_sensor(None), arm=np.zeros(3))

    def rows(self, chosen: Mask | Integers) -> Felt:
        """Return the wrench at some of the rows."""
        return replace(self, values=self.values[chosen])

    def turned_back(self, turn: tuple[float, float, float]) -> Felt:
        """Return what would be felt in S were it not turned by a rotation vector [rad]; a wrench in W is as it is."""
        if self.world or not any(turn):
            return self
        back = Rotation.exp(turn).inverse()
        return replace(self, values=back.apply(self.values.reshape(-1, 3)).reshape(-1, 6))

    def in_sensor(self, rotation: Rotation | None) -> Array:
        """Return the wrench (N, 6) about the S origin in S; `rotation` (N,) turns S into W.

        Raises BadDescription where a part is in W and there is no rotation.
        """
        torque, force = self.values[:, :3], self.values[:, 3:]
        if self.world:
            if rotation is None:
                raise no_rotation(next(p for p in _PARTS if p in self.world), self.stream)
            back = rotation.inverse()
            torque = back.apply(torque) if "torque" in self.world else torque
            force = back.apply(force) if "force" in self.world else force
        elif not self.arm.any():
            return self.values
        return np.concatenate([torque + np.cross(self.arm, force), force], 1)
