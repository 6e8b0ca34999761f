"""Clusters of pieces that are merged two by two, the cheapest seam first; compiled.

Hulls only grow: a pair is priced by the larger of the hulls known to lie in its union until it is the cheapest.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numba
import numpy as np

from steelyard.check import Array, Integers
from steelyard.parts.hulls import Hulls, both, keep, keep_in_place
from steelyard.parts.seams.costs import PAINT, WIDTH, price_of, support_of
from steelyard.shape.hull import HullWork, hull_volume

_NEARER = 1e-3  # of all bits equally dear to join, the nearest: per cube root of the volume between their middles


class Clusters(NamedTuple):
    """The clusters, each in the row of one of its N pieces; one that was joined to another is no longer alive.

    volume, share, colour (N,)  share of the surface; colour -1 where there are several     middle (N, 3)
    hull     (N,) volume of the convex hull       node (N,) in the tree
    changed  (N,) since its pairs were priced     best (N,) the row above with the least price, -1 without one
    contact  (N, N, 22) and touch (N, N) with every other
    known    (N, N) a bound from below of the pair's hull, and whether it is exact
    price    (N, N) what orders merges, infinite where a pair is not to be joined
    """

    volume: Array
    share: Array
    colour: Any
    middle: Array
    hull: Array
    node: Any
    alive: Any
    changed: Any
    contact: Any
    touch: Any
    known: Array
    exact: Any
    price: Array
    best: Any

    @classmethod
    def of(cls, volume: Array, share: Array, colour: Integers, middle: Array, contact: Array, touch: Any) -> Clusters:
        """Return pieces (S,) as clusters, in arrays of their own, hulls still to come; contact and touch (S, S)."""
        count, square = len(volume), touch.shape
        return cls(
            volume.copy(), share.copy(), colour.astype(np.int64), middle.copy(), np.empty(count), np.arange(count),
            np.ones(count, np.bool_), np.ones(count, np.bool_), contact.copy(), touch.copy(),
            np.zeros(square), np.zeros(square, np.bool_), np.full(square, np.inf), np.full(count, -1),
        )  # fmt: skip


@numba.njit(cache=True, nogil=True, forceinline=True)
def _stage(at: Clusters, a: int, b: int) -> int:
    """Return 0 for a pair of one colour that touches, 1 for one of one colour that does not, 2 for two colours."""
    if at.colour[a] != at.colour[b] or at.colour[a] < 0:
        return 2
    return 0 if at.touch[a, b] else 1


@numba.njit(cache=True, nogil=True, forceinline=True)
def _price(at: Clusters, a: int, b: int, hull: float) -> tuple[float, float]:
    """Return what orders the merge of a pair whose union has this hull, and its seam."""
    support = support_of(at.contact[a, b], min(at.volume[a], at.volume[b]))
    paint = PAINT * min(at.share[a], at.share[b])
    return price_of(hull, support, at.volume[a], at.volume[b], paint, _stage(at, a, b))


@numba.njit(cache=True, nogil=True)
def _price_changed(at: Clusters) -> None:
    """Price all pairs of which one changed, by the largest hull known to lie in their union."""
    n = len(at.alive)
    for a in range(n):
        if not at.alive[a]:
            continue
        for b in range(a + 1, n):
            if not at.alive[b] or not (at.changed[a] or at.changed[b]):
                continue
            stage = _stage(at, a, b)
            if stage == 2 and not at.touch[a, b]:
                at.price[a, b] = np.inf
                continue
            at.exact[a, b] = stage == 1
            at.known[a, b] = max(at.known[a, b], at.hull[a], at.hull[b])
            at.price[a, b] = _price(at, a, b, at.known[a, b])[0]
            if stage == 1:
                at.price[a, b] += _NEARER * np.sqrt(((at.middle[a] - at.middle[b]) ** 2).sum())


@numba.njit(cache=True, nogil=True)
def _best_partner(a: int, price: Array, alive: Any) -> int:
    """Return the row above `a` of the least price, -1 where there is none."""
    best = -1
    for b in range(a + 1, len(alive)):
        if alive[b] and price[a, b] < np.inf and (best < 0 or price[a, b] < price[a, best]):
            best = b
    return best


@numba.njit(cache=True, nogil=True)
def _find_partners(at: Clusters) -> None:
    """Find the best partner of every cluster once prices have changed."""
    n, alive, changed, best = len(at.alive), at.alive, at.changed, at.best
    for a in range(n):
        if not alive[a]:
            continue
        if changed[a] or best[a] < 0 or not alive[best[a]] or changed[best[a]]:
            best[a] = _best_partner(a, at.price, alive)
            continue
        for b in range(a + 1, n):
            if alive[b] and changed[b] and at.price[a, b] < at.price[a, best[a]]:
                best[a] = b


@numba.njit(cache=True, nogil=True)
def _cheapest(at: Clusters) -> int:
    """Return the lower row of the cheapest pair, -1 where no pair is to be joined."""
    p = -1
    for a in range(len(at.alive)):
        if at.alive[a] and at.best[a] >= 0 and (p < 0 or at.price[a, at.best[a]] < at.price[p, at.best[p]]):
            p = a
    return p


@numba.njit(cache=True, nogil=True)
def _two_smallest(at: Clusters) -> tuple[int, int]:
    """Return the rows of the two smallest clusters, rising."""
    p, q = -1, -1
    for a in range(len(at.alive)):
        if not at.alive[a]:
            continue
        if p < 0 or at.volume[a] < at.volume[p]:
            p, q = a, p
        elif q < 0 or at.volume[a] < at.volume[q]:
            q = a
    return min(p, q), max(p, q)


@numba.njit(cache=True, nogil=True)
def _join(at: Clusters, p: int, q: int, hull: float, node: int) -> None:
    """Join cluster q to p, which becomes that node of the tree; bounds of hulls pass on to its pairs."""
    at.alive[q] = False
    if at.colour[p] != at.colour[q]:
        at.colour[p] = -1
    at.middle[p] = (at.volume[p] * at.middle[p] + at.volume[q] * at.middle[q]) / (at.volume[p] + at.volume[q])
    at.volume[p] += at.volume[q]
    at.share[p] += at.share[q]
    at.hull[p], at.node[p] = hull, node
    for c in range(len(at.alive)):
        if at.alive[c] and c != p:
            for k in range(WIDTH):
                at.contact[p, c, k] += at.contact[q, c, k]
                at.contact[c, p, k] += at.contact[c, q, k]
            at.touch[p, c] = at.touch[c, p] = at.touch[p, c] or at.touch[q, c]
            low, high = min(p, c), max(p, c)
            at.known[low, high] = max(at.known[low, high], at.known[min(q, c), max(q, c)])
            at.price[low, high] = np.inf
    at.changed[p] = True


@numba.njit(cache=True, nogil=True)
def _hull_of_both(
    xyz: Array, at: Clusters, hulls: Hulls, p: int, q: int, tolerance: float, work: HullWork
) -> tuple[float, int]:
    """Return the volume of the hull of two clusters, and how many vertices it has; `work` holds them."""
    count = both(hulls, at.node[p], at.node[q])
    return hull_volume(xyz, hulls.rows, count, tolerance, work)


@numba.njit(cache=True, nogil=True)
def _next_pair(
    xyz: Array, at: Clusters, hulls: Hulls, tolerance: float, work: HullWork
) -> tuple[int, int, bool, float, int]:
    """Return the rows of the two clusters to join next, whether nothing asks for it, and their hull: volume, vertices.

    Hulls only grow: a pair is priced by the larger of the hulls known to lie in its union until it is the cheapest.
    """
    last_p, last_q, hull, kept = -1, -1, 0.0, -1
    p = _cheapest(at)
    while p >= 0 and not at.exact[p, at.best[p]]:
        q = at.best[p]
        hull, kept = _hull_of_both(xyz, at, hulls, p, q, tolerance, work)
        last_p, last_q = p, q
        at.known[p, q], at.exact[p, q] = hull, True
        at.price[p, q] = _price(at, p, q, hull)[0]
        at.best[p] = _best_partner(p, at.price, at.alive)
        p = _cheapest(at)
    apart = p < 0  # bodies of different colours that do not touch
    p, q = _two_smallest(at) if apart else (p, at.best[p])
    if last_p != p or last_q != q:
        hull, kept = _hull_of_both(xyz, at, hulls, p, q, tolerance, work)
    return p, q, apart, hull, kept


@numba.njit(cache=True, nogil=True)
def merge(
    xyz: Array, at: Clusters, hulls: Hulls, tolerance: float, work: HullWork
) -> tuple[Any, Array, Array, Array, Array]:
    """Return merges (n - 1, 2) with cost and seam (n - 1,) of each, and volume and hull (2 n - 1,) of every node.

    xyz (V, 3); `hulls` holds the vertices of the leaves.
    """
    n = len(at.alive)
    merges, gone = np.empty((n - 1, 2), np.int64), np.zeros(2 * n - 1, np.bool_)
    cost, seam = np.empty(n - 1), np.empty(n - 1)
    node_volume, node_hull = np.empty(2 * n - 1), np.empty(2 * n - 1)
    for k in range(n):
        at.hull[k], kept = hull_volume(xyz, hulls.vertex[hulls.offset[k] :], hulls.length[k], tolerance, work)
        keep_in_place(hulls, k, work.point, work.stack, kept, False)
        node_volume[k], node_hull[k] = at.volume[k], at.hull[k]
    for made in range(n - 1):
        _price_changed(at)
        _find_partners(at)
        at.changed[:] = False
        p, q, apart, hull, kept = _next_pair(xyz, at, hulls, tolerance, work)
        if apart:
            paint = PAINT * min(at.share[p], at.share[q])
            cost[made], seam[made] = np.inf, paint + max(0.0, hull - at.volume[p] - at.volume[q])
        else:
            cost[made], seam[made] = _price(at, p, q, hull)
        a, b, node = at.node[p], at.node[q], n + made
        merges[made, 0], merges[made, 1] = min(a, b), max(a, b)
        gone[a] = gone[b] = True
        keep(hulls, node, gone, work.point, work.stack, kept, False)
        _join(at, p, q, hull, node)
        node_volume[node], node_hull[node] = at.volume[p], hull
    return merges, cost, seam, node_volume, node_hull
