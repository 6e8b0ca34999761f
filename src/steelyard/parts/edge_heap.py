"""A binary heap of edges ordered by cost, ties by a second number, then by the edge's own."""

from __future__ import annotations

from typing import Any

import numba

from steelyard.check import Array
from steelyard.shape.borrowed import integer


@numba.njit(cache=True, nogil=True, forceinline=True)
def _before(key: Array, tie: Array, e: int, f: int) -> bool:
    if key[e] != key[f]:
        return bool(key[e] < key[f])
    if tie[e] != tie[f]:
        return bool(tie[e] < tie[f])
    return e < f


@numba.njit(cache=True, nogil=True, forceinline=True)
def _rise(heap: Any, place: Any, key: Array, tie: Array, i: int, e: int) -> None:
    """Put edge e at place i or above."""
    while i > 0:
        above = (i - 1) >> 1
        f = integer(heap[above])
        if not _before(key, tie, e, f):
            break
        heap[i] = f
        place[f] = i
        i = above
    heap[i] = e
    place[e] = i


@numba.njit(cache=True, nogil=True, forceinline=True)
def _sink(heap: Any, place: Any, key: Array, tie: Array, size: int, i: int, e: int) -> None:
    """Put edge e at place i or below."""
    while True:
        below = 2 * i + 1
        if below >= size:
            break
        f = integer(heap[below])
        if below + 1 < size and _before(key, tie, integer(heap[below + 1]), f):
            below += 1
            f = integer(heap[below])
        if not _before(key, tie, f, e):
            break
        heap[i] = f
        place[f] = i
        i = below
    heap[i] = e
    place[e] = i


@numba.njit(cache=True, nogil=True)
def settle(heap: Any, place: Any, key: Array, tie: Array, size: int, e: int) -> int:
    """Put edge e where its key belongs, whether it was in the heap (place >= 0) or not; return the new size."""
    i = integer(place[e])
    if i < 0:
        i = size
        size += 1
    elif i == 0 or not _before(key, tie, e, integer(heap[(i - 1) >> 1])):
        _sink(heap, place, key, tie, size, i, e)
        return size
    _rise(heap, place, key, tie, i, e)
    return size


@numba.njit(cache=True, nogil=True)
def remove(heap: Any, place: Any, key: Array, tie: Array, size: int, e: int) -> int:
    """Take edge e out if it is in the heap; return the new size."""
    i = integer(place[e])
    if i < 0:
        return size
    place[e] = -1
    size -= 1
    last = integer(heap[size])
    if last != e:
        place[last] = i
        heap[i] = last
        settle(heap, place, key, tie, size, last)
    return size
