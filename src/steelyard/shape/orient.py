"""Outward normals of a cloud that has none, without a mesh: winding-number normal consistency, and flat sheets."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.shape.cloud import Cloud
from steelyard.shape.points.spacing import areas
from steelyard.shape.sides.discs import Discs
from steelyard.shape.sides.layers import Layers
from steelyard.shape.sides.ties import Ties
from steelyard.shape.sides.tree import Tree
from steelyard.shape.sides.walls import Wall
from steelyard.shape.sides.winding import Sight
from steelyard.shape.sites import Sites

DEPTH = 0.4  # of a disc, in sides of the square that it stands for
_STEPS = 15
_WIDEST, _NARROWEST = 2.0, 0.25  # width of the softened dipoles, first and last, in spacings
# One block of points in so many gives the length of a step, but no fewer blocks: those of a wire's 300 points tell a
# length by chance, and steps grew beyond all numbers.
_SAMPLED, _FEWEST = 4, 32
_SIGN_STEPS = 10
_FREE = 4  # steps before signs are driven to plus or minus one
_SWEEPS, _KEPT = 4, 0.3
_LAST_SWEEPS, _LAST_KEPT = 10, 2.0  # of the last look at signs: a normal turns where at least two ties deny it
_LINKED, _WALLED = 3.0, 0.5  # links of a point that lies on a sheet; the same where the thickness of walls is known
_CERTAIN = 0.3  # of a sign
_EDGE = 0.5  # width, in spacings, of the field that gives the normals off the sheets
_EDGE_STEPS = 6
_SPREAD_AREA = 1.5  # area per point in squared spacings where two sheets lie close
_JUMP = 0.1  # of a spacing: height over which the jump through a disc is spread


@dataclass(frozen=True, eq=False)
class Oriented:
    """The points of a cloud as oriented elements of a surface, in units of their diagonal.

    sites    the points
    normals  (N, 3) unit vectors that leave the solid
    alone    (N, 3) the normals before any sheet was looked at; None where the cloud brought its own
    layers   of its walls, where these are thinner than the spacing
    """

    sites: Sites
    normals: Array
    alone: Array | None = None
    layers: Layers | None = None

    @cached_property
    def area(self) -> Array:
        """Surface (N,) that each point stands for."""
        return areas(self.sites.near, self.normals)

    def walled(self) -> Oriented | None:
        """Return the surface with its sides anew from the thickness of its walls; None where they have no one."""
        sites, layers = self.sites, self.layers
        wall = Wall.of(sites.xyz, self.normals, *sites.sheets(layers), sites.delaunay, sites.spacing)
        if wall is None:
            return None
        return Oriented(sites, on_sheets(sites, self.normals, wall, layers), self.alone, layers)


def oriented(cloud: Cloud, sites: Sites | None = None) -> Oriented:
    """Return the surface elements of a cloud; normals that it carries are kept.

    sites  its points, where they are known already
    """
    sites = sites or Sites.of(cloud)
    if cloud.normals is not None:
        return Oriented(sites, cloud.normals)
    alone = consistent(sites.sight, sites.spacing)
    layers = Layers.of(sites.xyz, sites.near.index, sites.spacing)
    return Oriented(sites, on_sheets(sites, alone, None, layers), alone, layers)


def consistent(sight: Sight, spacing: float) -> Array:
    """Return unit normals (N, 3) that agree with the winding number they make, for a cloud that sees itself.

    Each step moves the dipoles toward a winding number of 1/2 at every point, then turns them against the gradient of
    that number, lengths kept; the softening narrows from step to step. Source: Lin, Shi, Liu 2024, algorithm 1.
    """
    tree, every = sight.sources, _every(sight.targets)
    sampled = sight.targets.of_blocks(every)
    dipoles: Any = np.zeros((3, len(tree.order)), np.float32)
    found: Any = np.zeros(len(tree.order), np.float32)
    for width in spacing * np.linspace(_WIDEST, _NARROWEST, _STEPS):
        push = sight.adjoint(np.float32(0.5) - found, width)
        moved = sight.winding(push, width, every)
        dipoles = dipoles + _length(push, moved[sampled]) * push
        found, gradient = sight.winding_and_gradient(dipoles, width)
        dipoles = -np.linalg.norm(dipoles, axis=0) * _units(gradient)
    return np.asarray(tree.back(_units(dipoles)).T, np.float64)


def on_sheets(sites: Sites, first: Array, wall: Wall | None = None, layers: Layers | None = None) -> Array:
    """Return unit normals (N, 3), those of points on flat pieces of surface decided piece by piece.

    In a wall thinner than the spacing the dipoles of both sheets cancel. Flat discs do not: their signs are moved
    toward a winding number of 1/2 at every point and spread along each sheet and across to those that face it, in
    turn. Points off them, as on edges, are then found anew, with the sheets as they are. Where all walls are of one
    thickness, what lies between sheets so far apart is in the solid; where they are two layers, these face apart.
    """
    xyz, near, sight, spacing = sites.xyz, sites.near, sites.sight, sites.spacing
    tree, order, every = sites.tree, sites.tree.order, _every(sites.tree)
    sampled = tree.of_blocks(every)
    plane, link = sites.sheets(layers)
    ties = Ties.of(xyz, plane, near.index, link, sites.delaunay, spacing)
    if wall:
        ties = ties.told(wall.outward(plane))
    sign = ties.spread(np.sign((plane * first).sum(1)), _SWEEPS, _KEPT)
    discs = Discs.on(tree, plane, np.full(len(xyz), _SPREAD_AREA * spacing**2), DEPTH, _JUMP * spacing).response(sight)
    for step in range(_SIGN_STEPS):
        push = discs.adjoint(np.float32(0.5) - discs.winding(sign[order]))
        sign[order] += _length(push, discs.winding(push, every)[sampled]) * push
        sign = ties.spread(np.clip(sign, -1, 1), _SWEEPS, _KEPT)
        if step >= _FREE:
            sign = np.clip(2 * sign, -1, 1)
    flat = (np.abs(link).sum(1) > (_WALLED if wall else _LINKED)) & (np.abs(sign) > _CERTAIN)
    normals = np.where(flat[:, None], np.sign(sign)[:, None] * plane, first)
    ties = ties_between(sites, normals, layers)
    if wall:
        ties = ties.told(wall.outward(normals))
    normals *= ties.settled(_LAST_SWEEPS, _LAST_KEPT)[:, None]
    return _off_sheets(normals, flat, areas(near, normals), sight, _EDGE * spacing)


def _off_sheets(normals: Array, flat: Any, area: Array, sight: Sight, width: float) -> Array:
    """Return unit normals (N, 3), those of points off the sheets from the dipoles that these lack to a number of 1/2.

    Where both sheets of a wall cancel, the normals on its edges were found beside nothing; the sheets now have their
    sides. Steps are those of `consistent`, at one width.
    """
    tree, order = sight.sources, sight.sources.order
    free: Any = np.float32(~flat[order])
    dipoles: Any = np.ascontiguousarray((normals * area[:, None])[order].T, np.float32)
    sheets, dipoles = (np.float32(1) - free) * dipoles, free * dipoles
    found = sight.winding(sheets + dipoles, width)
    for _ in range(_EDGE_STEPS):
        push = free * sight.adjoint(np.float32(0.5) - found, width)
        dipoles = dipoles + _length(push, sight.winding(push, width)) * push
        found, gradient = sight.winding_and_gradient(sheets + dipoles, width)
        dipoles = -free * np.linalg.norm(dipoles, axis=0) * _units(gradient)
    return np.where(flat[:, None], normals, tree.back(_units(dipoles)).T)


def ties_between(sites: Sites, normals: Array, layers: Layers | None) -> Ties:
    """Return what points say of one another's sides once their normals (N, 3) are known; layers as in `Oriented`."""
    plane, link = sites.sheets(layers)
    index, sign = sites.near.index, np.sign((plane * normals).sum(1))
    return Ties.of(sites.xyz, normals, index, link * sign[:, None] * sign[index], sites.delaunay, sites.spacing)


def _every(tree: Tree) -> int:
    """Return which blocks of the points of a tree give the length of a step: one in so many."""
    return min(max((len(tree.blocks) - 1) // _FEWEST, 1), _SAMPLED)


def _length(push: Any, moved: Any) -> np.float32:
    """Return the step along `push` that brings the winding number nearest to 1/2; it moves it by `moved`."""
    return np.float32((push**2).sum() / push.shape[-1] / max(float((moved**2).mean()), 1e-30))


def _units(vectors: Any) -> Any:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=0), 1e-30)
