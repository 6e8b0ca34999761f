"""Cells that hang free of the body: groups without a face in common with it."""

from __future__ import annotations

import numba
import numpy as np

from steelyard.check import Mask
from steelyard.shape.mesh import Integers
from steelyard.shape.tets import TetMesh

_SMALL = 0.01  # of the volume: a larger group is a body of its own


def without_islands(mesh: TetMesh, inside: Mask) -> Mask:
    """Return which cells (T,) of a complex are inside, less small free groups that no point needs.

    Such a group has all its corners on larger ones: it spans a gap. One with a point of its own is a piece of the
    object, as of a blade that the cells fill only here and there.
    """
    group = _groups(mesh.neighbours, inside)
    volume = np.bincount(group, mesh.volumes * inside)
    small = inside & (volume[group] < _SMALL * volume.sum())
    if not small.any():
        return inside
    held = np.zeros(len(mesh.vertices), bool)
    held[mesh.tets[inside & ~small]] = True
    needed = np.bincount(group, small & ~held[mesh.tets].all(1)) > 0
    return np.asarray(inside & (~small | needed[group]))


@numba.njit(cache=True, nogil=True)
def _groups(neighbours: Integers, inside: Mask) -> Integers:
    """Return the number (T,) of the group of cells joined by faces that each cell inside is of; 0 outside."""
    group, stack, count = np.zeros(len(inside), np.int64), np.empty(len(inside), np.int64), 0
    for first in range(len(inside)):
        if not inside[first] or group[first]:
            continue
        count += 1
        group[first], stack[0], waiting = count, first, 1
        while waiting:
            waiting -= 1
            cell = stack[waiting]
            for k in range(4):
                beside = neighbours[cell, k]
                if beside >= 0 and inside[beside] and not group[beside]:
                    group[beside], stack[waiting] = count, beside
                    waiting += 1
    return group
