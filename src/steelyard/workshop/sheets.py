"""Thin sheets to try a reconstruction on: channels, plates and open tubes, each with its exact volume."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from steelyard.shape.cloud import Cloud
from steelyard.shape.mesh import TriangleMesh
from steelyard.workshop.sampling import POINTS, spread_evenly
from steelyard.workshop.solids import block, mesh_of, ring

KINDS = ("channel", "plate", "tube")


@dataclass(frozen=True, eq=False)
class Sheet:
    """A thin solid and points of all of its surface.

    name    kind and sizes in millimetres
    mesh    its closed surface [m]
    volume  [m^3]
    cloud   points without colours or normals
    """

    name: str
    mesh: TriangleMesh
    volume: float
    cloud: Cloud


def sheets(count: int = 60, seed: int = 0, points: int = POINTS) -> list[Sheet]:
    """Return `count` thin solids: U channels, flat plates and tubes with open ends, in turn.

    Gaps of 3 to 20 mm, walls of 1.2 to 2 mm (plates: 1 to 2 mm), lengths of 80 to 200 mm. Same seed, same sheets.
    """
    rng = np.random.default_rng(seed)
    return [_sheet(KINDS[k % len(KINDS)], rng, points) for k in range(count)]


def channel(length: float, gap: float, height: float, wall: float) -> Any:
    """Return a U section in millimetres, open at the top and at both ends."""
    outer = block((0, length), (-gap / 2 - wall, gap / 2 + wall), (0, height))
    return outer - block((-1, length + 1), (-gap / 2, gap / 2), (wall, height + 1))


def _sheet(kind: str, rng: np.random.Generator, points: int) -> Sheet:
    length, wall = rng.uniform(80, 200), rng.uniform(1.2, 2)
    if kind == "channel":
        gap, height = rng.uniform(3, 20), rng.uniform(10, 30)
        body, name = channel(length, gap, height, wall), f"channel {length:.0f} gap {gap:.1f} height {height:.0f}"
    elif kind == "plate":
        width, wall = rng.uniform(20, 60), rng.uniform(1, 2)
        body, name = block((0, length), (0, width), (0, wall)), f"plate {length:.0f} x {width:.0f}"
    else:
        across = rng.uniform(8, 40)
        body, name = ring(across / 2, across / 2 - wall, 0, length), f"tube {length:.0f} across {across:.0f}"
    return sheet_of(f"{name} wall {wall:.1f}", body, rng, points)


def sheet_of(name: str, body: Any, rng: np.random.Generator, points: int) -> Sheet:
    """Return a solid in millimetres with `points` points spread evenly over its surface."""
    mesh = mesh_of(body)
    return Sheet(name, mesh, body.volume() * 1e-9, Cloud(spread_evenly(mesh, rng, points)[0]))
