"""The merges of tetrahedra clustering, compiled.

Hulls only grow, so an earlier hull is a lower bound of a later one. When an edge with such a bound reaches the top of
the heap, its bound is raised by a hull that is grown point by point; should it come to the top again, its hull is made.
Most edges vanish before the first, most others before the second. The order of merges is that of the eager algorithm,
since no bound exceeds the hull, and every hull that a merge rests on is made by the hull kernel.
"""

from __future__ import annotations

import heapq
from typing import Any, NamedTuple

import numba
import numpy as np

from steelyard.check import Array
from steelyard.parts.htc.edge_heap import Heap, empty_heap, remove, settle
from steelyard.parts.htc.reach import MOST, Room, reach, room
from steelyard.parts.htc.small_hulls import five_faces, five_volume, four_faces
from steelyard.parts.hulls import Hulls, both, hulls_of, keep, keep_in_place
from steelyard.shape.hull import HullWork, hull_volume, hull_work
from steelyard.shape.hulls.borrowed import borrowed, integer

# Hollow is counted in grains of this share of the whole volume. Unions that leave out the same tets are equally hollow,
# and rounding is not to choose between them (the smaller one goes first), nor to make a convex union hollow.
GRAIN = 2.0**-30
# Stages of an edge.
_HELD, _GROWN, _EXACT, _GONE = 0, 1, 2, 3


class Clusters(NamedTuple):
    """Clusters (N,): volume, that of the hull, number of tets, whether it is joined, and the first of its edges' ends;
    `latest` (N, 2): the edge to it that was met last, and the merge that met it.
    """

    volume: Any
    hull: Any
    tets: Any
    gone: Any
    head: Any
    latest: Any


class Edges(NamedTuple):
    """Edges (E,).

    end    (E, 4) the two clusters; of each end, the next of the same cluster, 2 e or 2 e + 1, or -1
    known  the largest volume known to lie in the hull of the union
    stage  how it is known: of hulls that the union holds, of one grown, that of the union itself; or the edge is gone
    """

    end: Any
    known: Any
    stage: Any


class Making(NamedTuple):
    """What hulls are made of and with: points (V, 3), how level is level, and room."""

    xyz: Any
    tolerance: float
    work: HullWork


class Measure(NamedTuple):
    """What a merge is measured by: the number of first clusters, the volume and the tets of all of them."""

    n: int
    whole: float
    tets: float


class Tree(NamedTuple):
    """The merges (n - 1, 2), the lower number first, and the cost (n - 1,) of each."""

    merges: Any
    cost: Any


@numba.njit(cache=True, nogil=True)
def _key(hull: float, exact: bool, va: float, vb: float, na: int, nb: int, measure: Measure) -> float:
    """Return what orders merges, the cost or a number that rises with it; from a bound of the hull, a bound of it."""
    grains = (hull - va - vb) / (GRAIN * measure.whole)
    hollow: float = GRAIN * max(0.0, np.rint(grains if exact else grains - 1e-3))
    if hollow > 0:
        return hollow
    return -1.0 / (float(na) * na + float(nb) * nb)


def merge_all(
    xyz: Array, start: Any, member: Any, leaf_volume: Array, leaf_tets: Any, ends: Any, tolerance: float
) -> tuple[Any, Array, Array, Array]:  # fmt: skip
    """Return merges (n - 1, 2), the cost (n - 1,) of each, and volume and hull (2 n - 1,) of every node, leaves first.

    xyz            (V, 3) points, in any unit of length
    start, member  numbers of the points of leaf k: member[start[k]:start[k + 1]]
    leaf_volume, leaf_tets  (n,)
    ends           (E, 2) leaves that touch
    """
    n = len(leaf_volume)
    merges, cost, more = np.empty((n - 1, 2), np.int64), np.empty(n - 1), (0, n - 1)
    volume, tets = np.pad(leaf_volume, more), np.pad(leaf_tets, more)
    gone, head = np.zeros(2 * n - 1, np.bool_), np.full(2 * n - 1, -1, np.int32)
    clusters = Clusters(volume, np.zeros(2 * n - 1), tets, gone, head, np.full((2 * n - 1, 2), -1, np.int32))
    hulls = hulls_of(start, member, 2 * n - 1, len(xyz))
    making, tree = Making(xyz, tolerance, hull_work(len(xyz))), Tree(merges, cost)
    edges = Edges(np.empty((len(ends), 4), np.int32), np.empty(len(ends)), np.zeros(len(ends), np.int8))
    _begin(making, n, clusters, hulls, ends, edges)
    made = _join_neighbours(making, n, clusters, hulls, edges, empty_heap(len(ends)), room(), tree)
    if made < n - 1:
        _join_bodies(making, n, made, clusters, hulls, tree)
    return merges, cost, volume, clusters.hull


@numba.njit(cache=True, nogil=True)
def _begin(making: Making, n: int, clusters: Clusters, hulls: Hulls, ends: Any, edges: Edges) -> None:
    """Find the hulls of the first clusters and hang their edges on them."""
    xyz, tolerance, work = making
    volume, hull, head, end = clusters.volume, clusters.hull, clusters.head, edges.end
    for k in range(n):
        if hulls.length[k] == 4:
            hull[k] = volume[k]
            four_faces(xyz, hulls, k)
        else:
            hull[k], kept = hull_volume(xyz, hulls.vertex[hulls.offset[k] :], hulls.length[k], tolerance, work)
            keep_in_place(hulls, k, work.point, work.stack, kept, hull[k] > 0)
    for e in range(len(ends)):
        a, b = ends[e, 0], ends[e, 1]
        edges.known[e] = max(hull[a], hull[b])
        end[e, 0], end[e, 1], end[e, 2], end[e, 3] = a, b, head[a], head[b]
        head[a], head[b] = 2 * e, 2 * e + 1


@numba.njit(cache=True, nogil=True, forceinline=True)
def _priced(clusters: Clusters, edges: Edges, heap: Heap, heaped: int, e: int, measure: Measure) -> int:
    """Put an edge where its key belongs in the heap; return how many there are."""
    a, b = edges.end[e, 0], edges.end[e, 1]
    volume, tets = clusters.volume, clusters.tets
    key = _key(edges.known[e], edges.stage[e] == _EXACT, volume[a], volume[b], tets[a], tets[b], measure)
    return int(settle(heap.edge, heap.order, heap.place, heaped, e, key, volume[a] + volume[b]))


@numba.njit(cache=True, nogil=True)
def _join_neighbours(
    making: Making, n: int, all_clusters: Clusters, all_hulls: Hulls, all_edges: Edges, full_heap: Heap, space: Room,
    tree: Tree,
) -> int:  # fmt: skip
    """Join clusters that touch, always the two of least cost; return how often."""
    c, h, d, p = all_clusters, all_hulls, all_edges, full_heap
    clusters = Clusters(
        borrowed(c.volume), borrowed(c.hull), borrowed(c.tets), borrowed(c.gone), borrowed(c.head), borrowed(c.latest)
    )
    hulls = Hulls(
        borrowed(h.vertex), borrowed(h.face), borrowed(h.offset), borrowed(h.length), borrowed(h.mark),
        borrowed(h.rows), borrowed(h.state),
    )  # fmt: skip
    edges = Edges(borrowed(d.end), borrowed(d.known), borrowed(d.stage))
    heap = Heap(borrowed(p.edge), borrowed(p.order), borrowed(p.place))
    end, stage = edges.end, edges.stage
    measure = Measure(n, clusters.volume[:n].sum(), float(clusters.tets[:n].sum()))
    xyz, tolerance, work = making
    made, heaped, stamp = integer(0), integer(0), integer(1)
    last, kept = integer(-1), integer(0)  # the edge whose hull was made last, and its number of vertices
    for e in range(len(end)):
        heaped = _priced(clusters, edges, heap, heaped, e, measure)
    while heaped > 0:
        e = integer(heap.edge[0])
        if stage[e] == _HELD:
            stamp = _grow(xyz, clusters, hulls, edges, e, space, stamp)
            heaped = _priced(clusters, edges, heap, heaped, e, measure)
        elif stage[e] == _GROWN:
            count = both(hulls, end[e, 0], end[e, 1])
            edges.known[e], kept = hull_volume(xyz, hulls.rows, count, tolerance, work)
            stage[e], last = _EXACT, e
            heaped = _priced(clusters, edges, heap, heaped, e, measure)
        else:
            _note(clusters, edges, e, heap.order[0, 0], made, measure, tree)
            if last != e:
                kept = _hull_again(making, hulls, end[e, 0], end[e, 1])
            last = integer(-1)
            keep(hulls, n + made, clusters.gone, work.point, work.stack, kept, clusters.hull[n + made] > 0)
            heaped = _hand_over(clusters, edges, heap, heaped, e, made, measure)
            made += 1
    return int(made)


@numba.njit(cache=True, nogil=True, forceinline=True)
def _grow(xyz: Array, clusters: Clusters, hulls: Hulls, edges: Edges, e: int, space: Room, stamp: int) -> int:
    """Raise the bound of an edge's hull; of five points the hull is made. Return the next number for `reach`."""
    a, b = integer(edges.end[e, 0]), integer(edges.end[e, 1])
    big, small = (a, b) if hulls.length[a] >= hulls.length[b] else (b, a)
    count = both(hulls, big, small)
    if count == 5:
        both(hulls, a, b)
        edges.known[e], edges.stage[e] = five_volume(xyz, hulls.rows), _EXACT
        return stamp
    edges.stage[e] = _GROWN
    if count <= MOST:
        at, length, volume = 6 * hulls.offset[big], hulls.length[big], clusters.hull[big]
        grown = reach(xyz, hulls.rows, length, count, hulls.face, at, volume, stamp, space)
        edges.known[e] = max(edges.known[e], grown)
    return stamp + count


@numba.njit(cache=True, nogil=True, forceinline=True)
def _note(clusters: Clusters, edges: Edges, e: int, key: float, made: int, measure: Measure, tree: Tree) -> None:
    """Make a cluster of the ends of an edge."""
    a, b, c = edges.end[e, 0], edges.end[e, 1], measure.n + made
    (merges, cost), in_all = tree, measure.tets
    volume, tets = clusters.volume, clusters.tets
    merges[made, 0], merges[made, 1] = min(a, b), max(a, b)
    volume[c], tets[c], clusters.hull[c] = volume[a] + volume[b], tets[a] + tets[b], edges.known[e]
    clusters.gone[a] = clusters.gone[b] = True
    cost[made] = 1 + edges.known[e] - volume[a] - volume[b] if key > 0 else -1.0 / (key * in_all * in_all)


@numba.njit(cache=True, nogil=True)
def _hull_again(making: Making, hulls: Hulls, a: int, b: int) -> int:
    """Make the hull of two clusters, which was made before, or is that of five points; return its vertices."""
    xyz, tolerance, work = making
    count = both(hulls, a, b)
    if count == 5:
        five_faces(xyz, hulls.rows, work.point, work.stack)
        return 5
    return int(hull_volume(xyz, hulls.rows, count, tolerance, work)[1])


@numba.njit(cache=True, nogil=True, forceinline=True)
def _hand_over(clusters: Clusters, edges: Edges, heap: Heap, heaped: int, e: int, made: int, measure: Measure) -> int:
    """Give the edges of two clusters to the one made of them, two to one cluster as one; return the heap's size."""
    end, known, stage = edges.end, edges.known, edges.stage
    head, latest, c = clusters.head, clusters.latest, measure.n + made
    stage[e] = _GONE
    heaped = remove(heap.edge, heap.order, heap.place, heaped, e)
    for node in (integer(end[e, 0]), integer(end[e, 1])):
        half = integer(head[node])
        while half >= 0:
            f, side = half >> 1, half & 1
            after = integer(end[f, 2 + side])
            if stage[f] != _GONE:
                other = end[f, 1 - side]
                if latest[other, 1] == made:
                    g = integer(latest[other, 0])
                    known[g] = max(known[g], known[f])
                    stage[f] = _GONE
                    heaped = remove(heap.edge, heap.order, heap.place, heaped, f)
                else:
                    latest[other, 0], latest[other, 1] = f, made
                    end[f, side] = c
                    end[f, 2 + side], head[c] = head[c], half
            half = after
    half = integer(head[c])
    while half >= 0:
        f, side = half >> 1, half & 1
        known[f] = max(known[f], clusters.hull[c])
        stage[f] = _HELD
        heaped = _priced(clusters, edges, heap, heaped, f, measure)
        half = integer(end[f, 2 + side])
    return heaped


@numba.njit(cache=True, nogil=True)
def _join_bodies(making: Making, n: int, made: int, clusters: Clusters, hulls: Hulls, tree: Tree) -> None:
    """Join separate bodies: always the two of least volume, until one is left."""
    xyz, tolerance, work = making
    merges, cost = tree
    volume, gone = clusters.volume, clusters.gone
    bodies = [(volume[k], k) for k in range(n + made) if not gone[k]]
    heapq.heapify(bodies)
    while made < n - 1:
        (va, a), (vb, b) = heapq.heappop(bodies), heapq.heappop(bodies)
        c = n + made
        count = both(hulls, a, b)
        clusters.hull[c], kept = hull_volume(xyz, hulls.rows, count, tolerance, work)
        merges[made, 0], merges[made, 1] = min(a, b), max(a, b)
        cost[made], volume[c] = np.inf, va + vb
        gone[a] = gone[b] = True
        keep(hulls, c, gone, work.point, work.stack, kept, clusters.hull[c] > 0)
        heapq.heappush(bodies, (va + vb, c))
        made += 1
