"""The points of a surface, and what they tell before any side is known: neighbours, sheets, the cells between them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from steelyard.check import Array
from steelyard.shape.cells.cells import cells
from steelyard.shape.cells.complex import Complex
from steelyard.shape.cloud import Cloud
from steelyard.shape.points.spacing import Neighbours
from steelyard.shape.sides.layers import Layers
from steelyard.shape.sides.sheets import sheet_planes
from steelyard.shape.sides.tree import Tree
from steelyard.shape.sides.winding import Sight
from steelyard.shape.tets import TetMesh


@dataclass(frozen=True, eq=False)
class Sites:
    """N points in units of their diagonal; what hangs on them alone is found once, whatever sides are tried.

    points    (N, 3) as they were given [m]
    diagonal  of those [m]
    xyz       (N, 3) about the mean, over the diagonal
    near      their neighbours
    tree      of the points
    spacing   median of the points
    """

    points: Array
    diagonal: float
    xyz: Array
    near: Neighbours
    tree: Tree
    spacing: float

    @classmethod
    def of(cls, cloud: Cloud) -> Sites:
        """Return the points of a cloud."""
        diagonal = cloud.diagonal
        xyz, near = (cloud.xyz - cloud.xyz.mean(0)) / diagonal, cloud.near.scaled(1 / diagonal)
        return cls(cloud.xyz, diagonal, xyz, near, Tree.of(xyz), near.spacing)

    @cached_property
    def delaunay(self) -> Complex:
        """Their Delaunay complex."""
        return Complex.of(self.xyz, self.tree.order)

    @cached_property
    def sight(self) -> Sight:
        """How they see one another."""
        return Sight.of(self.tree, self.tree)

    @cached_property
    def _sheets(self) -> tuple[Array, Array]:
        return sheet_planes(self.xyz, self.near.index)

    def sheets(self, layers: Layers | None = None) -> tuple[Array, Array]:
        """Return planes (N, 3) of either sign and links (N, K) as `sheet_planes` does.

        layers  of walls thinner than the spacing, where there are any: neighbours across them look the other way
        """
        return self._sheets if layers is None else layers.told(*self._sheets, self.near.index)

    @cached_property
    def cells(self) -> tuple[TetMesh, Array]:
        """The T cells of the complex without its flat leftovers [m], and centroids (T, 3) in units of the diagonal."""
        tets, neighbours, volumes, centres = cells(self.xyz, self.delaunay.simplices, self.delaunay.beside)
        unit = (np.ptp(self.points, axis=0) ** 2).sum() ** 1.5
        return TetMesh.known(self.points, tets, volumes * unit, neighbours), centres

    @cached_property
    def sight_of_cells(self) -> Sight:
        """How the centroids of the cells see the points."""
        return Sight.of(Tree.of(self.cells[1]), self.tree)
