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
from steelyard.parts.hierarchy import Hierarchy
from steelyard.parts.hulls import vertices_of_both
from steelyard.parts.skin import Skin
from steelyard.shape.hull import HullWork, hull_work
from steelyard.shape.mesh import Integers
from steelyard.shape.stand_ins import StandIns, sure_hull, with_stand_ins
from steelyard.shape.tets import TetMesh

STRAIGHT, CREASED = 0.07, 0.25  # mean turn [rad] across a border that is no seam, and that is one
NECK, FLANK = 1.0, 2.0  # contact area over (volume of the smaller)^(2/3): a cube cut in half has 1.6
POINT = 0.02  # the same where two clusters only touch in a point or along an edge
PAINT = 10.0  # cost of painting over all of the surface: a hundredth of it is worth a part
FAR = 3.0  # bits of one colour that do not touch: three hundredths of the surface are worth a part of their own
_BLUNT = (
    0.005  # hulls need not be exact: points nearer to them than this, over the cube root of the volume, are on them
)
_SIZE = 0.02  # small clusters first (as in clustering.Hollow)
_NEARER = 1e-3  # of all bits equally dear to join, the nearest: per cube root of the volume between their middles
_STAGE = 100.0  # first what touches in one colour, then all of one colour, then colours
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
    corner = np.zeros((count, len(mesh.vertices)), dtype=bool)  # which vertices each piece has
    corner[np.repeat(piece, 4), mesh.tets.ravel()] = True
    middle, scale = mesh.vertices[corner.any(0)].mean(0), mesh.volume ** (1 / 3)
    xyz = np.ascontiguousarray((mesh.vertices - middle) / scale)
    contact = _contacts(xyz, skin, piece, count, pairs, corners, scale)
    touch = contact[:, :, _AREA] > 0
    _join_by_corners(corner, touch)
    owner, member = np.nonzero(corner)
    start = np.searchsorted(owner, np.arange(count + 1))
    share = np.bincount(piece[skin.cell], skin.areas, count) / max(float(skin.areas.sum()), 1e-300)
    volume = np.bincount(piece, mesh.volumes, count) / mesh.volume
    weighted = mesh.volumes[:, None] * (mesh.centroids - middle) / scale
    moment = np.stack([np.bincount(piece, weighted[:, k], count) for k in range(3)], axis=1)
    centre = moment / np.maximum(volume * mesh.volume, 1e-300)[:, None]
    leaves = (start, member.astype(np.int64), volume, centre, share, colour.astype(np.int64))
    work, limits = hull_work(len(xyz)), (STRAIGHT, CREASED, NECK, FLANK)
    merges, cost, seam, node_volume, hull = with_stand_ins(
        xyz, lambda known: _merge(xyz, *leaves, contact.copy(), touch.copy(), _BLUNT, limits, work, known)
    )
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


def _join_by_corners(corner: Any, touch: Any) -> None:
    """Mark pieces of bodies without a common face as touching where they share one of the corners (N, V)."""
    from scipy.sparse.csgraph import connected_components

    bodies, body = connected_components(touch, directed=False)
    if bodies == 1:
        return
    meeting = corner[:, corner.sum(0) > 1].astype(np.float32)
    shared = meeting @ meeting.T > 0
    touch |= shared & (body[:, None] != body)


@numba.njit(cache=True, nogil=True)
def _support(row: Any, smaller: float, limits: tuple[float, float, float, float]) -> float:
    """Return how much of a seam, 0..1, the contact `row` (16,) is: creased around, a neck of the smaller cluster."""
    straight_most, creased, neck_most, flank = limits
    area, length = row[_AREA], row[_LENGTH] + row[_LENGTH + 1] + row[_LENGTH + 2]
    if area <= POINT * smaller ** (2 / 3):
        return 1.0 / FAR
    if length <= 0:
        return 0.0
    neck = (flank - area / smaller ** (2 / 3)) / (flank - neck_most)
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
    crease = (turn / max(over, 1e-3 * length) - straight_most) / (creased - straight_most)
    return float(min(max(crease, 0.0), 1.0) * min(neck, 1.0))


@numba.njit(cache=True, nogil=True)
def _price(hull: float, support: float, va: float, vb: float, paint: float, stage: int) -> tuple[float, float]:
    """Return what orders a merge, and its seam: what a part that holds both sides costs.

    stage  0 one colour and touching, 1 one colour and apart, 2 two colours
    """
    if stage == 1:
        return _STAGE + paint / FAR, paint / FAR
    hollow = max(0.0, hull - va - vb)
    seam = min(hollow, paint) * support
    price = hollow * (0.1 + support) + _SIZE * (va + vb)
    return (price, seam) if stage == 0 else (2 * _STAGE + price + paint, seam + paint)


@numba.njit(cache=True, nogil=True)
def _best_partner(a: int, price: Array, alive: Any) -> int:
    """Return the row above `a` of the least price, -1 where there is none."""
    best = -1
    for b in range(a + 1, len(alive)):
        if alive[b] and price[a, b] < np.inf and (best < 0 or price[a, b] < price[a, best]):
            best = b
    return best


@numba.njit(cache=True, nogil=True)
def _merge(
    xyz: Array, start: Any, member: Any, leaf_volume: Array, leaf_middle: Array, leaf_share: Array, leaf_colour: Any,
    contact: Any, touch: Any, tolerance: float, limits: tuple[float, float, float, float],
    work: HullWork, stand_ins: StandIns,
) -> tuple[Any, Array, Array, Array, Array]:  # fmt: skip
    """Return merges, cost, seam, volume and hull of every node. Clusters live in the rows of `contact`.

    Hulls only grow: a pair is priced by the larger of the hulls known to lie in its union until it is the cheapest.
    """
    n = len(leaf_volume)
    merges = np.empty((n - 1, 2), np.int64)
    cost, seam = np.empty(n - 1), np.empty(n - 1)
    node_volume, node_hull = np.empty(2 * n - 1), np.empty(2 * n - 1)
    volume, share, colour = leaf_volume.copy(), leaf_share.copy(), leaf_colour.copy()
    node, alive = np.arange(n), np.ones(n, np.bool_)
    hull = np.empty(n)
    pool = np.empty(len(member) + 64 * n, np.int64)
    offset, length = np.empty(n, np.int64), np.empty(n, np.int64)
    filled, stamp = 0, 0
    rows, mark = np.empty(len(xyz), np.int64), np.full(len(xyz), -1, np.int64)
    for k in range(n):
        hull[k], kept = sure_hull(xyz, member[start[k] :], start[k + 1] - start[k], tolerance, work, stand_ins)
        offset[k], length[k] = filled, kept
        for i in range(kept):
            pool[filled + i] = work.point[i, 2]
        filled += kept
        node_volume[k], node_hull[k] = volume[k], hull[k]
    known, exact = np.zeros((n, n)), np.zeros((n, n), np.bool_)
    price, best = np.full((n, n), np.inf), np.full(n, -1, np.int64)
    changed = np.ones(n, np.bool_)
    middle = leaf_middle.copy()
    made = 0
    while made < n - 1:
        for a in range(n):
            if not alive[a]:
                continue
            for b in range(a + 1, n):
                if not alive[b] or not (changed[a] or changed[b]):
                    continue
                stage = 2 if colour[a] != colour[b] or colour[a] < 0 else (0 if touch[a, b] else 1)
                if stage == 2 and not touch[a, b]:
                    price[a, b] = np.inf
                    continue
                exact[a, b] = stage == 1
                known[a, b] = max(known[a, b], hull[a], hull[b])
                support = _support(contact[a, b], min(volume[a], volume[b]), limits)
                paint = PAINT * min(share[a], share[b])
                price[a, b] = _price(known[a, b], support, volume[a], volume[b], paint, stage)[0]
                if stage == 1:
                    price[a, b] += _NEARER * np.sqrt(((middle[a] - middle[b]) ** 2).sum())
        for a in range(n):
            if alive[a]:
                if changed[a] or best[a] < 0 or not alive[best[a]] or changed[best[a]]:
                    best[a] = _best_partner(a, price, alive)
                else:
                    for b in range(a + 1, n):
                        if alive[b] and changed[b] and price[a, b] < price[a, best[a]]:
                            best[a] = b
        changed[:] = False
        p, q, kept, count, h = -1, -1, -1, 0, 0.0
        last_p, last_q = -1, -1
        while True:
            p = -1
            for a in range(n):
                if alive[a] and best[a] >= 0 and (p < 0 or price[a, best[a]] < price[p, best[p]]):
                    p = a
            if p < 0:
                break
            q = best[p]
            if exact[p, q]:
                break
            stamp += 1
            count = vertices_of_both(pool, offset, length, p, q, mark, stamp, rows)
            h, kept = sure_hull(xyz, rows, count, tolerance, work, stand_ins)
            known[p, q] = h
            exact[p, q] = True
            last_p, last_q = p, q
            stage = 0 if colour[p] == colour[q] and colour[p] >= 0 else 2
            support = _support(contact[p, q], min(volume[p], volume[q]), limits)
            paint = PAINT * min(share[p], share[q])
            price[p, q] = _price(known[p, q], support, volume[p], volume[q], paint, stage)[0]
            best[p] = _best_partner(p, price, alive)
        apart = p < 0
        if apart:  # bodies of different colours that do not touch: the two smallest
            for a in range(n):
                if alive[a]:
                    if p < 0 or volume[a] < volume[p]:
                        p, q = a, p
                    elif q < 0 or volume[a] < volume[q]:
                        q = a
            p, q = min(p, q), max(p, q)
        if last_p != p or last_q != q:
            stamp += 1
            count = vertices_of_both(pool, offset, length, p, q, mark, stamp, rows)
            h, kept = sure_hull(xyz, rows, count, tolerance, work, stand_ins)
        paint = PAINT * min(share[p], share[q])
        if apart:
            cost[made], seam[made] = np.inf, paint + max(0.0, h - volume[p] - volume[q])
        else:
            stage = 2 if colour[p] != colour[q] or colour[p] < 0 else (0 if touch[p, q] else 1)
            support = _support(contact[p, q], min(volume[p], volume[q]), limits)
            cost[made], seam[made] = _price(h, support, volume[p], volume[q], paint, stage)
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
        middle[p] = (volume[p] * middle[p] + volume[q] * middle[q]) / (volume[p] + volume[q])
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
                low, high = min(p, c), max(p, c)
                known[low, high] = max(known[low, high], known[min(q, c), max(q, c)])
                price[low, high] = np.inf
        changed[p] = True
        made += 1
    return merges, cost, seam, node_volume, node_hull
