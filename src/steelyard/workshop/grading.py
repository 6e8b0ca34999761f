"""Parts whose density is not even: linear along a direction, or layers of other materials within; exact moments.

Such a part keeps its surface, its label and its colour: from outside it cannot be told from a homogeneous one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.inertia import InertialParameters, forms
from steelyard.shape.mesh import TriangleMesh, part_moments
from steelyard.shape.nesting import body_of
from steelyard.shape.third_moments import third_moments
from steelyard.spatial import Pose, Rotation
from steelyard.workshop.materials import Material
from steelyard.workshop.solids import block, mesh_of
from steelyard.workshop.tools import Tool


@dataclass(frozen=True)
class Fall:
    """A density that falls linearly along `axis` (3,) of the tool's frame, by `share` of its mean over the part."""

    axis: tuple[float, float, float]
    share: float


@dataclass(frozen=True)
class Layer:
    """Another material in the slab of a part between two shares of its length along an axis.

    axis      number of the axis, 0..2, of the tool's frame
    start, end   shares of the part's extent along it, 0..1
    density   [kg/m^3]
    """

    axis: int
    start: float
    end: float
    density: float


@dataclass(frozen=True)
class Grading:
    """What is not even in one part: its name, a linear fall of the density or layers, and words for the file."""

    part: str
    how: Fall | tuple[Layer, ...]
    words: str


def graded(tool: Tool, gradings: Sequence[Grading]) -> Tool:
    """Return the tool with parts that are not homogeneous; name and surface stay.

    Raises BadValue where there is no such part, or a density falls below zero.
    """
    own, words = tool.densities[:, None] * tool.parts.moments, [""] * len(tool.parts)
    for grading in gradings:
        if grading.part not in tool.part_names:
            raise BadValue(f"{tool.name} has no part '{grading.part}'; its parts are: {', '.join(tool.part_names)}.")
        k = tool.part_names.index(grading.part)
        surface = tool.mesh.of_part(int(tool.parts.label[k]))
        density = float(tool.densities[k])
        if isinstance(grading.how, Fall):
            own[k] = density * linear_moments(surface, gradient_of(surface, grading.how))
        else:
            own[k] += layer_moments(surface, grading.how, density)
        words[k] = grading.words
    return replace(tool, graded_moments=own, gradings=tuple(words), densities=own[:, 0] / tool.parts.volume)


def gradient_of(surface: TriangleMesh, fall: Fall) -> Array:
    """Return g (3,) [1/m] of the density rho (1 + g (x - c)) that falls by a share over the length of a surface.

    Raises BadValue where the density would fall below zero.
    """
    axis = np.array(fall.axis) / np.linalg.norm(fall.axis)
    along = (surface.vertices - forms.com(part_moments(surface)[0])) @ axis
    g = -fall.share / np.ptp(along) * axis
    if 1 + min(-fall.share / np.ptp(along) * along) <= 0:
        raise BadValue(f"a density that falls by {100 * fall.share:.3g} % of its mean ends below zero.")
    return np.asarray(g)


def linear_moments(surface: TriangleMesh, gradient: Array) -> Array:
    """Return the ten parameters (10,) of one closed part whose density is 1 + g (x - c), c its centroid, g (3,) [1/m].

    Mass is that of the mean density; the first moment moves by M2 g and the second moments by M3 g, M2 and M3 the
    second and third moments about c.
    """
    even = InertialParameters(part_moments(surface)[0])
    centre = even.com
    pseudo = even.in_frame(Pose(Rotation.identity(), -centre)).pseudo_inertia.copy()
    pseudo[:3, 3] = pseudo[3, :3] = pseudo[:3, :3] @ gradient
    pseudo[:3, :3] += third_moments(surface, centre[None])[0] @ gradient
    return InertialParameters.from_pseudo_inertia(pseudo).in_frame(Pose(Rotation.identity(), centre)).vector


def layer_moments(surface: TriangleMesh, layers: Sequence[Layer], density: float) -> Array:
    """Return what layers of other densities add to the ten parameters (10,) of a part of `density` [kg/m^3]."""
    body, added = body_of(surface, surface.labels.tolist()), np.zeros(10)
    for layer in layers:
        low, high = surface.bounds
        limits = [(float(a) - 1, float(b) + 1) for a, b in zip(low, high, strict=True)]
        reach = high[layer.axis] - low[layer.axis]
        limits[layer.axis] = (
            float(low[layer.axis] + layer.start * reach), float(low[layer.axis] + layer.end * reach)
        )  # fmt: skip
        slab = mesh_of(body ^ block(*limits), unit=1.0)
        added += (layer.density - density) * part_moments(slab)[0]
    return added


def layers(axis: int, stack: Sequence[tuple[float, Material]]) -> tuple[Layer, ...]:
    """Return layers one after the other from the low end: (share of the length, material)."""
    ends = np.cumsum([share for share, _ in stack])
    starts = ends - [share for share, _ in stack]
    return tuple(Layer(axis, float(a), float(b), m.density) for a, b, (_, m) in zip(starts, ends, stack, strict=True))
