"""Cells of a solid cut in two wherever one of their edges is cut."""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from steelyard.check import Array, Integers
from steelyard.shape.pairs import distinct_pairs
from steelyard.shape.tets import TetMesh

_EDGES = ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3))
_LEAST = 0.01  # share of an edge that is left on either side of a cut, so that no cell becomes flat


@dataclass(frozen=True, eq=False)
class CutCells:
    """T cells of a solid, some of them cut from larger ones.

    mesh  the solid; the places of the cuts are vertices behind those there were, in the order of the edges
    cell  (T,) the cell of the uncut solid that each is, or was cut from; uncut cells come first, in their order
    """

    mesh: TetMesh
    cell: Integers


def crossing_edges(mesh: TetMesh, label: Integers) -> Integers:
    """Return the edges (E, 2) of the cells whose ends have different labels (V,), each once, the lower label first."""
    corners = label[mesh.tets]
    mixed = mesh.tets[(corners != corners[:, :1]).any(1)]
    ends = mixed[:, _EDGES].reshape(-1, 2)
    one, two = label[ends].T
    ends = np.where((one < two)[:, None], ends, ends[:, ::-1])[one != two]
    return distinct_pairs(ends[:, 0], ends[:, 1], len(mesh.vertices))


def cut_cells(mesh: TetMesh, edges: Integers, share: Array) -> CutCells:
    """Return the solid with `edges` (E, 2), each once, cut at these shares (E,) of the way along them.

    In every cell the longest edge is cut first, so that cells which meet in a face cut it alike.
    """
    first, second = mesh.vertices[edges[:, 0]], mesh.vertices[edges[:, 1]]
    places = first + np.clip(share, _LEAST, 1 - _LEAST)[:, None] * (second - first)
    rank = np.empty(len(edges), np.int64)
    rank[np.argsort(-np.linalg.norm(second - first, axis=1), kind="stable")] = np.arange(len(edges))
    count = len(mesh.vertices)
    key = edges.min(1) * count + edges.max(1)
    order = np.argsort(key)
    ends = np.zeros(count, np.bool_)
    ends[edges] = True
    near = ends[mesh.tets].sum(1) > 1
    touched = np.flatnonzero(near)
    tets, cell = _cut(mesh.tets[near], count, key[order], order, rank)
    whole = np.flatnonzero(~near)
    vertices = np.concatenate([mesh.vertices, places])
    return CutCells(TetMesh(vertices, np.concatenate([mesh.tets[whole], tets])), np.concatenate([whole, touched[cell]]))


@numba.njit(cache=True, nogil=True)
def _cut(tets: Integers, count: int, keys: Integers, number: Integers, rank: Integers) -> tuple[Integers, Integers]:
    """Return cells (T, 4) and the row (T,) of `tets` that each was cut from.

    keys    (E,) rising, of the edges that are cut: lower end * count + upper end
    number  (E,) of each of those among the cuts; rank (E,), by that number, says which is cut first
    """
    room, filled = 2 * len(tets) + 64, 0
    out, cell = np.empty((room, 4), np.int64), np.empty(room, np.int64)
    stack = np.empty((64, 4), np.int64)
    for t in range(len(tets)):
        if filled + 64 > room:
            room *= 2
            out = np.concatenate((out, np.empty((room - len(out), 4), np.int64)))
            cell = np.concatenate((cell, np.empty(room - len(cell), np.int64)))
        waiting = 1
        stack[0] = tets[t]
        while waiting > 0:
            waiting -= 1
            now = stack[waiting].copy()
            best, p, q = -1, 0, 0
            for i in range(4):
                for j in range(i + 1, 4):
                    if now[i] >= count or now[j] >= count:
                        continue
                    key = min(now[i], now[j]) * count + max(now[i], now[j])
                    k = np.searchsorted(keys, key)
                    if k < len(keys) and keys[k] == key and (best < 0 or rank[number[k]] < rank[best]):
                        best, p, q = number[k], i, j
            if best < 0:
                out[filled], cell[filled] = now, t
                filled += 1
                continue
            stack[waiting], stack[waiting + 1] = now, now
            stack[waiting, p], stack[waiting + 1, q] = count + best, count + best
            waiting += 2
    return out[:filled].copy(), cell[:filled].copy()
