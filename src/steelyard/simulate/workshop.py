"""Known objects from the workshop: a tool, its cloud, and an exact motion of it."""

from __future__ import annotations

from steelyard.parts.known import KnownObject, Track, box_in_sensor, unseen_finding
from steelyard.shape.views import Views
from steelyard.simulate.handling import motion_arrays
from steelyard.simulate.scanning import scan_mesh
from steelyard.spatial import Pose
from steelyard.workshop.finish import painted
from steelyard.workshop.sampling import surface_cloud
from steelyard.workshop.tools import Tool

VIEWS = 36  # as many as the demo's scan


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
