"""What views know of the space around an object: asked of the views, or as a written cloud keeps it.

A cloud alone says where the surface was seen. Its views also know where they looked past, which is what keeps gaps
and hollows open; so a cloud that is written keeps that for every cell of its Delaunay complex.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from steelyard import check
from steelyard.check import Array, Integers
from steelyard.errors import BadValue
from steelyard.findings import Finding
from steelyard.shape.tets import TetMesh
from steelyard.spatial import area_vectors

# Places in a cell that are asked: its centroid, and halfway from there to each corner.
_PLACES = np.array([[0.25] * 4, *(0.15 + 0.4 * np.eye(4))])


@dataclass(frozen=True, eq=False)
class SeenSpace:
    """The space around an object as its views answer for it.

    empty      how surely points (N, 3) lie outside the object (N,): 1 seen to be empty, 0 nothing says so, between
               before a surface by less than its noise; a cell of such places is neither seen empty nor hidden
    guess      share of a skin, middles (N, 3) and outward areas (N, 3) of its triangles, on which no view measured a
               surface; of what stands clear of the table and does not face it. None: not asked
    unseen     share of the object's surface that nobody saw
    unsure_m3  standard deviation of the object's volume that table and moved cameras leave open [m^3]
    """

    empty: Callable[[Array], Any]
    guess: Callable[[Array, Array], float] | None = None
    unseen: float = 0.0
    unsure_m3: float = 0.0

    def emptied(self, cells: TetMesh) -> Array:
        """Return the share (T,) of each cell that the views know to be outside, in whole fifths."""
        return self._fifths(cells) / len(_PLACES)

    def _fifths(self, cells: TetMesh) -> Integers:
        asked = np.einsum("pk,tkd->ptd", _PLACES, cells.vertices[cells.tets])
        empty = np.asarray(self.empty(asked.reshape(-1, 3)), float).reshape(len(_PLACES), -1)
        return np.asarray(np.rint(empty.sum(0)).astype(np.int64))

    def guessed(self, solid: TetMesh) -> float:
        """Return the share of the skin of a solid on which no view measured a surface."""
        if self.guess is None:
            return 0.0
        corners = solid.vertices[solid.surface]
        return self.guess(corners.mean(1), area_vectors(corners))

    def kept(self, cells: TetMesh) -> KeptSpace:
        """Return what is to be kept of it with the cloud whose complex has these cells."""
        return KeptSpace(self.unseen, self.unsure_m3, self._fifths(cells)[_in_order(cells)])


@dataclass(frozen=True, eq=False)
class KeptSpace:
    """The space around an object as a written cloud keeps it.

    unseen, unsure_m3  as in `SeenSpace`
    fifths     (T,) of each cell of the complex of its points that are known to be outside, 0 to 5; cells in the order
               of the numbers of their corners. (0,) where none are known
    skin       share of the skin of the solid on which no view measured a surface
    """

    unseen: float
    unsure_m3: float = 0.0
    fifths: Integers = field(default_factory=lambda: np.zeros(0, np.int64))
    skin: float = 0.0

    def __post_init__(self) -> None:
        fifths = check.whole("fifths of cells", self.fifths)
        if fifths.ndim != 1 or (len(fifths) and not 0 <= fifths.min() <= fifths.max() <= len(_PLACES)):
            raise BadValue(f"what cells are empty must be whole fifths (T,), 0 to {len(_PLACES)}.")
        object.__setattr__(self, "fifths", fifths)
        for name in ("skin", "unseen", "unsure_m3"):
            check.not_negative(name, getattr(self, name))
        if max(self.skin, self.unseen) > 1:
            raise BadValue(f'"skin" and "unseen" are shares of 1; got {self.skin:g} and {self.unseen:g}.')

    def fits(self, cells: TetMesh | None) -> bool:
        """Return whether these are the cells that it was kept for: points may have been taken away since."""
        return cells is not None and len(cells) == len(self.fifths)

    def emptied(self, cells: TetMesh) -> Array:
        """Return the share (T,) of each cell that the views knew to be outside."""
        share = np.empty(len(cells))
        share[_in_order(cells)] = self.fifths / len(_PLACES)
        return share

    def guessed(self, solid: TetMesh) -> float:
        """Return the share of the skin that was a guess when the cloud was written."""
        return self.skin


Space = SeenSpace | KeptSpace


@dataclass(frozen=True, eq=False)
class Kept:
    """What a scan says beside the points of its cloud.

    findings   what one must know of the views
    space      what they know of the space around the object
    place_std  standard deviations of where the cloud lies as a whole, per axis [m], [rad]; 0 where poses were right
    """

    findings: tuple[Finding, ...]
    space: KeptSpace
    place_std: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        for value in self.place_std:
            check.not_negative("place_std", value)


def _in_order(cells: TetMesh) -> Integers:
    """Return the numbers (T,) of cells in the order of the numbers of their corners."""
    corners: Integers = np.sort(cells.tets, axis=1)
    return np.asarray(np.lexsort(corners.T[::-1]))
