"""The cloud that a solid is made from: in metres, one object, without repeats, thinned where there is too much."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from steelyard.check import Array, Integers, Mask
from steelyard.errors import BadValue
from steelyard.findings import Finding
from steelyard.shape.cloud import Cloud
from steelyard.shape.pairs import joined
from steelyard.shape.points.known_sides import settled_along
from steelyard.shape.points.left_table import left_table
from steelyard.shape.points.noisy_points import settled
from steelyard.shape.points.spacing import Neighbours, evenly, voxel_side
from steelyard.shape.points.thinning import spread_to

LEAST = 20  # points that can show a solid
_TOO_LONG_M, _TOO_SHORT_M = 5.0, 0.005  # no object that an arm holds is longer, or shorter
_DOUBTFUL_M = 0.1  # shorter than this once read as millimetres: they may have been centimetres or inches
_SAME = 1e-7  # of the diagonal: points nearer than this are one
_FLAT = 1e-4  # of the longest extent: less depth than this is a plane
_DRAWN = 12  # points drawn for each that is kept
_SETTLED = 2  # points brought to the surface for each that is kept
_APART = 6.0  # spacings between the points of two objects, at least
_PIECE = 0.02  # of the points: fewer are no object
_STRAY = 0.1  # of the points: more than this that lie by themselves are no strays
_LINKS = 12  # neighbours by which pieces hang together


class WorkingCloud(NamedTuple):
    """The points to make a solid from, the noise that was averaged out of them [m], and what was done to them.

    along  whether they were moved along normals that came with them
    voxel  side of the voxels whose centres they were [m], 0 where they were none
    """

    cloud: Cloud
    noise: float
    findings: tuple[Finding, ...]
    along: bool = False
    voxel: float = 0.0


def working_cloud(cloud: Cloud, most: int, settle: bool | None = None, one: bool = False) -> WorkingCloud:
    """Return the points to make a solid from, at most about `most`.

    settle  whether noise is averaged out; None where points enough for it must go, or normals tell of it
    one     whether all points are known to be of one object: between its pieces lies surface that was not seen

    Millimetres become metres, repeated points one, strays go, and of several objects the largest stays. Raises
    BadValue where fewer than twenty points remain or all lie in a plane.
    """
    cloud, found = _in_metres(cloud)
    thin = _thinned(_without_repeats(cloud), most, settle)
    cloud, last = _one_object(thin.cloud, one)
    _require_solid(cloud.xyz)
    # What views gave stands on a table that was found and taken away.
    table = left_table(cloud.xyz, cloud.near.spacing) if cloud.seen is None else None
    findings = (*found, *thin.findings, *last, *([table] if table else []))
    return thin._replace(cloud=cloud, findings=findings)


def _in_metres(cloud: Cloud) -> tuple[Cloud, list[Finding]]:
    span = cloud.diagonal
    if span < _TOO_SHORT_M:
        text = f"The points span {1e3 * span:.3g} mm: an object so small cannot be held, but they were read as metres."
        remedy = "Give the points in metres: they seem to have been scaled down once too often."
        return cloud, [Finding("cloud-in-mm", text, remedy)]
    if span <= _TOO_LONG_M or _middle_span(cloud) <= _TOO_LONG_M:
        return cloud, []
    text = (
        f"The points span {span:.4g} m, more than an arm can hold; they were read as millimetres: "
        f"the object is then {span:.3g} mm long."
    )
    if 1e-3 * span < _DOUBTFUL_M:
        text += f" If it is not, they are perhaps centimetres ({10 * span:.3g} mm) or inches ({25.4 * span:.3g} mm)."
    return replace(cloud, xyz=cloud.xyz * 1e-3), [Finding.of("cloud-in-mm", text)]


def _middle_span(cloud: Cloud) -> float:
    """Return the diagonal of the box around nearly all points [m]: a stray point far away is no object's length."""
    return float(np.linalg.norm(np.subtract(*np.percentile(cloud.xyz, (99, 1), axis=0))))


def _without_repeats(cloud: Cloud) -> Cloud:
    step = max(_SAME * cloud.diagonal, 1e-300)
    first = np.unique(np.round((cloud.xyz - cloud.xyz.min(0)) / step), axis=0, return_index=True)[1]
    return cloud if len(first) == len(cloud) else cloud.chosen(np.sort(first))


def _thinned(cloud: Cloud, most: int, settle: bool | None) -> WorkingCloud:
    """Return at most about `most` well-spread points, of a fair draw where there are many more."""
    if len(cloud) <= 1.04 * most:
        voxel = voxel_side(cloud.xyz, cloud.near.index) if len(cloud) >= LEAST else 0.0
        whole = WorkingCloud(cloud, 0.0, (), voxel=voxel)
        if voxel and cloud.normals is None:
            settle = True  # stairs look like walls that face each other
        if settle is False or (cloud.normals is None and not settle):
            return whole
        return _settled(whole, cloud.near.spacing, len(cloud), sheets=bool(settle))
    drawn = np.random.default_rng(0).permutation(len(cloud))[: _DRAWN * most]
    chosen = cloud.chosen(np.sort(drawn))
    kept, apart, third = _spread(chosen, most)
    # Thinning spares strays, which would be many of the points that are left.
    alone = third > _APART * apart
    findings = []
    if 0 < alone.sum() < _STRAY * len(chosen):
        findings = [_strays(int(alone.sum()), len(chosen))]
        chosen = chosen.chosen(~alone)
        kept, apart, _ = _spread(chosen, most)
    drawn_from = WorkingCloud(chosen, 0.0, ())
    if settle is not False:
        drawn_from = _settled(drawn_from, apart, _SETTLED * most)
        if drawn_from.noise:
            kept, apart, _ = _spread(drawn_from.cloud, most)
    text = f"Of {len(cloud)} points {len(kept)} were used, {apart * 1e3:.2g} mm apart."
    findings = [Finding.of("cloud-thinned", text), *drawn_from.findings, *findings]
    return drawn_from._replace(cloud=drawn_from.cloud.chosen(np.sort(kept)), findings=tuple(findings))


def _settled(used: WorkingCloud, apart: float, most: int, sheets: bool = True) -> WorkingCloud:
    """Return at most `most` of the points, brought to the surface they share; as they are if they are not noisy.

    sheets  whether noise is looked for about sheets through neighbours, too, and not by normals alone
    """
    cloud = used.cloud
    rows = evenly(len(cloud), most)
    along = None if cloud.normals is None else settled_along(cloud.xyz, cloud.normals, rows, apart)
    found = settled(cloud.xyz, cloud.normals, rows, apart) if sheets and along is None else along
    if found is None:
        return used
    rows = rows if along is None else along.rows
    text = f"The points have noise of about {found.noise * 1e3:.2g} mm; each was moved to where its neighbours lie."
    findings = (Finding.of("cloud-noisy", text),)
    moved = replace(cloud.chosen(rows), xyz=found.xyz)
    return WorkingCloud(moved, found.noise, findings, along is not None, used.voxel)


def _spread(cloud: Cloud, most: int) -> tuple[Integers, float, Array]:
    """Return about `most` well-spread points, how far apart they lie [m], and each point's third neighbour (N,) [m].

    They keep a distance, which is much less than what lies between most where few points had to go.
    """
    from scipy.spatial import cKDTree

    sides = np.tile([0.0, 0.0, 1.0], (len(cloud), 1)) if cloud.normals is None else cloud.normals
    least = 0.1 * _middle_span(cloud) / np.sqrt(most)
    kept, radius = spread_to(cloud.xyz, sides, np.arange(len(cloud)), most, least)
    third = cKDTree(cloud.xyz).query(cloud.xyz, k=4)[0][:, -1]
    return kept, max(radius, float(np.median(third))), third


def _strays(some: int, of: int) -> Finding:
    lies, were = ("lies", "it was") if some == 1 else ("lie", "they were")
    text = f"{some} of {of} points {lies} far from all others; {were} left out."
    return Finding("outliers", text, "Nothing to do if the scan has stray points.")


def _one_object(cloud: Cloud, one: bool) -> tuple[Cloud, list[Finding]]:
    """Return the largest of the pieces that lie far apart, all where they are known to be `one`; without strays."""
    if len(cloud) < LEAST:
        return cloud, []
    piece = _pieces(cloud.near)
    sizes = np.bincount(piece)
    stray = (sizes < LEAST)[piece]
    if 0 < stray.sum() < _STRAY * len(cloud):
        rest, found = _one_object(cloud.chosen(~stray), one)
        return rest, [_strays(int(stray.sum()), len(cloud)), *found]
    large = np.flatnonzero(sizes >= max(_PIECE * len(cloud), LEAST))
    if one or len(sizes) == 1 or not len(large):
        return cloud, []
    main = int(np.argmax(sizes))
    gap = _gap(cloud.xyz[piece == main], cloud.xyz[piece != main])
    if len(large) == 1 or gap < _APART * cloud.near.spacing:
        return cloud, []
    text = (
        f"The points form {len(large)} pieces, {gap * 1e3:.3g} mm apart; the largest, {sizes[main]} points, was kept."
    )
    return cloud.chosen(piece == main), [Finding.of("several-objects", text)]


def in_small_pieces(near: Neighbours) -> Mask:
    """Return which points (N,) hang together with too few others to be an object."""
    piece = _pieces(near)
    return np.asarray((np.bincount(piece) < LEAST)[piece])


def _pieces(near: Neighbours) -> Integers:
    """Return the piece (N,) of each point, joined where nearest neighbours are not far apart."""
    close = near.distance[:, :_LINKS] < _APART * near.spacing
    return joined(np.column_stack([np.nonzero(close)[0], near.index[:, :_LINKS][close]]), len(near.index))


def _gap(a: Array, b: Array) -> float:
    from scipy.spatial import cKDTree

    return float(cKDTree(a).query(b)[0].min())


def _require_solid(xyz: Array) -> None:
    if len(xyz) < LEAST:
        raise BadValue(f"a solid needs at least {LEAST} different points; got {len(xyz)}. Scan the object again.")
    extent = np.linalg.svd(xyz - xyz.mean(0), compute_uv=False)
    if extent[2] < _FLAT * extent[0]:
        kind = "on a line" if extent[1] < _FLAT * extent[0] else "in a plane"
        raise BadValue(f"all {len(xyz)} points lie {kind}, which encloses nothing. Scan the object from more sides.")
