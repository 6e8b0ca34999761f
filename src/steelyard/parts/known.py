"""A known object: its mesh, its coloured cloud, its parts and their true masses, and a motion of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np

from steelyard import check
from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.findings import Finding
from steelyard.inertia import InertialParameters
from steelyard.parts.parts import Parts
from steelyard.shape.cloud import Cloud
from steelyard.shape.mesh import TriangleMesh
from steelyard.spatial import Pose

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


@dataclass(frozen=True, eq=False)
class KnownObject:
    """An object of a data set with its truth.

    name           slug
    mesh           closed surfaces in the object's frame O
    parts          solid parts in O, voids taken away
    part_masses    (P,) true masses of `parts` [kg]; None where they are not known
    part_materials (P,) names of materials, "" where not known
    truth          the whole object in S
    X_SO           pose of O in S
    cloud          points of the visible surface in O
    box            (3,) edges of the object's box along the axes of S, for size-based errors [m]
    track          its exact motion, None where there is none
    part_names     (P,) what each part is; empty where nothing says
    gradings       (P,) how the density changes within each part, "" where it is even; empty where all are
    facts          further entries of the file, as they stand there
    findings       what a reader must know about the files
    """

    name: str
    mesh: TriangleMesh
    parts: Parts
    part_masses: Array | None
    part_materials: tuple[str, ...]
    truth: InertialParameters
    X_SO: Pose
    cloud: Cloud
    box: Array
    track: Track | None = None
    part_names: tuple[str, ...] = ()
    gradings: tuple[str, ...] = ()
    facts: Mapping[str, Any] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()

    @property
    def parts_in_sensor(self) -> Parts:
        """The parts seen from S."""
        return self.parts.in_frame(self.X_SO)

    @property
    def half(self) -> str:
        """Whether uniform density would put the centre of mass within 0.5 mm of the truth: "uniform" or "mixed"."""
        return "uniform" if self.uniform_offset < 0.5e-3 else "mixed"

    @property
    def uniform_offset(self) -> float:
        """How far from the truth uniform density would put the centre of mass [m]."""
        uniform = self.parts_in_sensor.moments.sum(0)
        return float(np.linalg.norm(uniform[1:4] / uniform[0] - self.truth.com))


def unseen_finding(parts: Parts, cloud: Cloud) -> Finding | None:
    """Return the finding `part-unseen` about parts on which no point lies, else None."""
    missing = np.setdiff1d(parts.label, cloud.labels)
    if not len(missing):
        return None
    named = ", ".join(map(str, missing))
    return Finding.of(
        "part-unseen", f"No point of the cloud lies on part {named}: it is hidden or too small to be seen."
    )


def box_in_sensor(cloud: Cloud, X_SO: Pose) -> Array:
    """Return the edges (3,) of the cloud's box in O, turned into S and made positive [m], as the paper's metrics do."""
    return np.asarray(np.abs(X_SO.rotation.apply(np.ptp(cloud.xyz, axis=0))))
