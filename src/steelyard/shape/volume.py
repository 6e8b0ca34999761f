"""The closed volume behind a cloud of surface points: the tetrahedra of its Delaunay complex that lie inside."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding
from steelyard.shape.cloud import Cloud
from steelyard.shape.discs import Discs
from steelyard.shape.orient import DEPTH, Oriented, oriented
from steelyard.shape.tets import TetMesh
from steelyard.shape.winding import Sight, Tree

_NUDGE = 1e-7  # of the diagonal
_FLAT = 1e-4  # volume of a cell, over that of a box of its edges, below which it is a flat leftover
_REACH = 8.0  # a cell whose circumscribed ball is wider than so many spacings is outside
_JUMP = 0.01  # of a spacing: height over which the jump through a disc is spread


@dataclass(frozen=True, eq=False)
class Solid:
    """A closed volume made of tetrahedra over the points of a cloud.

    mesh        the cells inside; its vertices are the points of `cloud`, row by row
    cloud       the points used: the given ones without repeats and thinned, with their outward normals
    sure        (T,) how sure each cell is to lie inside, 0 (could be either) to 1
    volume_std  standard deviation of the volume, as a share of it
    surface_m   standard deviation of where the surface lies [m]
    findings    what one must know about it
    """

    mesh: TetMesh
    cloud: Cloud
    sure: Array
    volume_std: float
    surface_m: float
    findings: tuple[Finding, ...]


def enclose(cloud: Cloud) -> Solid:
    """Return the closed volume behind the points of a surface, with or without normals."""
    surface = oriented(cloud)
    tets, centres, reach = _complex(surface.xyz)
    spacing = surface.spacing
    score = np.full(len(tets), -1.0)
    close = reach < _REACH * spacing
    score[close] = _score(surface, tets[close], centres[close])
    inside = score > 0
    mesh = TetMesh(cloud.xyz, tets[inside])
    return Solid(
        mesh,
        Cloud(cloud.xyz, cloud.rgb, cloud.label, surface.normals),
        np.minimum(score[inside], 1.0),
        0.02,
        0.1 * spacing * cloud.diagonal,
        (),
    )


def _score(surface: Oriented, tets: Any, centres: Array) -> Array:
    """Return how far cells (T,) are inside: winding number less a half, and the mean vote of the corners' normals."""
    targets = Tree.of(centres)
    discs = Discs.on(surface.tree, surface.normals, surface.area, DEPTH, _JUMP * surface.spacing)
    found = targets.back(discs.winding(Sight.of(targets, surface.tree)))
    return np.asarray(np.clip(found, -0.5, 1.5) - 0.5 + _votes(surface, tets, centres))


def _votes(surface: Oriented, tets: Any, centres: Array) -> Array:
    away = centres[:, None] - surface.xyz[tets]
    cosine = np.einsum("tkd,tkd->tk", away, surface.normals[tets]) / np.linalg.norm(away, axis=2)
    return np.asarray(-cosine.mean(1))


def _complex(xyz: Array) -> tuple[Any, Array, Array]:
    """Return the Delaunay cells (T, 4) of points, their centroids (T, 3) and the radii (T,) of their balls."""
    from scipy.spatial import Delaunay

    # Qhull spends most of its time on points in one plane: they are moved by less than any measurement notices.
    moved = xyz + _NUDGE * np.random.default_rng(0).uniform(-1, 1, xyz.shape)
    tets = Delaunay(moved).simplices.astype(np.int64)
    a, b, c, d = np.moveaxis(xyz[tets], 1, 0)
    u, v, w = b - a, c - a, d - a
    across = np.cross(v, w)
    six = np.einsum("td,td->t", u, across)
    solid = np.abs(six) > _FLAT * np.linalg.norm(u, axis=1) * np.linalg.norm(v, axis=1) * np.linalg.norm(w, axis=1)
    tets, u, v, w, across, six = (array[solid] for array in (tets, u, v, w, across, six))
    to_middle = (
        (u**2).sum(1)[:, None] * across
        + (v**2).sum(1)[:, None] * np.cross(w, u)
        + (w**2).sum(1)[:, None] * np.cross(u, v)
    )
    return tets, xyz[tets].mean(1), np.linalg.norm(to_middle, axis=1) / (2 * np.abs(six))
