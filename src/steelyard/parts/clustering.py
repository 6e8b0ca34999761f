"""Hierarchical tetrahedra clustering: pieces of a solid are joined, always the two whose union is the least hollow.

Source: "The Sum of Its Parts", section IV: eq. 8 and Algorithm 1; Attene et al. 2008, "Hierarchical convex
approximation of 3D shapes for fast region selection". Unlike the published code,
two edges between the same clusters are one, all initial clusters keep their neighbours, and bodies that do not touch
stay in the tree: they are joined last.

Hulls only grow, so an earlier hull is a lower bound of a later one: an edge's hull is made when its bound reaches the
top of the heap, and most edges vanish before. The order of merges is that of the eager algorithm.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np

from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.parts.edge_heap import remove, settle
from steelyard.parts.hierarchy import Hierarchy
from steelyard.shape.borrowed import integer
from steelyard.shape.hull import TOLERANCE, hull_volume, hull_work
from steelyard.shape.mesh import Integers
from steelyard.shape.tets import TetMesh

# Hollow is counted in grains of this share of the whole volume. Unions that leave out the same tets are equally hollow,
# and rounding is not to choose between them (the smaller one goes first), nor to make a convex union hollow.
GRAIN = 2.0**-30


@dataclass(frozen=True)
class Published:
    """The paper's cost, eq. 8: 1 + hollow where the union is hollow, else (n_i^2 + n_j^2) / N^2 of the numbers of tets.

    Hollow is hull(i and j) - volume(i) - volume(j), scaled to a solid whose box has a diagonal of one.
    """


@dataclass(frozen=True)
class Hollow:
    """max(0, hull(i and j) - volume(i) - volume(j)) / V + size (volume(i) + volume(j)) / V, V the whole volume.

    The second term joins small clusters first; it is an area of the tree's cost that grows with every level.
    """

    size: float = 0.02


def cluster(
    mesh: TetMesh,
    piece: Any = None,
    group: Any = None,
    cost: Published | Hollow = Published(),
) -> Hierarchy:
    """Return the tree of merges of the pieces of a solid.

    piece  (T,) initial cluster of every tet (labels, any integers), None: every tet by itself
    group  (T,) or None: pieces of one group (all tets of a piece share it) are joined before any are joined across

    Where both are used up, separate bodies are joined at cost inf, always the two of least volume.
    Raises BadValue where shapes do not fit or a piece lies in two groups.
    """
    leaf = np.arange(len(mesh)) if piece is None else _numbered("piece", piece, len(mesh))
    count = int(leaf.max()) + 1
    groups = np.zeros(count, dtype=np.int64)
    if group is not None:
        of_tet = _numbered("group", group, len(mesh))
        groups[leaf] = of_tet
        if (groups[leaf] != of_tet).any():
            raise BadValue("all tets of a piece must be in one group; at least one piece lies in two.")
    start, member = _corners(mesh, leaf, count)
    used = mesh.vertices[np.unique(mesh.tets)]
    diagonal = float(np.linalg.norm(np.ptp(used, axis=0)))
    merges, costs, volume, hull, faults = _merge_all(
        np.ascontiguousarray(mesh.vertices - used.mean(0)) / diagonal,
        start,
        member,
        np.bincount(leaf, mesh.volumes / diagonal**3, count).astype(np.float64),
        np.bincount(leaf, minlength=count),
        groups,
        _edges(mesh, leaf, count),
        TOLERANCE,
        -1.0 if isinstance(cost, Published) else cost.size,
    )[:5]
    if faults:
        raise BadValue(f"{faults} convex hulls of this solid came out open; report it with the mesh.")
    return Hierarchy(leaf, merges, costs, volume * diagonal**3, hull * diagonal**3)


def _numbered(name: str, labels: Any, tets: int) -> Integers:
    labels = np.asarray(labels)
    if labels.shape != (tets,) or labels.dtype.kind not in "iu":
        raise BadValue(f"{name} needs one whole number per tet ({tets},); got {labels.dtype} of shape {labels.shape}.")
    return np.unique(labels, return_inverse=True)[1]


def _corners(mesh: TetMesh, leaf: Integers, count: int) -> tuple[Integers, Integers]:
    """Return the vertices of every piece, each once: those of piece k are member[start[k]:start[k + 1]]."""
    key = np.unique(np.repeat(leaf, 4) * len(mesh.vertices) + mesh.tets.ravel())
    owner, member = np.divmod(key, len(mesh.vertices))
    return np.searchsorted(owner, np.arange(count + 1)).astype(np.int64), member


def _edges(mesh: TetMesh, leaf: Integers, count: int) -> Integers:
    """Return pairs (E, 2) of pieces that share a face, each once."""
    pairs = np.sort(leaf[mesh.dual], axis=1)
    key = np.unique(pairs[:, 0] * count + pairs[:, 1])
    ends = np.stack(np.divmod(key, count), axis=1)
    return np.asarray(ends[ends[:, 0] != ends[:, 1]])


@numba.njit(cache=True, nogil=True)
def _five_points(xyz: Array, rows: Any) -> float:
    """Return the volume of the hull of five points: the positive of the tets that leave one out fill it, and so do the
    negative, half the sum of all.
    """
    total, last = 0.0, 0.0
    ax, ay, az = xyz[rows[4], 0], xyz[rows[4], 1], xyz[rows[4], 2]
    for k in range(4):
        i, j, h = rows[0 if k != 0 else 3], rows[1 if k != 1 else 3], rows[2 if k != 2 else 3]
        ux, uy, uz = xyz[i, 0] - ax, xyz[i, 1] - ay, xyz[i, 2] - az
        vx, vy, vz = xyz[j, 0] - ax, xyz[j, 1] - ay, xyz[j, 2] - az
        wx, wy, wz = xyz[h, 0] - ax, xyz[h, 1] - ay, xyz[h, 2] - az
        d = ux * (vy * wz - vz * wy) + uy * (vz * wx - vx * wz) + uz * (vx * wy - vy * wx)
        total += abs(d)
        last += d if k == 3 else -d
    return (total + abs(last)) / 12


@numba.njit(cache=True, nogil=True)
def _key(hull: float, exact: bool, va: float, vb: float, na: int, nb: int, whole: float, size: float) -> float:
    """Return what orders merges, the cost or a number that rises with it; from a bound of the hull, a bound of it."""
    grains = (hull - va - vb) / (GRAIN * whole)
    hollow: float = GRAIN * max(0.0, np.rint(grains if exact else grains - 1e-3))
    if size >= 0:
        return float(hollow + size * (va + vb) / whole)
    if hollow > 0:
        return hollow
    return -1.0 / (float(na) * na + float(nb) * nb)


@numba.njit(cache=True, nogil=True)
def vertices_of_both(pool: Any, offset: Any, length: Any, a: int, b: int, mark: Any, stamp: int, rows: Any) -> int:
    """Write the vertices of two clusters into `rows`, each once; return how many."""
    count = 0
    for node in (a, b):
        for k in range(offset[node], offset[node] + length[node]):
            v = pool[k]
            if mark[v] != stamp:
                mark[v] = stamp
                rows[count] = v
                count += 1
    return count


@numba.njit(cache=True, nogil=True)
def _stored(pool: Any, filled: int, vertex: Any, kept: int) -> Any:
    """Return the pool, a larger one where need be, with the vertices kept by the last hull at its end."""
    if filled + kept > len(pool):
        larger = np.empty(2 * (filled + kept), np.int32)
        larger[:filled] = pool[:filled]
        pool = larger
    for i in range(kept):
        pool[filled + i] = vertex[i, 2]
    return pool


@numba.njit(cache=True, nogil=True)
def _merge_all(
    xyz: Array, start: Any, member: Any, leaf_volume: Array, leaf_tets: Any, leaf_group: Any, ends: Any,
    tolerance: float, size: float,
) -> tuple[Any, Array, Array, Array, int, int, int]:  # fmt: skip
    """Return merges, cost, volume and hull of every node, faults, and the number of hulls and of their points."""
    n, edges = len(leaf_volume), len(ends)
    nodes = 2 * n - 1
    merges = np.empty((n - 1, 2), np.int64)
    cost = np.empty(n - 1)
    volume, hull = np.zeros(nodes), np.zeros(nodes)
    tets, group = np.zeros(nodes, np.int64), np.empty(nodes, np.int64)
    volume[:n], tets[:n], group[:n] = leaf_volume, leaf_tets, leaf_group
    whole = leaf_volume.sum()
    all_tets = float(leaf_tets.sum())

    # Vertices of the hull of every cluster, one after the other in a pool that grows.
    pool = np.empty(max(64, 4 * len(member)), np.int32)
    pool[: len(member)] = member
    filled = len(member)
    offset, length = np.empty(nodes, np.int64), np.empty(nodes, np.int64)
    for k in range(n):
        offset[k], length[k] = start[k], start[k + 1] - start[k]
    mark = np.full(len(xyz), -1, np.int32)
    stamp = 0
    work = hull_work(len(xyz))
    vertex = work.point
    rows = np.empty(len(xyz), np.int32)
    faults, hulls, points = 0, 0, 0
    for k in range(n):
        if length[k] == 4:
            hull[k] = volume[k]
            continue
        hull[k], kept = hull_volume(xyz, pool[offset[k] :], length[k], tolerance, work)
        hulls += 1
        points += length[k]
        if kept < 0:
            faults += 1
            continue
        length[k] = kept
        for i in range(kept):
            pool[offset[k] + i] = vertex[i, 2]

    # Edges: their ends, the largest hull known of the union, and whether it is that of the union itself.
    end = ends.copy()
    known = np.empty(edges)
    exact = np.zeros(edges, np.bool_)
    spot, held = np.zeros(edges, np.int64), np.zeros(edges, np.int64)  # where the pool has its vertices, how many
    alive = np.ones(edges, np.bool_)
    key, tie = np.empty(edges), np.empty(edges)
    head = np.full(nodes, -1, np.int32)
    following = np.empty(2 * edges, np.int32)
    heap, place, heaped = np.empty(edges, np.int32), np.full(edges, -1, np.int32), integer(0)
    for e in range(edges):
        a, b = end[e, 0], end[e, 1]
        known[e] = max(hull[a], hull[b])
        key[e] = _key(known[e], False, volume[a], volume[b], tets[a], tets[b], whole, size)
        tie[e] = volume[a] + volume[b]
        following[2 * e], head[a] = head[a], 2 * e
        following[2 * e + 1], head[b] = head[b], 2 * e + 1
        if group[a] == group[b]:
            heaped = settle(heap, place, key, tie, heaped, e)
    latest = np.full(nodes, -1, np.int32)  # the edge to this cluster met last, and the merge that met it
    latest_merge = np.full(nodes, -1, np.int32)
    gone = np.zeros(nodes, np.bool_)
    across = False
    made = 0
    while made < n - 1:
        if heaped == 0:
            if across:
                break
            across = True
            for e in range(edges):
                if alive[e]:
                    heaped = settle(heap, place, key, tie, heaped, e)
            continue
        e = integer(heap[0])
        a, b = end[e, 0], end[e, 1]
        if not exact[e]:
            stamp += 1
            count = vertices_of_both(pool, offset, length, a, b, mark, stamp, rows)
            if count == 5:
                known[e], kept = _five_points(xyz, rows), integer(5)
                vertex[:5, 2] = rows[:5]
            else:
                known[e], kept = hull_volume(xyz, rows, count, tolerance, work)
                hulls += 1
                points += count
                if kept < 0:
                    faults += 1
                    kept = integer(0)
            pool = _stored(pool, filled, vertex, kept)
            spot[e], held[e] = filled, kept
            filled += kept
            exact[e] = True
            key[e] = _key(known[e], True, volume[a], volume[b], tets[a], tets[b], whole, size)
            heaped = settle(heap, place, key, tie, heaped, e)
            continue

        # Join a and b.
        c = n + made
        merges[made, 0], merges[made, 1] = min(a, b), max(a, b)
        if size >= 0:
            cost[made] = key[e]
        else:
            cost[made] = 1 + known[e] - volume[a] - volume[b] if key[e] > 0 else -1.0 / (key[e] * all_tets * all_tets)
        volume[c], hull[c], tets[c] = volume[a] + volume[b], known[e], tets[a] + tets[b]
        group[c] = group[a] if group[a] == group[b] else -1
        offset[c], length[c] = spot[e], held[e]
        gone[a] = gone[b] = True
        alive[e] = False
        heaped = remove(heap, place, key, tie, heaped, e)
        for node in (a, b):
            half = integer(head[node])
            while half >= 0:
                after = integer(following[half])
                f = half >> 1
                if alive[f]:
                    other = end[f, 1 - (half & 1)]
                    if latest_merge[other] == made:
                        g = integer(latest[other])
                        known[g] = max(known[g], known[f])
                        alive[f] = False
                        heaped = remove(heap, place, key, tie, heaped, f)
                    else:
                        latest[other], latest_merge[other] = f, made
                        end[f, half & 1] = c
                        following[half], head[c] = head[c], half
                half = after
        half = integer(head[c])
        while half >= 0:
            f = half >> 1
            other = end[f, 1 - (half & 1)]
            known[f] = max(known[f], hull[c])
            exact[f] = False
            key[f] = _key(known[f], False, volume[c], volume[other], tets[c], tets[other], whole, size)
            tie[f] = volume[c] + volume[other]
            if across or group[c] == group[other]:
                heaped = settle(heap, place, key, tie, heaped, f)
            half = integer(following[half])
        made += 1

    # Separate bodies: the two of least volume, until one is left.
    bodies = [(volume[k], k) for k in range(n + made) if not gone[k]]
    heapq.heapify(bodies)
    while made < n - 1:
        (va, a), (vb, b) = heapq.heappop(bodies), heapq.heappop(bodies)
        stamp += 1
        count = vertices_of_both(pool, offset, length, a, b, mark, stamp, rows)
        h, kept = hull_volume(xyz, rows, count, tolerance, work)
        c = n + made
        merges[made, 0], merges[made, 1] = min(a, b), max(a, b)
        cost[made], volume[c], hull[c] = np.inf, va + vb, h
        if kept < 0:
            faults += 1
            kept = integer(0)
        pool = _stored(pool, filled, vertex, kept)
        offset[c], length[c] = filled, kept
        filled += kept
        heapq.heappush(bodies, (va + vb, c))
        made += 1
    return merges, cost, volume, hull, faults, hulls, points
