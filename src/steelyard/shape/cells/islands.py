"""Cells that hang free of the body: groups without a face in common with it."""

from __future__ import annotations

import numpy as np

from steelyard.check import Mask
from steelyard.shape.pairs import joined
from steelyard.shape.tets import TetMesh

_SMALL = 0.01  # of the volume: a larger group is a body of its own


def without_islands(mesh: TetMesh, inside: Mask) -> Mask:
    """Return which cells (T,) of a complex are inside, less small free groups that no point needs.

    Such a group has all its corners on larger ones: it spans a gap. One with a point of its own is a piece of the
    object, as of a blade that the cells fill only here and there.
    """
    group = joined(mesh.dual[inside[mesh.dual].all(1)], len(mesh))
    volume = np.bincount(group, mesh.volumes * inside)
    small = inside & (volume[group] < _SMALL * volume.sum())
    if not small.any():
        return inside
    held = np.zeros(len(mesh.vertices), bool)
    held[mesh.tets[inside & ~small]] = True
    needed = np.bincount(group, small & ~held[mesh.tets].all(1)) > 0
    return np.asarray(inside & (~small | needed[group]))
