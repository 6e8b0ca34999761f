"""Known objects from the workshop: a tool, its cloud, and an exact motion of it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from steelyard.check import Array
from steelyard.datasets.known_object import KnownObject, box_in_sensor, unseen_finding
from steelyard.datasets.track import Track
from steelyard.shape.views import Views
from steelyard.simulate.handling import motion_arrays, noise_std
from steelyard.simulate.scanning import scan_mesh
from steelyard.spatial import Pose, Rotation
from steelyard.workshop.finish import painted
from steelyard.workshop.sampling import surface_cloud
from steelyard.workshop.tools import Tool

VIEWS = 36  # as many as the demo's scan
_SENSED = ("time", "rotation_world_from_sensor", "position_world", "force_sensor", "torque_sensor")
# Standard deviations of a robot's position [m] and of its rotation about each axis [rad].
_POSITION_STD, _ROTATION_STD = 5e-5, 1e-4


def scan_of(known: KnownObject, seed: int = 0, count: int = VIEWS) -> tuple[Views, Pose]:
    """Return `count` RGB-D views of the object on a table, drawn from `seed`, and the pose X_SW of their world in S."""
    scan = scan_mesh(known.mesh, seed, count=count)
    return scan.views, known.X_SO @ scan.X_WO.inverse()


def known_object(tool: Tool, seed: int = 0, variant: str = "paper") -> KnownObject:
    """Return the tool with a cloud drawn from `seed` and the handling motion `variant` without noise."""
    cloud = surface_cloud(tool, seed)
    X_SO = tool.X_OS.inverse()
    unseen = unseen_finding(tool.parts, cloud)
    return KnownObject(
        name=tool.name,
        mesh=painted(tool),
        parts=tool.parts,
        part_masses=tool.masses,
        part_materials=tuple(material.name for material in tool.materials),
        truth=tool.truth_in_sensor,
        X_SO=X_SO,
        cloud=cloud,
        box=box_in_sensor(cloud, X_SO),
        track=Track.from_columns(motion_arrays(variant, tool.truth_in_sensor)),
        part_names=tool.part_names,
        gradings=tool.gradings,
        findings=(unseen,) if unseen else (),
    )


def sensed(columns: Mapping[str, Array], noise: str, seed: int, name: str) -> tuple[dict[str, Array], str]:
    """Return the columns of a motion as a robot and its wrist sensor would show them, and in a line what that is.

    columns  those of `motion_arrays` with a body; noise: a scenario of `handling.NOISE`, whose forces and torques are
             taken: accelerations come from the poses
    name     of the object: noise of its own for each, so that means over objects average noise, too
    """
    rng = np.random.default_rng([seed, *name.encode()])
    _, _, force, torque = noise_std(noise)
    out = {name: np.array(columns[name]) for name in _SENSED}
    rows = len(out["time"])
    turns = Rotation.exp(_ROTATION_STD * rng.normal(size=(rows, 3)))
    out["rotation_world_from_sensor"] = out["rotation_world_from_sensor"] @ turns.matrix
    for name, std in (("position_world", _POSITION_STD), ("force_sensor", force), ("torque_sensor", torque)):
        out[name] += std * rng.normal(size=(rows, 3))
    said = (
        f"{noise} noise, seed {seed}: {force:g} N, {torque:g} N m, {1e3 * _POSITION_STD:g} mm and "
        f"{1e3 * _ROTATION_STD:g} mrad per axis and row; no bias"
    )
    return out, said
