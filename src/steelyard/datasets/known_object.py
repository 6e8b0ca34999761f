"""A known object: its mesh, its coloured cloud, its parts and their true masses, and a motion of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.datasets.track import Track
from steelyard.findings import Finding
from steelyard.inertia import InertialParameters
from steelyard.parts.parts import Parts
from steelyard.shape.cloud import Cloud
from steelyard.shape.mesh import TriangleMesh
from steelyard.spatial import Pose


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
