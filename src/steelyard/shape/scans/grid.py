"""The table in square cells: where heights are mapped, and what lies over which of them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from steelyard.check import Array, Integers, Mask

Cells = tuple[Integers, Integers]  # rows (N,) and columns (N,), as they index a map (I, J)


class Grid(NamedTuple):
    """I x J square cells on the table.

    low    (2,) corner that they are counted from [m]
    pitch  edge of a cell [m]
    shape  how many there are along x and y: (I, J)
    """

    low: Array
    pitch: float
    shape: tuple[int, int]

    @classmethod
    def about_origin(cls, half: int, pitch: float) -> Grid:
        """Return so many cells to each side of the origin."""
        return cls(np.full(2, -half * pitch), pitch, (2 * half, 2 * half))

    @classmethod
    def under(cls, points: Array, pitch: float) -> Grid:
        """Return the cells under points (N, 3), with two to spare on all sides."""
        low = points[:, :2].min(0) - 2 * pitch
        rows, columns = np.ceil((points[:, :2].max(0) + 2 * pitch - low) / pitch).astype(int).tolist()
        return cls(low, pitch, (rows, columns))

    def cells_under(self, points: Array) -> tuple[Cells, Mask]:
        """Return the cells under points (N, 3), the nearest of those beyond the grid, and which points are over it."""
        i, j = np.floor((points[:, :2] - self.low) / self.pitch).astype(int).T
        rows, columns = self.shape
        within = (i >= 0) & (j >= 0) & (i < rows) & (j < columns)
        return (i.clip(0, rows - 1), j.clip(0, columns - 1)), within

    def middles(self, cells: Integers) -> Array:
        """Return the middles (N, 2) of cells (N, 2) [m]."""
        return self.low + self.pitch * (cells + 0.5)

    def spots(self, mask: Mask, height: Array | float = 0.0) -> Array:
        """Return the middles (N, 3) of the cells of a mask (I, J), at heights (N,) over the table [m]."""
        xy = self.middles(np.argwhere(mask))
        return np.column_stack([xy, np.broadcast_to(height, len(xy))])
