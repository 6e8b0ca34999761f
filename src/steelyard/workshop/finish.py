"""How a surface looks: even, scuffed by use, or shaded by one-sided light."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.check import Array
from steelyard.shape.eight_bits import Colours
from steelyard.shape.mesh import TriangleMesh
from steelyard.spatial import area_vectors, unit_vectors
from steelyard.workshop.tools import Finish, Tool

_SCUFF = np.array([150.0, 148.0, 144.0])
_LAMP = np.array([0.3, -0.5, 0.81])
_WAVES, _FINEST = 12, 0.012  # waves of the scuff pattern, and the shortest of them [m]


def painted(tool: Tool) -> TriangleMesh:
    """Return the tool's mesh with its finish on every triangle."""
    mesh, corners = tool.mesh, tool.mesh.corners
    normals = unit_vectors(area_vectors(corners))
    return replace(mesh, rgb=finished(tool.finish, corners.mean(1), normals, mesh.colours))


def finished(finish: Finish, xyz: Array, normal: Array, rgb: Colours) -> Colours:
    """Return the colours (N, 3) at points `xyz` (N, 3) [m] with unit normals (N, 3), from the flat colours.

    The pattern is fixed in the tool's frame, so mesh and cloud agree.
    """
    if finish == "even":
        return rgb
    colour = rgb.astype(np.float64)
    if finish == "shaded":
        colour *= (0.72 + 0.36 * (normal @ _LAMP))[:, None]
    else:
        worn = _pattern(xyz)[:, None]
        colour = (1 - 0.75 * worn) * colour + 0.75 * worn * _SCUFF
    return np.clip(np.round(colour), 0, 255).astype(np.uint8)


def _pattern(xyz: Array) -> Array:
    """Return how worn each point is (N,), 0..1: a fixed sum of waves, clipped to patches."""
    rng = np.random.default_rng(7)
    direction = rng.normal(size=(_WAVES, 3))
    wave = 2 * np.pi / (_FINEST * rng.uniform(1, 4, _WAVES))
    phase = rng.uniform(0, 2 * np.pi, _WAVES)
    value = np.sin(xyz @ (unit_vectors(direction) * wave[:, None]).T + phase).sum(1) / np.sqrt(_WAVES / 2)
    return np.asarray(np.clip(1.6 * (value - 0.75), 0, 1))
