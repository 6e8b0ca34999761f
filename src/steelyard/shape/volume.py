"""The closed volume behind a cloud of surface points: the tetrahedra of its Delaunay complex that lie inside."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.findings import Finding
from steelyard.shape.canonical import canonical
from steelyard.shape.cloud import Cloud
from steelyard.shape.filling import CLEAR, Filled, by_walls, clearer_alone, filled, outward
from steelyard.shape.orient import Oriented, oriented
from steelyard.shape.sides.sheets import torn
from steelyard.shape.sites import Sites
from steelyard.shape.solid import BLURRED, Solid, judged
from steelyard.shape.tets import TetMesh
from steelyard.shape.working_cloud import WorkingCloud, working_cloud
from steelyard.spatial import area_vectors, summed

POINTS = 4000
_UNCLEAR = 0.38  # doubt above which one thickness of the walls is looked for
_FEWER, _LEAST_OF_FEWER = (2, 4), 1000  # one point in so many is tried where noise leaves doubt; not fewer points
_AGAINST = 0.3  # cosine between a point's normal and the solid's surface below which they disagree
_TURNED = 0.25  # of the points: normals that come with a cloud and disagree this often are not used
# Doubt above which normals that come with a cloud may be wrong: thin walls reach 0.44, a tenth of them turned 0.67.
_BY_CHANCE = 0.6
_CLEARER = 0.5  # of that doubt: no more is left without such normals
# Links of sheets between normals that face opposite ways, above which whole patches may be turned (a half, a third or a
# tenth of the points turned: 0.005 and more; right ones 0.003 in most clouds, 0.1 on thin walls), and the share of them
# that is left where points alone tell better.
_TORN, _MENDED = 0.004, 0.8
_PATCHES = 0.05  # of the points: fewer that change sides are walls and gaps too narrow for neighbours, no patches


def enclose(cloud: Cloud, points: int = POINTS, one: bool = False) -> Solid:
    """Return the closed volume behind the points of a surface, with or without normals; nothing is thickened.

    points  more than so many are thinned
    one     whether all are known to be of one object, as views know it; else the largest piece stays of those far apart

    Walls down to about half the spacing keep their thickness; where they could not be told from gaps the finding
    `thin-thickened` says so. Raises BadValue where the points enclose nothing.
    """
    made = _enclosed_by(cloud, points, one)
    return _of_fewer(cloud, min(points, len(cloud)), made, one) if cloud.normals is None else made


def _of_fewer(cloud: Cloud, points: int, made: Solid, one: bool) -> Solid:
    """Return the solid of fewer points where one of noisy points is in doubt; as it was made where that is not clear.

    Noise as large as the spacing makes an orientation collapse. Fewer points lie farther apart, and each is the mean of
    more; walls that are too thin are then so all the more.
    """
    if not _has(made, "thin-thickened"):
        return made
    for most in (points // share for share in _FEWER if points >= share * _LEAST_OF_FEWER):
        used = working_cloud(cloud, most, one=one)
        try:
            coarse, doubt = _made(used) if used.noise else (made, np.inf)
        except BadValue:  # they enclose nothing
            continue
        if doubt < CLEAR and not _has(coarse, "thin-thickened", "surface-open"):
            return coarse
    return made


def _enclosed_by(cloud: Cloud, points: int, one: bool) -> Solid:
    """Return the closed volume behind a cloud, of at most about so many points."""
    used = working_cloud(cloud, points, one=one)
    made, doubt = _made(used)
    if used.along or (doubt < (CLEAR if used.noise else BLURRED) and not (used.noise and _has(made, "surface-open"))):
        return made
    # Averaging clears a noisy cloud, but makes one sheet of two where noise is as large as the wall between is thin.
    other = working_cloud(cloud, points, not used.noise, one)
    if not (used.noise or other.noise):
        return made
    try:
        changed, left = _made(other._replace(noise=max(used.noise, other.noise)))
    except BadValue:  # they enclose nothing
        return made
    if left > doubt or _has(changed, "surface-open") > _has(made, "surface-open"):
        return made
    return changed if used.noise else _as_doubtful(changed, made)


def _as_doubtful(made: Solid, as_given: Solid) -> Solid:
    """Return a solid of few points that were settled, with the doubt that there was about them as they were given."""
    if _has(made, "thin-thickened"):
        return made
    doubts = (finding for finding in as_given.findings if finding.code == "thin-thickened")
    std = max(made.volume_std, as_given.volume_std)
    surface_m = made.surface_m * std / made.volume_std
    return replace(made, findings=(*made.findings, *doubts), volume_std=std, surface_m=surface_m)


def _made(used: WorkingCloud) -> tuple[Solid, float]:
    """Return the closed volume of points that need no more work, and the doubt about it."""
    xyz = used.cloud.xyz
    X_CB, order = canonical(xyz)
    cloud = used.cloud.reordered(order).in_frame(X_CB)
    made, doubt = _enclosed(used._replace(cloud=cloud), Sites.of(cloud))
    normals = np.empty_like(xyz)
    normals[order] = X_CB.inverse().rotation.apply(np.asarray(made.cloud.normals))
    return made.over(used.cloud.with_normals(normals), order), doubt


def _has(made: Solid, *codes: str) -> bool:
    return any(finding.code in codes for finding in made.findings)


def _enclosed(used: WorkingCloud, sites: Sites) -> tuple[Solid, float]:
    """Return the closed volume of points in their canonical frame and order, and the doubt about it.

    No doubt is left that averaging could take where one thickness of all walls was found.
    """
    cloud = used.cloud
    surface, turned = _oriented(cloud, sites)
    found = filled(surface)
    anew = None if cloud.normals is None else _anew(used, surface, found)
    if anew is not None:
        return anew
    surface, found = clearer_alone(surface, found)
    doubt = found.doubt
    if cloud.normals is None and doubt > _UNCLEAR:
        as_found = surface
        surface, found = by_walls(surface, found)
        doubt = doubt if surface is as_found else 0.0
    return judged(used, surface, found, turned), doubt


def _anew(used: WorkingCloud, surface: Oriented, found: Filled) -> tuple[Solid, float] | None:
    """Return the closed volume of points whose normals are not to be trusted, found without them; None where they are.

    Most that turn normals outward turn whole patches inward here and there: neighbours on one sheet then face
    opposite ways along their rims. Normals that views gave have no such patches.
    """
    against = _against(surface, found.solid)
    sites = surface.sites
    if against > _TURNED:
        return _without_normals(used, sites, f"The normals of {100 * against:.0f} % of the points contradict the rest")
    split = 0.0 if used.cloud.seen is not None else _torn(sites, surface.normals)
    if found.doubt <= _BY_CHANCE and split <= _TORN:
        return None
    try:
        why = "The normals contradict one another, and the points alone give a clearer solid"
        anew = _without_normals(used, sites, why)
    except BadValue:  # the points alone enclose nothing
        return None
    if found.doubt > _BY_CHANCE and anew[1] < _CLEARER * found.doubt:
        return anew
    normals = np.asarray(anew[0].cloud.normals)
    left, share = _torn(sites, normals), _apart(normals, surface.normals)
    patches = share > _PATCHES or found.doubt > BLURRED
    return anew if split > _TORN and left < _MENDED * split and patches and anew[1] <= found.doubt else None


def _torn(sites: Sites, normals: Array) -> float:
    return torn(sites.xyz, normals, sites.near.index, sites.sheets()[1])


def _apart(some: Array, others: Array) -> float:
    """Return the share of normals (N, 3) that face another way, once most of both face the same way."""
    turned = float(((some * others).sum(1) < 0).mean())
    return min(turned, 1 - turned)


def _without_normals(used: WorkingCloud, sites: Sites, why: str) -> tuple[Solid, float]:
    """Return the closed volume of points without their normals, with what says so."""
    findings = (*used.findings, Finding.of("normals-flipped", f"{why}; they were found anew."))
    return _enclosed(used._replace(cloud=used.cloud.with_normals(None), findings=findings), sites)


def _oriented(cloud: Cloud, sites: Sites) -> tuple[Oriented, tuple[Finding, ...]]:
    """Return the cloud's surface elements; normals that came with it and all point inward are turned."""
    surface = oriented(cloud, sites)
    turned = outward(surface)
    if turned is surface or cloud.normals is None:
        return turned, ()
    text = "All normals that came with the cloud point into the solid; they were turned."
    return turned, (Finding.of("normals-flipped", text),)


def _against(surface: Oriented, solid: TetMesh) -> float:
    """Return the share of the points whose normals disagree with the surface of the cells inside."""
    skin = solid.surface
    areas = area_vectors(surface.sites.xyz[skin])
    out = summed(skin.ravel(), np.repeat(areas, 3, axis=0), len(surface.normals))
    return float(((out * surface.normals).sum(1) < _AGAINST * np.linalg.norm(out, axis=1)).mean())
