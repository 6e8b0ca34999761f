"""Where the border between two parts runs inside a thick solid, of which only the surface is seen.

The winding number of a patch of the surface, at a place inside, is the share of all directions in which the patch lies.
It hangs on the border of the patch alone, and on the plane of a flat border it is a half: cells that reach through the
solid, from a patch to what lies beyond its border, are cut there.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np

from steelyard.check import Array, Integers
from steelyard.parts.skin import Skin
from steelyard.shape.cells.cut_cells import crossing_edges, cut_cells
from steelyard.shape.pairs import distinct_pairs, joined
from steelyard.shape.points.spacing import nearest
from steelyard.shape.tets import TetMesh

_LONG = 3.0  # median edges of the surface: cells with shorter ones draw the border themselves
# How far the numbers at both ends of an edge must lie from a half, for the patch to tell. A flush patch reaches 0, one
# that rises by 36 degrees from its border 0.1, half a ball 0.25 and more.
_TELLS = 0.1
_HALVED = 5  # times that a long edge of the surface is halved
_STEPS, _FOUND = 6, 1e-3  # of false position along an edge, and the difference at which it ends


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
        _crossings(skin, part, long),
    )
    for here, there, beyond in _borders(skin, patch):
        edges = _long_edges(now.mesh, beyond[now.of_vertex].astype(np.int64), long, len(part))
        share = _shares(_lines(skin, places, beyond[patch]), now.mesh.vertices, edges)
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


def _crossings(skin: Skin, part: Integers, longest: float) -> Array:
    """Return a place (F, 3, 3) on the edge that starts at each corner of the triangles: the middle, but of long edges
    from one part to another, over `longest` [m], where the nearest vertex is no longer of the part of the first.
    """
    from scipy.spatial import cKDTree

    ends = np.stack([skin.triangles, np.roll(skin.triangles, -1, axis=1)], axis=-1)
    first, last = skin.vertices[ends.min(-1)], skin.vertices[ends.max(-1)]  # alike for both triangles at an edge
    places = (first + last) / 2
    long = np.linalg.norm(last - first, axis=-1) > longest
    long &= part[ends[..., 0]] != part[ends[..., 1]]
    if long.any():
        first, way, mine = first[long], (last - first)[long], part[ends.min(-1)[long]]
        tree, share = cKDTree(skin.vertices, balanced_tree=False, compact_nodes=False), np.zeros(len(first))
        for step in 0.5 ** np.arange(1, _HALVED + 1):
            there = first + (share + step)[:, None] * way
            share += step * (part[tree.query(there)[1]] == mine)
        places[long] = first + (share + step / 2)[:, None] * way
    return np.asarray(places)


def _lines(skin: Skin, places: Array, beyond: Any) -> Array:
    """Return the border of the vertices (V,) that lie beyond it.

    places  (F, 3, 3) where borders cross the edge that starts at each corner of the triangles
    lines   (6, S) both ends of each line, what lies beyond on the left seen from outside
    """
    side = beyond[skin.triangles]
    alone = (side != np.roll(side, 1, axis=1)) & (side != np.roll(side, -1, axis=1))
    after, before, inside = places[alone], np.roll(places, 1, axis=1)[alone], side[alone][:, None]
    ends = np.where(inside, after, before), np.where(inside, before, after)
    return np.ascontiguousarray(np.concatenate(ends, axis=1).T)


@numba.njit(cache=True, nogil=True)
def _shares(lines: Array, vertices: Array, edges: Integers) -> Array:
    """Return how far along each edge (E, 2) to beyond the number is a half; NaN where its ends do not tell."""
    out, work = np.full(len(edges), np.nan), np.empty((2, lines.shape[1]))
    known = np.full(len(vertices), np.nan)
    for e in range(len(edges)):
        for end in edges[e]:
            if np.isnan(known[end]):
                known[end] = over_half(lines, vertices[end], work)
        begin, way = vertices[edges[e, 0]], vertices[edges[e, 1]] - vertices[edges[e, 0]]
        below, above = known[edges[e, 0]], known[edges[e, 1]]
        if below > -_TELLS or above < _TELLS:
            continue
        low, high = 0.0, 1.0
        for _ in range(_STEPS):
            t = low + (high - low) * below / (below - above)
            out[e], here = t, over_half(lines, begin + t * way, work)
            if abs(here) < _FOUND:
                break
            # What the end that stays is taken for is halved, so that both close in (the Illinois rule).
            if here < 0:
                low, below, above = t, here, above / 2
            else:
                high, below, above = t, below / 2, here
    return out


@numba.njit(cache=True, nogil=True, fastmath={"nsz", "arcp", "contract", "afn", "reassoc"}, error_model="numpy")
def over_half(lines: Any, place: Any, work: Any) -> float:
    """Return the winding number, less a half, at a place (3,) of the patch that lines (6, S) go around; -1/2 to 1/2.

    A line spans a triangle with a point infinitely far off, whose half solid angle is the angle of a complex number.
    The product of these has the sum of the angles, whole turns left out.
    Source: van Oosterom and Strackee, "The solid angle of a plane triangle", 1983.

    work  (2, S or more) is written over
    """
    count = lines.shape[1]
    real, imaginary = work[0], work[1]
    x, y, z = place[0], place[1], place[2]
    for k in range(count):
        ax, ay, az = lines[0, k] - x, lines[1, k] - y, lines[2, k] - z
        bx, by, bz = lines[3, k] - x, lines[4, k] - y, lines[5, k] - z
        a, b = np.sqrt(ax * ax + ay * ay + az * az), np.sqrt(bx * bx + by * by + bz * bz)
        even, odd = a * b + ax * bx + ay * by + az * bz + bz * a + az * b, ax * by - ay * bx
        one = 1 / np.sqrt(even * even + odd * odd + 1e-300)
        real[k], imaginary[k] = even * one, odd * one
    while count > 1:
        half = count // 2
        kept = count - half
        for k in range(half):
            a, b, c, d = real[k], imaginary[k], real[kept + k], imaginary[kept + k]
            real[k], imaginary[k] = a * c - b * d, a * d + b * c
        count = kept
    return float(np.arctan2(-imaginary[0], -real[0]) / (2 * np.pi))
