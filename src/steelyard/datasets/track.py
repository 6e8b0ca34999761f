"""An exact motion of a known object: where its sensor was, how it moved, and what it felt."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from steelyard import check
from steelyard.check import Array
from steelyard.errors import BadValue

# Column of Track -> its name in motion.npz.
MOTION: Mapping[str, str] = MappingProxyType({
    "time": "time",
    "rotation": "rotation_world_from_sensor",
    "position": "position_world",
    "velocity": "linear_velocity_sensor",
    "angular_velocity": "angular_velocity_sensor",
    "acceleration": "linear_acceleration_sensor",
    "angular_acceleration": "angular_acceleration_sensor",
    "gravity": "gravity_sensor",
    "force": "force_sensor",
    "torque": "torque_sensor",
})  # fmt: skip


@dataclass(frozen=True, eq=False)
class Track:
    """An exact motion of the sensor frame S with the object in it, N rows; vectors in S axes at that instant.

    time                  (N,) [s]
    rotation              (N, 3, 3) turns S into W
    position              (N, 3) of the S origin in W [m]
    velocity              (N, 3) of the S origin [m/s]
    angular_velocity      (N, 3) [rad/s]
    acceleration          (N, 3) classical, of the S origin, gravity not included [m/s^2]
    angular_acceleration  (N, 3) [rad/s^2]
    gravity               (N, 3) [m/s^2]
    force                 (N, 3) what the sensor applies to the object [N]
    torque                (N, 3) the same, about the S origin [N m]
    """

    time: Array
    rotation: Array
    position: Array
    velocity: Array
    angular_velocity: Array
    acceleration: Array
    angular_acceleration: Array
    gravity: Array
    force: Array
    torque: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "time", check.finite("time", self.time))
        rows = self.time.shape
        object.__setattr__(self, "rotation", check.rotations("rotation", self.rotation))
        for name in list(self.__dataclass_fields__)[2:]:
            values = check.vectors(name.replace("_", " "), getattr(self, name))
            object.__setattr__(self, name, values)
        for name in self.__dataclass_fields__:
            found = getattr(self, name).shape[:1]
            if found != rows:
                raise BadValue(f"every column of a motion needs {rows[0]} rows; {name} has {found[0]}.")

    @classmethod
    def from_columns(cls, columns: Mapping[str, Array]) -> Track:
        """Return the motion of columns (N, ..) named as in motion.npz."""
        return cls(**{field: columns[name] for field, name in MOTION.items()})

    def columns(self) -> dict[str, Array]:
        """Return the columns (N, ..) under their names in motion.npz."""
        return {name: getattr(self, field) for field, name in MOTION.items()}

    def __len__(self) -> int:
        return len(self.time)
