"""Solids to make tools of, in millimetres: rods, blocks, turned and cut shapes, and chains of hulls."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import manifold3d
import numpy as np

from steelyard.shape.mesh import TriangleMesh

Solid = Any  # manifold3d.Manifold, which has no type information
Point = tuple[float, float]
ROUND = 36  # facets of a full circle
MM = 1e-3  # [m]
SLIVER = 2e-3  # share of a solid's volume below which a piece was left behind by set operations


def rod(radius: float, low: float, high: float, top: float | None = None, facets: int = ROUND) -> Solid:
    """Return a cylinder along z between `low` and `high`, a cone where the radius at the `top` differs."""
    upper = radius if top is None else top
    return manifold3d.Manifold.cylinder(high - low, radius, upper, facets).translate([0, 0, low])


def hexagon(across: float, low: float, high: float) -> Solid:
    """Return a hexagonal rod along z, `across` its flats."""
    return rod(across / np.sqrt(3), low, high, facets=6)


def block(x: Point, y: Point, z: Point) -> Solid:
    """Return a box between low and high of each axis."""
    low, high = zip(x, y, z, strict=True)
    return manifold3d.Manifold.cube(np.subtract(high, low)).translate(low)


def ball(centre: Sequence[float], radii: Sequence[float] | float, facets: int = 24) -> Solid:
    """Return an ellipsoid."""
    return manifold3d.Manifold.sphere(1.0, facets).scale(np.broadcast_to(radii, 3)).translate(centre)


def lathe(profile: Sequence[Point], facets: int = ROUND) -> Solid:
    """Return a turned body around z from a profile of (radius, z), closed along the axis."""
    outline = [(0.0, profile[0][1]), *profile, (0.0, profile[-1][1])]
    return manifold3d.Manifold.revolve(_section(outline), facets)


def prism(outline: Sequence[Point], low: float, high: float) -> Solid:
    """Return a plate of that outline in x, y between `low` and `high` in z."""
    return manifold3d.Manifold.extrude(_section(outline), high - low).translate([0, 0, low])


def ring(outer: float, inner: float, low: float, high: float) -> Solid:
    """Return a tube along z."""
    return rod(outer, low, high) - rod(inner, low - 1, high + 1)


def limb(stations: Sequence[tuple[float, float, float, float, float]]) -> Solid:
    """Return discs (x, y, radius, low, high) with axes along z, joined one to the next by hulls."""
    return chain([rod(r, low, high, facets=20).translate([x, y, 0]) for x, y, r, low, high in stations])


def smooth(stations: Sequence[tuple[float, ...]], between: int = 4) -> Any:
    """Return stations with `between` - 1 more in every gap, on a Catmull-Rom curve through the given ones."""
    given = np.array(stations, float)
    p = np.vstack([2 * given[0] - given[1], given, 2 * given[-1] - given[-2]])
    t = np.linspace(0, 1, between, endpoint=False)[:, None]
    spans = [
        0.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t**2 + (3 * b - a - 3 * c + d) * t**3)
        for a, b, c, d in zip(p[:-3], p[1:-2], p[2:-1], p[3:], strict=True)
    ]
    return [tuple(row) for row in np.vstack([*spans, given[-1:]]).tolist()]


def chain(solids: Sequence[Solid]) -> Solid:
    """Return the union of the hulls of neighbours."""
    return union([manifold3d.Manifold.batch_hull([a, b]) for a, b in pairwise(solids)])


def hull(*solids: Solid) -> Solid:
    """Return the convex hull of all."""
    return manifold3d.Manifold.batch_hull(list(solids))


def union(solids: Sequence[Solid]) -> Solid:
    """Return the union of all; the empty solid of none."""
    return manifold3d.Manifold.batch_boolean(list(solids), manifold3d.OpType.Add)


def rounded(x: Point, y: Point, z: Point, radius: float) -> Solid:
    """Return a box whose edges along z are rounded."""
    corners = [(a, b) for a in (x[0] + radius, x[1] - radius) for b in (y[0] + radius, y[1] - radius)]
    return hull(*(rod(radius, *z, facets=20).translate([*corner, 0]) for corner in corners))


def elbow(across: float, bend: float) -> Solid:
    """Return a quarter bend of a hexagonal bar around the z axis, from the x axis to the y axis, at radius `bend`."""
    angles = np.pi / 3 * np.arange(6) + np.pi / 6
    outline = [(bend + across / np.sqrt(3) * np.cos(a), across / np.sqrt(3) * np.sin(a)) for a in angles]
    return manifold3d.Manifold.revolve(_section(outline), 64, 90.0)


def threaded(radius: float, low: float, high: float, pitch: float, depth: float) -> Solid:
    """Return a rod along z with grooves at the pitch of a thread (rings, not a helix)."""
    turns = max(int((high - low) / pitch), 1)
    step = (high - low) / turns
    profile: list[Point] = []
    for k in range(turns):
        z = low + k * step
        profile += [(radius, z), (radius, z + 0.4 * step), (radius - depth, z + 0.7 * step)]
    return lathe([*profile, (radius, high)], 20)


def knurled(radius: float, low: float, high: float, teeth: int, depth: float) -> Solid:
    """Return a rod along z with flutes along it."""
    return star(radius, radius - depth, teeth, low, high)


def star(outer: float, inner: float, points: int, low: float, high: float) -> Solid:
    """Return a rod along z whose outline goes out and in between two radii, to so many points."""
    angles = np.pi / points * np.arange(2 * points)
    radii = np.where(np.arange(2 * points) % 2, inner, outer)
    return prism([(r * np.cos(a), r * np.sin(a)) for r, a in zip(radii, angles, strict=True)], low, high)


def without_slivers(solid: Solid) -> Solid:
    """Return the solid without pieces and voids below 0.2 % of its volume, which set operations leave behind."""
    pieces = solid.decompose()
    if len(pieces) < 2:
        return solid
    kept = [piece for piece in pieces if abs(piece.volume()) > SLIVER * solid.volume()]
    if len(kept) == len(pieces):
        return solid
    voids = union([_inverted(piece) for piece in kept if piece.volume() < 0])
    return union([piece for piece in kept if piece.volume() > 0]) - voids


def _inverted(solid: Solid) -> Solid:
    """Return the solid whose surface is turned inside out."""
    mesh = solid.to_mesh64()
    return manifold3d.Manifold(
        manifold3d.Mesh64(mesh.vert_properties[:, :3].copy(), np.ascontiguousarray(mesh.tri_verts[:, ::-1]))
    )


def mesh_of(*solids: Solid, unit: float = MM) -> TriangleMesh:
    """Return one mesh [m] of all solids, part k of solid k; `unit` [m] is theirs."""
    meshes = [solid.to_mesh64() for solid in solids]
    first = np.cumsum([0, *(len(mesh.vert_properties) for mesh in meshes)])
    return TriangleMesh(
        unit * np.concatenate([mesh.vert_properties[:, :3] for mesh in meshes]),
        np.concatenate([mesh.tri_verts.astype(np.int64) + n for mesh, n in zip(meshes, first[:-1], strict=True)]),
        np.repeat(np.arange(len(solids)), [len(mesh.tri_verts) for mesh in meshes]),
    )


def _section(outline: Sequence[Point]) -> Any:
    return manifold3d.CrossSection([np.array(outline, float)], manifold3d.FillRule.NonZero)
