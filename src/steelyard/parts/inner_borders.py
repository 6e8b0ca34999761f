"""Where the border between two parts runs inside a thick solid, of which only the surface is seen.

Cells that reach through the solid, from a patch to what lies beyond its border, are cut where the winding number of the
patch is a half.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from steelyard.check import Array, Integers
from steelyard.parts.patch_winding import crossings, lines_around, shares
from steelyard.parts.skin import Skin
from steelyard.shape.cells.cut_cells import crossing_edges, cut_cells
from steelyard.shape.pairs import distinct_pairs, joined
from steelyard.shape.points.spacing import nearest
from steelyard.shape.tets import TetMesh

_LONG = 3.0  # median edges of the surface: cells with shorter ones draw the border themselves


@dataclass(frozen=True, eq=False)
class Drawn:
    """T cells of a solid in parts, those cut at borders among them.

    mesh    the solid; places of cuts are vertices behind those there were
    cell    (T,) the cell that each is, or was cut from
    vertex  (T,) a vertex whose part each takes on; -1 where it keeps that of its cell
    """

    mesh: TetMesh
    cell: Integers
    vertex: Integers


@dataclass(frozen=True, eq=False)
class _Cells:
    """Cells that reach from patch to patch.

    mesh       the solid that they make, cuts among its vertices
    cell       (T,) the cell that each is, or was cut from
    patch      (T,) that each belongs to; -1 of cells of a part that no corner has: they keep it
    of_vertex  (V,) the patch of every vertex; of a cut, one of the two that meet there
    """

    mesh: TetMesh
    cell: Integers
    patch: Integers
    of_vertex: Integers


def cut_at_borders(mesh: TetMesh, skin: Skin, labels: Integers, part: Integers) -> Drawn | None:
    """Return a solid with the cells that reach far across borders cut there; None where there are none.

    skin    its boundary
    labels  (T,) part of every cell
    part    (V,) part of every vertex
    """
    long = _LONG * float(np.median(skin.lengths))
    if not len(_long_edges(mesh, part, long, len(part))):
        return None
    patch = _patches(skin, part)
    corners = patch[mesh.tets]
    reaching = (corners != corners[:, :1]).any(1)
    cells = np.flatnonzero(reaching)
    own = part[mesh.tets[cells]] == labels[cells, None]
    first = np.take_along_axis(corners[cells], own.argmax(1)[:, None], 1)[:, 0]
    now, places = (
        _Cells(mesh.chosen(cells), cells, np.where(own.any(1), first, -1), patch),
        crossings(skin, part, long),
    )
    for here, there, beyond in _borders(skin, patch):
        edges = _long_edges(now.mesh, beyond[now.of_vertex].astype(np.int64), long, len(part))
        share = shares(lines_around(skin, places, beyond[patch]), now.mesh.vertices, edges)
        told = ~np.isnan(share)
        if told.any():
            now = _cut_at(now, edges[told], share[told], beyond, (here, there))
    if len(now.cell) == len(cells):
        return None
    of_patch = np.zeros(len(patch), np.int64)
    of_patch[patch] = part
    moved = np.flatnonzero((now.patch >= 0) & (of_patch[now.patch] != labels[now.cell]))
    vertex = np.full(len(mesh) - len(cells) + len(now.cell), -1)
    vertex[len(mesh) - len(cells) + moved] = _nearest(mesh.vertices, patch, now.mesh.centroids[moved], now.patch[moved])
    kept = np.flatnonzero(~reaching)
    solid = TetMesh(now.mesh.vertices, np.concatenate([mesh.tets[kept], now.mesh.tets]))
    return Drawn(solid, np.concatenate([kept, now.cell]), vertex)


def _patches(skin: Skin, part: Integers) -> Integers:
    """Return the patch (V,) of every vertex: vertices of one part that edges of the surface join.

    One that noise put inside is joined to the nearest of its part.
    """
    outer = np.zeros(len(part), np.bool_)
    outer[skin.triangles] = True
    inside = np.flatnonzero(~outer)
    alike = part[skin.near[inside]] == part[inside][:, None]
    own = np.take_along_axis(skin.near[inside], alike.argmax(1)[:, None], 1)
    links = np.concatenate([skin.edges, np.column_stack([inside, own])])
    one, two = part[links].T
    return joined(links[one == two], len(part))


def _borders(skin: Skin, patch: Integers) -> Iterator[tuple[int, int, Any]]:
    """Yield pairs of patches whose border parts the surface in two, and which of the patches (N,) lie beyond it.

    They are found from the ends: a patch with one neighbour has such a border, and the next patch when it is taken off.
    Where three patches meet in a place, none of their borders does.
    """
    one, two = patch[skin.edges].T
    count = int(patch.max()) + 1
    beside: dict[int, set[int]] = {}
    for a, b in distinct_pairs(one[one != two], two[one != two], count).tolist():
        beside.setdefault(a, set()).add(b)
        beside.setdefault(b, set()).add(a)
    beyond = {k: [k] for k in beside}
    ends = [k for k in sorted(beside) if len(beside[k]) == 1]
    while ends:
        there = ends.pop(0)
        if not beside[there]:
            continue
        here = beside[there].pop()
        beside[here].remove(there)
        yield here, there, np.isin(np.arange(count), beyond[there])
        beyond[here] += beyond[there]
        if len(beside[here]) == 1:
            ends.append(here)


def _long_edges(mesh: TetMesh, side: Integers, long: float, count: int) -> Integers:
    """Return the edges (E, 2) between sides (V,) that are longer than `long` [m], and pieces of those that were cut.

    count  of the vertices that are no cuts
    """
    edges = crossing_edges(mesh, side)
    length = np.linalg.norm(mesh.vertices[edges[:, 1]] - mesh.vertices[edges[:, 0]], axis=1)
    return np.asarray(edges[(length > long) | (edges >= count).any(1)])


def _cut_at(now: _Cells, edges: Integers, share: Array, beyond: Any, patches: tuple[int, int]) -> _Cells:
    """Return cells cut at one border, with the nearer of the two `patches` at it where theirs was across.

    edges, share  (E, 2), (E,) where they are cut
    beyond        (N,) which patches lie beyond the border
    """
    cut = cut_cells(now.mesh, edges, share)
    side = np.concatenate([beyond[now.of_vertex].astype(np.int64), np.full(len(edges), -1)])[cut.mesh.tets]
    patch = now.patch[cut.cell]
    lies, known = beyond[patch], patch >= 0
    patch = np.where(known & lies & ~(side == 1).any(1), patches[0], patch)
    patch = np.where(known & ~lies & ~(side == 0).any(1), patches[1], patch)
    of_vertex = np.concatenate([now.of_vertex, np.full(len(edges), patches[0])])
    return _Cells(cut.mesh, now.cell[cut.cell], patch, of_vertex)


def _nearest(vertices: Array, patch: Integers, places: Array, wanted: Integers) -> Integers:
    """Return the vertex (K,) of the patch that is wanted (K,) nearest to each place (K, 3)."""
    out = np.empty(len(places), np.int64)
    for k in np.unique(wanted):
        mine, asked = np.flatnonzero(patch == k), wanted == k
        out[asked] = mine[nearest(vertices[mine], places[asked])]
    return out
