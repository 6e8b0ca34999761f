"""The tree of pieces by seams: which two clusters are one part rather, and what it costs to say that they are.

Between two clusters of one colour a seam shows where three things agree:
* their union is hollow: hull(a u b) - v_a - v_b over the whole volume (eq. 8 of "The Sum of Its Parts");
* the surface turns up across the border, on the mean around it. At a bend it turns up inside and down outside, which
  cancels whatever the radius; where an arm leaves a body or a screw a nut, it turns up all around;
* the contact is a neck: small against the smaller cluster. A rib or flange is joined along its whole length.
Their product is the cost of keeping the two together. Colours are joined last, at the cost of the surface painted over.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numba
import numpy as np

from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.parts.hierarchy import Hierarchy
from steelyard.parts.skin import Skin
from steelyard.shape.hull import TOLERANCE, hull_volume, hull_work
from steelyard.shape.mesh import Integers
from steelyard.shape.tets import TetMesh

STRAIGHT, CREASED = 0.1, 0.4  # mean turn [rad] across a border that is no seam, and that is one
NECK, FLANK = 1.0, 2.0  # contact area over (volume of the smaller)^(2/3): a cube cut in half has 1.6
PAINT = 10.0  # cost of painting over all of the surface: a hundredth of it is worth a part
_SIZE = 0.02  # small clusters first (as in clustering.Hollow)
_ACROSS = 100.0  # colours are joined after everything else
_TOUCHING, _APART = 1, 0
# Columns of the table of contacts between two clusters.
_AREA, _VECTOR, _LENGTH, _TURN = 0, 1, 4, 10  # scalar, 3, 6 and 6 numbers
_WIDTH = 16


@dataclass(frozen=True, eq=False)
class SeamTree:
    """The tree, and what keeping each merge costs.

    hierarchy  the pieces and their merges
    seam       (N-1,) cost of a part that holds both sides of the merge, of the order of the worth of a part
    """

    hierarchy: Hierarchy
    seam: Array


def seam_tree(
    mesh: TetMesh, skin: Skin, piece: Integers, colour: Integers, pairs: Integers, corners: Integers
) -> SeamTree:
    """Return the tree of pieces (T,) with colours (N,); pairs and corners as `pieces.inner_faces` gives them."""
    count = len(colour)
    used = np.unique(mesh.tets)
    middle, scale = mesh.vertices[used].mean(0), mesh.volume ** (1 / 3)
    xyz = np.ascontiguousarray((mesh.vertices - middle) / scale)
    contact = _contacts(xyz, skin, piece, count, pairs, corners, scale)
    touch = contact[:, :, _AREA] > 0
    _join_by_corners(mesh, piece, touch)
    key = np.unique(np.repeat(piece, 4) * len(xyz) + mesh.tets.ravel())
    owner, member = np.divmod(key, len(xyz))
    start = np.searchsorted(owner, np.arange(count + 1))
    share = np.bincount(piece[skin.cell], skin.areas, count) / max(float(skin.areas.sum()), 1e-300)
    volume = np.bincount(piece, mesh.volumes, count) / mesh.volume
    merges, cost, seam, node_volume, hull, faults = _merge(
        xyz, start, member.astype(np.int64), volume, share, colour.astype(np.int64), contact, touch, TOLERANCE * 10
    )
    if faults:
        raise BadValue(f"{faults} convex hulls of this solid came out open; report it with the mesh.")
    whole = mesh.volume
    return SeamTree(Hierarchy(piece, merges, cost, node_volume * whole, hull * whole), seam)


def _contacts(
    xyz: Array, skin: Skin, piece: Integers, count: int, pairs: Integers, corners: Integers, scale: float
) -> Array:
    """Return for every two pieces (N, N, 16): contact area, its vector sum, and sums along their common border.

    The border's sums are of edge length l over d d^T and of l times the turn over d d^T, d the unit vector across: with
    them, the mean turn along any direction is known, for any union of pieces.
    """
    table = np.zeros((count, count, _WIDTH))
    ends = piece[pairs]
    apart = ends[:, 0] != ends[:, 1]
    a, b, c = (xyz[corners[apart, k]] for k in range(3))
    vector = np.cross(b - a, c - a) / 2
    area = np.linalg.norm(vector, axis=1)
    i, j = ends[apart].T
    np.add.at(table, (i, j, _AREA), area)
    np.add.at(table, (j, i, _AREA), area)
    for k in range(3):
        np.add.at(table, (i, j, _VECTOR + k), vector[:, k])
        np.add.at(table, (j, i, _VECTOR + k), -vector[:, k])
    ends = piece[skin.cell[skin.beside]]
    apart = ends[:, 0] != ends[:, 1]
    i, j = ends[apart].T
    across, length, turn = skin.across[apart], skin.lengths[apart] / scale, skin.turning[apart]
    for k, (p, q) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))):
        part = length * across[:, p] * across[:, q]
        for one, two in ((i, j), (j, i)):
            np.add.at(table, (one, two, _LENGTH + k), part)
            np.add.at(table, (one, two, _TURN + k), part * turn)
    return table


def _join_by_corners(mesh: TetMesh, piece: Integers, touch: Any) -> None:
    """Mark pieces of bodies without a common face as touching where they share a corner."""
    from scipy.sparse.csgraph import connected_components

    bodies, body = connected_components(touch, directed=False)
    if bodies == 1:
        return
    corner, owner = np.unique(np.stack([mesh.tets.ravel(), np.repeat(piece, 4)], axis=1), axis=0).T
    for step in range(1, 8):
        same = corner[step:] == corner[:-step]
        i, j = owner[step:][same], owner[:-step][same]
        apart = body[i] != body[j]
        touch[i[apart], j[apart]] = touch[j[apart], i[apart]] = True


@numba.njit(cache=True, nogil=True)
def _support(row: Any, smaller: float) -> float:
    """Return how much of a seam, 0..1, the contact `row` (16,) is: creased around, a neck of the smaller cluster."""
    area, length = row[_AREA], row[_LENGTH] + row[_LENGTH + 1] + row[_LENGTH + 2]
    if area <= 0 or length <= 0:
        return 0.0
    neck = (FLANK - area / smaller ** (2 / 3)) / (FLANK - NECK)
    if neck <= 0:
        return 0.0
    x, y, z = row[_VECTOR] / area, row[_VECTOR + 1] / area, row[_VECTOR + 2] / area
    straight = x * x + y * y + z * z  # 1 where the contact is plane, 0 where it goes all around
    # Along the normal of a plane contact; any way across the border where there is no such normal.
    plane = min(max((np.sqrt(straight) - 0.2) / 0.3, 0.0), 1.0)
    if straight > 0:
        x, y, z = x / np.sqrt(straight), y / np.sqrt(straight), z / np.sqrt(straight)
    turn, over = 0.0, 0.0
    for first, result in ((_TURN, 0), (_LENGTH, 1)):
        along = (
            x * x * row[first] + y * y * row[first + 1] + z * z * row[first + 2]
            + 2 * (x * y * row[first + 3] + x * z * row[first + 4] + y * z * row[first + 5])
        )  # fmt: skip
        mixed = plane * along + (1 - plane) * (row[first] + row[first + 1] + row[first + 2])
        if result == 0:
            turn = mixed
        else:
            over = mixed
    crease = (turn / max(over, 1e-3 * length) - STRAIGHT) / (CREASED - STRAIGHT)
    return min(max(crease, 0.0), 1.0) * min(neck, 1.0)


@numba.njit(cache=True, nogil=True)
def _merge(
    xyz: Array, start: Any, member: Any, leaf_volume: Array, leaf_share: Array, leaf_colour: Any, contact: Any,
    touch: Any, tolerance: float,
) -> tuple[Any, Array, Array, Array, Array, int]:  # fmt: skip
    """Return merges, cost, seam, volume and hull of every node, and faults. Clusters live in the rows of `contact`."""
    n = len(leaf_volume)
    merges = np.empty((n - 1, 2), np.int64)
    cost, seam = np.empty(n - 1), np.empty(n - 1)
    node_volume, node_hull = np.empty(2 * n - 1), np.empty(2 * n - 1)
    volume, share, colour = leaf_volume.copy(), leaf_share.copy(), leaf_colour.copy()
    node, alive = np.arange(n), np.ones(n, np.bool_)
    hull = np.empty(n)
    pool = np.empty(len(member) + 4 * n * 64, np.int64)
    offset, length = np.empty(n, np.int64), np.empty(n, np.int64)
    filled, faults = 0, 0
    rows = np.empty(len(xyz), np.int64)
    mark, stamp = np.full(len(xyz), -1, np.int64), 0
    work = hull_work(len(xyz))
    for k in range(n):
        count = start[k + 1] - start[k]
        hull[k], kept = hull_volume(xyz, member[start[k] :], count, tolerance, work)
        if kept < 0:
            faults, kept, hull[k] = faults + 1, 0, volume[k]
        offset[k], length[k] = filled, kept
        for i in range(kept):
            pool[filled + i] = work.point[i, 2]
        filled += kept
        node_volume[k], node_hull[k] = volume[k], hull[k]
    price, worth, union = np.full((n, n), np.inf), np.zeros((n, n)), np.zeros((n, n))
    best = np.full(n, -1, np.int64)  # cheapest partner with a higher row
    fresh = np.ones(n, np.bool_)
    made = 0
    while made < n - 1:
        # Price every touching pair with a new cluster in it.
        for a in range(n):
            if not alive[a]:
                continue
            for b in range(a + 1, n):
                if alive[b] and touch[a, b] and (fresh[a] or fresh[b]):
                    stamp += 1
                    count = 0
                    for c in (a, b):
                        for k in range(offset[c], offset[c] + length[c]):
                            v = pool[k]
                            if mark[v] != stamp:
                                mark[v] = stamp
                                rows[count] = v
                                count += 1
                    h, kept = hull_volume(xyz, rows, count, tolerance, work)
                    if kept < 0:
                        faults, h = faults + 1, max(hull[a], hull[b])
                    union[a, b] = h
                    hollow = max(0.0, h - volume[a] - volume[b])
                    support = _support(contact[a, b], min(volume[a], volume[b]))
                    worth[a, b] = hollow * support
                    price[a, b] = hollow * (0.1 + support) + _SIZE * (volume[a] + volume[b])
                    if colour[a] != colour[b] or colour[a] < 0:
                        paint = PAINT * min(share[a], share[b])
                        worth[a, b] += paint
                        price[a, b] += _ACROSS + paint
        for a in range(n):
            if alive[a] and (fresh[a] or best[a] < 0 or not alive[best[a]] or fresh[best[a]]):
                best[a] = -1
                for b in range(a + 1, n):
                    if alive[b] and price[a, b] < np.inf and (best[a] < 0 or price[a, b] < price[a, best[a]]):
                        best[a] = b
            elif alive[a]:
                for b in range(a + 1, n):
                    if alive[b] and fresh[b] and price[a, b] < price[a, best[a]]:
                        best[a] = b
        p = -1
        for a in range(n):
            if alive[a] and best[a] >= 0 and (p < 0 or price[a, best[a]] < price[p, best[p]]):
                p = a
        fresh[:] = False
        if p >= 0:
            q = best[p]
            cost[made], seam[made] = price[p, q], worth[p, q]
        else:  # separate bodies: the two smallest
            p, q = -1, -1
            for a in range(n):
                if alive[a]:
                    if p < 0 or volume[a] < volume[p]:
                        p, q = a, p
                    elif q < 0 or volume[a] < volume[q]:
                        q = a
            p, q = min(p, q), max(p, q)
            cost[made] = np.inf
        stamp += 1
        count = 0
        for c in (p, q):
            for k in range(offset[c], offset[c] + length[c]):
                v = pool[k]
                if mark[v] != stamp:
                    mark[v] = stamp
                    rows[count] = v
                    count += 1
        h, kept = hull_volume(xyz, rows, count, tolerance, work)
        if kept < 0:
            faults, kept, h = faults + 1, count, max(hull[p], hull[q])
            for i in range(count):
                work.point[i, 2] = rows[i]
        if cost[made] == np.inf:
            # Nothing is better evidence of two parts than a gap.
            seam[made] = max(0.0, h - volume[p] - volume[q]) + PAINT * min(share[p], share[q])
        if filled + kept > len(pool):
            larger = np.empty(2 * (filled + kept), np.int64)
            larger[:filled] = pool[:filled]
            pool = larger
        for i in range(kept):
            pool[filled + i] = work.point[i, 2]
        offset[p], length[p] = filled, kept
        filled += kept
        merges[made, 0], merges[made, 1] = min(node[p], node[q]), max(node[p], node[q])
        alive[q] = False
        if colour[p] != colour[q]:
            colour[p] = -1
        volume[p] += volume[q]
        share[p] += share[q]
        hull[p], node[p] = h, n + made
        node_volume[n + made], node_hull[n + made] = volume[p], h
        for c in range(n):
            if alive[c] and c != p:
                for k in range(_WIDTH):
                    contact[p, c, k] += contact[q, c, k]
                    contact[c, p, k] += contact[c, q, k]
                touch[p, c] = touch[c, p] = touch[p, c] or touch[q, c]
                price[min(p, c), max(p, c)] = np.inf
        fresh[p] = True
        made += 1
    return merges, cost, seam, node_volume, node_hull, faults
