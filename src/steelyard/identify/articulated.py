"""Articulated tools: once the masses of the parts are known, another configuration needs no new motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from steelyard.errors import BadValue
from steelyard.identify.estimate import Estimate
from steelyard.inertia import InertialParameters
from steelyard.parts.parts import Parts
from steelyard.spatial import Pose


def moved(estimate: Estimate, parts: Parts, poses: Mapping[int, Pose]) -> Estimate:
    """Return the estimate for parts that have moved: the same masses and covariance, another shape.

    parts  the parts as they were when `estimate` was made, in the frame of the sensor
    poses  label -> the displacement X_SS' of that part, in the frame of the sensor: where p was, X p is now

    Raises BadValue for labels that the object does not have and for an estimate without part masses.
    Source: "The Sum of Its Parts", section VI.
    """
    if estimate.part_covariance is None:
        raise BadValue("This estimate has no part masses; identify the object with its parts first.")
    labels = [int(label) for label in parts.label]
    if labels != [p.label for p in estimate.parts]:
        raise BadValue(f"The estimate has parts {[p.label for p in estimate.parts]}, the shape has {labels}.")
    unknown = sorted(set(poses) - set(labels))
    if unknown:
        raise BadValue(f"There is no part {unknown[0]} to move; the object has parts {labels}.")
    bodies = InertialParameters(parts.moments)
    rows = [bodies[i].in_frame(poses[k]).vector if k in poses else bodies[i].vector for i, k in enumerate(labels)]
    now = Parts(parts.label, np.stack(rows), parts.rgb)
    masses = np.array([p.mass for p in estimate.parts])
    B = now.per_mass
    return replace(
        estimate,
        parameters=now.whole(masses),
        covariance=B @ estimate.part_covariance @ B.T,
        cross_covariance=np.zeros_like(estimate.cross_covariance),
        parts=tuple(replace(p, centroid=c) for p, c in zip(estimate.parts, now.centroid, strict=True)),
        notes=(*estimate.notes, f"parts {sorted(poses)} were moved after the masses were found"),
    )
