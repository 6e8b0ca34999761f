"""The closed volume behind a cloud of surface points: the tetrahedra of its Delaunay complex that lie inside."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.findings import Finding
from steelyard.shape.cloud import Cloud
from steelyard.shape.discs import Discs
from steelyard.shape.orient import DEPTH, Oriented, oriented
from steelyard.shape.tets import TetMesh
from steelyard.shape.winding import Sight, Tree

POINTS = 4000
_NUDGE = 1e-7  # of the diagonal
_FLAT = 1e-4  # volume of a cell, over that of a box of its edges, below which it is a flat leftover
_JUMP = 0.01  # of a spacing: height over which the jump through a disc is spread
_BARE = 0.62  # area that the points stand for over that of the solid: below this some surface has no points of its own
_AGAINST = 0.3  # cosine between a point's normal and the solid's surface below which they disagree
_DISAGREE = 0.1  # of the points: more than this disagree only where walls could not be told apart
_LONG = 5.0  # spacings: triangles of the solid with longer edges are slivers along its hull, or bridge a hole
_OPEN = 0.07  # length of the sum of all areas as vectors, over the sum of their sizes: 0 for a closed surface
_TURNED = 0.25  # of the points: normals that come with a cloud and disagree this often are not used
_STD, _UNSURE, _THIN, _HOLE = 0.025, 0.1, 0.5, 1.0  # standard deviations of the volume: of any, per share of ...


@dataclass(frozen=True, eq=False)
class Solid:
    """A closed volume made of tetrahedra over the points of a cloud.

    mesh        the cells inside; its vertices are the points of `cloud`, row by row
    cloud       the points used [m]: the given ones without repeats and thinned, with their outward normals
    sure        (T,) how sure each cell is to lie inside, 0 (could be either) to 1
    volume_std  standard deviation of the volume, as a share of it
    surface_m   standard deviation of where the surface lies, all of it moved alike [m]
    findings    what one must know about it
    """

    mesh: TetMesh
    cloud: Cloud
    sure: Array
    volume_std: float
    surface_m: float
    findings: tuple[Finding, ...]


def enclose(cloud: Cloud, points: int = POINTS) -> Solid:
    """Return the closed volume behind the points of a surface, with or without normals; nothing is thickened.

    points  more than so many are thinned

    Walls down to about half the spacing keep their thickness; where they could not be told from gaps the finding
    `thin-thickened` says so. Raises BadValue where the points enclose nothing.
    """
    from steelyard.shape.working_cloud import working_cloud

    used, findings = working_cloud(cloud, points)
    surface, turned = _oriented(used)
    tets, score = _complex(surface)
    if not (score > 0).any():
        raise BadValue(
            "the points enclose nothing: no side of their surface is inside. Scan the object from all sides."
        )
    against, bare, gap = _fit(surface, tets[score > 0])
    if used.normals is not None and against > _TURNED:
        text = f"The normals of {100 * against:.0f} % of the points contradict the rest; they were found anew."
        again = enclose(replace(used, normals=None), points)
        return replace(again, findings=(*findings, Finding.of("normals-flipped", text), *again.findings))
    return _solid(used, surface, tets, score, (*findings, *turned), (against, bare, gap))


def _oriented(cloud: Cloud) -> tuple[Oriented, tuple[Finding, ...]]:
    """Return the cloud's surface elements; normals that came with it and all point inward are turned."""
    surface = oriented(cloud)
    if (surface.area * (surface.normals * surface.xyz).sum(1)).sum() >= 0:
        return surface, ()
    text = "All normals that came with the cloud point into the solid; they were turned."
    found = (Finding.of("normals-flipped", text),) if cloud.normals is not None else ()
    return replace(surface, normals=-surface.normals), found


def _complex(surface: Oriented) -> tuple[Any, Array]:
    """Return the Delaunay cells (T, 4) of the points, and how far each is inside (T,), above zero."""
    from scipy.spatial import Delaunay

    # Qhull spends most of its time on points in one plane: they are moved by less than any measurement notices.
    xyz = surface.xyz
    moved = xyz + _NUDGE * np.random.default_rng(0).uniform(-1, 1, xyz.shape)
    tets = Delaunay(moved).simplices.astype(np.int64)
    a, b, c, d = np.moveaxis(xyz[tets], 1, 0)
    u, v, w = b - a, c - a, d - a
    six = np.abs((np.cross(u, v) * w).sum(1))
    tets = tets[six > _FLAT * np.sqrt((u**2).sum(1) * (v**2).sum(1) * (w**2).sum(1))]
    return tets, _score(surface, tets, xyz[tets].mean(1))


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


def _fit(surface: Oriented, inside: Any) -> tuple[float, float, float]:
    """Return how well the cells inside fit the points.

    The share of the points on the solid's surface whose normals disagree with it, the area that the points stand for
    over that of the solid, and the vector area that the points leave open over the sum of their areas.
    """
    skin = TetMesh(surface.xyz, inside).surface
    corners = surface.xyz[skin]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(across, axis=1) / 2
    out = np.zeros(surface.xyz.shape)
    for k in range(3):
        np.add.at(out, skin[:, k], across)
    length = np.linalg.norm(out, axis=1)
    on = length > 0
    cosine = (out[on] * surface.normals[on]).sum(1) / length[on]
    sampled = area[np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(1) < _LONG * surface.spacing]
    gap = np.linalg.norm((surface.area[:, None] * surface.normals).sum(0)) / surface.area.sum()
    return float((cosine < _AGAINST).sum() / len(on)), float(surface.area.sum() / max(sampled.sum(), 1e-30)), float(gap)


def _solid(
    cloud: Cloud,
    surface: Oriented,
    tets: Any,
    score: Array,
    findings: tuple[Finding, ...],
    fit: tuple[float, float, float],
) -> Solid:
    inside = score > 0
    mesh = TetMesh(cloud.xyz, tets[inside])
    sure = np.minimum(2 * score[inside], 1.0)
    against, bare, gap = fit
    thin, hole = bare < _BARE or against > _DISAGREE, gap > _OPEN
    if thin:
        text = (
            f"Walls about as thin as half the spacing of the points ({surface.spacing * cloud.diagonal * 1e3:.2g} mm) "
            f"could not be told from the gaps beside them: {100 * against:.0f} % of the points contradict the surface "
            f"of the solid, which has {1 / bare:.1f} times the area that they stand for."
        )
        findings += (Finding.of("thin-thickened", text),)
    if hole:
        text = (
            f"The surface does not close: what faces one way misses {100 * gap:.0f} % of the whole on the other side."
        )
        findings += (Finding.of("surface-open", text),)
    unsure = float((mesh.volumes * (1 - sure)).sum() / mesh.volume)
    std = np.sqrt(_STD**2 + (_UNSURE * unsure) ** 2 + (_THIN * thin) ** 2 + (_HOLE * gap * hole) ** 2)
    area = float(surface.area.sum()) * cloud.diagonal**2
    kept = replace(cloud, normals=surface.normals)
    return Solid(mesh, kept, sure, float(std), float(std) * mesh.volume / area, findings)
