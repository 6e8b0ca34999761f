"""A tool: solids that touch and share no space, each of one material, and where a robot grasps it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.inertia import InertialParameters
from steelyard.parts.from_mesh import parts_of_mesh
from steelyard.parts.parts import Parts
from steelyard.shape.mesh import TriangleMesh
from steelyard.spatial import Pose, Rotation
from steelyard.workshop.draw import Draw
from steelyard.workshop.materials import Colour, Material
from steelyard.workshop.solids import MM, Solid, mesh_of, union, without_slivers

Finish = Literal["even", "scuffed", "shaded"]
_AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1), "-x": (-1, 0, 0), "-y": (0, -1, 0), "-z": (0, 0, -1)}


@dataclass(frozen=True, eq=False)
class Piece:
    """One part while a tool is made: a solid in mm, its material, its colour (None: a usual one of the material)."""

    name: str
    solid: Solid
    material: Material
    rgb: Colour | None = None


@dataclass(frozen=True)
class Grasp:
    """Where the sensor frame S sits on the tool.

    point     origin of S in the tool's frame [mm]
    along     axis of the tool's frame that S's y axis points along
    approach  axis of the tool's frame that S's z axis points along
    """

    point: tuple[float, float, float]
    along: str = "z"
    approach: str = "y"

    def pose(self) -> Pose:
        """Return X_OS, the pose of S in the tool's frame O [m]."""
        y, z = np.array(_AXES[self.along], float), np.array(_AXES[self.approach], float)
        return Pose(Rotation(np.stack([np.cross(y, z), y, z], axis=1)), MM * np.array(self.point, float))


@dataclass(frozen=True, eq=False)
class Tool:
    """A tool in its own frame O, metres.

    name       slug
    mesh       closed surfaces; part k is bounded by the triangles with part == k; flat colours
    parts      the P solids, labels 0..P-1
    part_names (P,) what each part is
    materials  (P,)
    densities  (P,) [kg/m^3], the mean over each part
    X_OS       pose of the sensor frame in O
    finish     how the surface looks: "even", "scuffed" or "shaded"
    gradings   (P,) how the density changes within each part, "" where it is even; empty where all are
    graded_moments  (P, 10) the ten parameters of each part in O where some are not even; None where all are
    """

    name: str
    mesh: TriangleMesh
    parts: Parts
    part_names: tuple[str, ...]
    materials: tuple[Material, ...]
    densities: Array
    X_OS: Pose
    finish: Finish = "even"
    gradings: tuple[str, ...] = ()
    graded_moments: Array | None = None

    @property
    def masses(self) -> Array:
        """True mass (P,) of each part [kg]."""
        return self.densities * self.parts.volume

    @property
    def truth(self) -> InertialParameters:
        """The whole tool in O: the sum over its parts of density times volume moments."""
        if self.graded_moments is not None:
            return InertialParameters(self.graded_moments.sum(0))
        return InertialParameters(self.densities @ self.parts.moments)

    @property
    def truth_in_sensor(self) -> InertialParameters:
        """The whole tool in S."""
        return self.truth.in_frame(self.X_OS.inverse())


def make_tool(
    name: str,
    pieces: Sequence[Piece],
    grasp: Grasp,
    draw: Draw,
    *,
    finish: Finish = "even",
    one_colour: Colour | None = None,
) -> Tool:
    """Return the tool of `pieces`: each gives way to those named before it, so that parts only touch.

    one_colour  paints the whole tool
    """
    solids = apart([piece.solid for piece in pieces])
    for piece, solid in zip(pieces, solids, strict=True):
        if solid.volume() <= 0:
            raise BadValue(f"{name}: nothing is left of the part '{piece.name}' once the parts before it are cut out.")
    colours = [one_colour or piece.rgb or draw.colour(piece.material) for piece in pieces]
    mesh = mesh_of(*solids)
    mesh = replace(mesh, rgb=np.array(colours, np.uint8)[mesh.part])
    return Tool(
        name=name,
        mesh=mesh,
        parts=parts_of_mesh(mesh),
        part_names=tuple(piece.name for piece in pieces),
        materials=tuple(piece.material for piece in pieces),
        densities=np.array([draw.density(piece.material) for piece in pieces]),
        X_OS=grasp.pose(),
        finish=finish,
    )


def scaled(k: float, pieces: Sequence[Piece]) -> list[Piece]:
    """Return the pieces with all lengths times `k`."""
    return [replace(piece, solid=piece.solid.scale([k, k, k])) for piece in pieces]


def apart(solids: Sequence[Solid]) -> list[Solid]:
    """Return the solids, from each those before it cut out."""
    left: list[Solid] = []
    for solid in solids:
        left.append(without_slivers(solid - union(left)) if left else solid)
    return left
