"""Hulls by Qhull that stand in where the kernel gives up inside a compiled loop.

A compiled loop cannot call Qhull. It notes the first set of points that the kernel gives back and runs to its end with
whatever comes of that; then Qhull makes the hull of that set and the loop runs again, which meets the same sets in the
same order, and takes the answer. No set is known that the kernel gives back, so one run is the rule.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

import numba
import numpy as np

from steelyard.check import Array
from steelyard.shape.hull import HullWork, hull_volume, qhull
from steelyard.shape.hulls.hull_faces import KEPT

T = TypeVar("T")
_MET, _ASKED = 0, 1


class StandIns(NamedTuple):
    """Hulls of the first F sets that the kernel gives back, in the order in which the loop meets them.

    volume  (F,)
    first   (F + 1,) where the vertices of each begin in `vertex`
    vertex  rows of the vertices of all
    asked   (N,) the points of the first set that has no answer
    state   (2,) how many sets were given back in this run; how many points were asked for
    """

    volume: Any
    first: Any
    vertex: Any
    asked: Any
    state: Any


def with_stand_ins(xyz: Array, loop: Callable[[StandIns], T]) -> T:
    """Return what a compiled loop over hulls of points (N, 3) gives once it has an answer for every set."""
    asked, state = np.zeros(len(xyz), np.int64), np.zeros(2, np.int64)
    volumes, vertices = np.zeros(0), [np.zeros(0, np.int64)]
    while True:
        first = np.cumsum([len(rows) for rows in vertices])
        found = loop(StandIns(volumes, first, np.concatenate(vertices), asked, state))
        if not state[_ASKED]:
            return found
        rows = asked[: state[_ASKED]].copy()
        volume, kept = qhull(xyz[rows])
        volumes = np.append(volumes, volume)
        vertices.append(rows[kept])
        state[:] = 0


@numba.njit(cache=True, nogil=True, forceinline=True)
def sure_hull(
    xyz: Array, rows: Any, count: int, tolerance: float, work: HullWork, stand_ins: StandIns
) -> tuple[float, int]:
    """Return the volume of a hull and its number of vertices as `hull_volume` does, without faults.

    Of a hull that stands in, the faces are not known: their corners are -1.
    """
    volume, kept = hull_volume(xyz, rows, count, tolerance, work)
    if kept < 0:
        volume, kept = _stand_in(rows, count, work, stand_ins)
    return volume, kept


@numba.njit(cache=True, nogil=True)
def _stand_in(rows: Any, count: int, work: HullWork, stand_ins: StandIns) -> tuple[float, int]:
    """Return the next hull that stands in; where there is none, ask for it and take the points to be flat for now."""
    state, volume, kept = stand_ins.state, 0.0, count
    k = state[_MET]
    state[_MET] += 1
    if k < len(stand_ins.volume):
        volume, at = stand_ins.volume[k], stand_ins.first[k]
        kept = stand_ins.first[k + 1] - at
        for i in range(kept):
            work.point[i, KEPT] = stand_ins.vertex[at + i]
        for i in range(2 * kept - 4):
            work.stack[i, 0] = work.stack[i, 1] = work.stack[i, 2] = -1
        return volume, kept
    for i in range(count):
        work.point[i, KEPT] = rows[i]
        if k == len(stand_ins.volume):
            stand_ins.asked[i] = rows[i]
            state[_ASKED] = count
    return volume, kept
