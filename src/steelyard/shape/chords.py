"""What a solid whose corners are points of a round surface lacks between them."""

from __future__ import annotations

import numpy as np

from steelyard.shape.orient import Oriented

_NEAREST = 6  # neighbours across which the surface is a chord
_SMOOTH = np.radians(60.0)  # neighbours whose normals are farther apart lie on two faces


def lacking(surface: Oriented, volume: float) -> float:
    """Return the volume between the surface and its chords as a share of the solid's.

    volume  of the solid, in units of the surface

    A chord of length d between normals t apart leaves a gap of d t / 8 in its middle. Round bodies come out smaller by
    about half of this, hollows larger.
    """
    index, apart = surface.sites.near.index[:, :_NEAREST], surface.sites.near.distance[:, :_NEAREST]
    turn = np.arccos(np.clip(np.einsum("nkd,nd->nk", surface.normals[index], surface.normals), -1, 1))
    smooth = turn < _SMOOTH
    gap = (apart * turn * smooth).sum(1) / (8 * np.maximum(smooth.sum(1), 1))
    return float((surface.area * gap).sum() / volume)
