"""A binary heap of edges ordered by cost, ties by a second number, then by the edge's own.

The two numbers lie in the heap beside the edge: of a hundred thousand edges, those compared are near in memory.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numba
import numpy as np

from steelyard.check import Array
from steelyard.shape.hulls.borrowed import integer


class Heap(NamedTuple):
    """Room for some edges.

    edge   (E,) by place
    order  (E, 2) by place: the cost and what orders equal ones
    place  (E,) of every edge, -1 where it is not in the heap
    """

    edge: Any
    order: Array
    place: Any


def empty_heap(edges: int) -> Heap:
    """Return room for `edges` edges, none of them in the heap."""
    return Heap(np.empty(edges, np.int32), np.empty((edges, 2)), np.full(edges, -1, np.int32))


@numba.njit(cache=True, nogil=True, forceinline=True)
def _before(key: float, tie: float, e: int, order: Array, edge: Any, i: int) -> bool:
    """Return whether an edge goes before the one at place i."""
    if key != order[i, 0]:
        return bool(key < order[i, 0])
    if tie != order[i, 1]:
        return bool(tie < order[i, 1])
    return bool(e < edge[i])


@numba.njit(cache=True, nogil=True, forceinline=True)
def _put(edge: Any, order: Array, place: Any, i: int, e: int, key: float, tie: float) -> None:
    edge[i], order[i, 0], order[i, 1] = e, key, tie
    place[e] = i


@numba.njit(cache=True, nogil=True)
def settle(edge: Any, order: Array, place: Any, size: int, e: int, key: float, tie: float) -> int:
    """Put edge e where its key belongs, whether it was in the heap (place >= 0) or not; return the new size.

    edge (E,), order (E, 2)  the heap: edges, with key and what decides between equal ones
    place (E,)               where every edge stands in it, -1 for none
    """
    i = integer(place[e])
    if i < 0:
        i = size
        size += 1
    start = i
    while i > 0:
        above = (i - 1) >> 1
        if not _before(key, tie, e, order, edge, above):
            break
        _put(edge, order, place, i, integer(edge[above]), order[above, 0], order[above, 1])
        i = above
    while i >= start:
        below = 2 * i + 1
        if below >= size:
            break
        if below + 1 < size and _before(order[below + 1, 0], order[below + 1, 1], edge[below + 1], order, edge, below):
            below += 1
        if _before(key, tie, e, order, edge, below):
            break
        _put(edge, order, place, i, integer(edge[below]), order[below, 0], order[below, 1])
        i = below
    _put(edge, order, place, i, e, key, tie)
    return size


@numba.njit(cache=True, nogil=True)
def remove(edge: Any, order: Array, place: Any, size: int, e: int) -> int:
    """Take edge e out of the heap of `settle` if it is there; return the new size."""
    i = integer(place[e])
    if i < 0:
        return size
    place[e] = -1
    size -= 1
    last = integer(edge[size])
    if last != e:
        place[last] = i
        settle(edge, order, place, size, last, order[size, 0], order[size, 1])
    return size
