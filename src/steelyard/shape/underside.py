"""The side that lies on the table: closed where the object comes down to it, spanned flat where it does not.

The paper projects the whole cloud on the table. Here a column of space under the object is closed at the table only
where nothing shows that there is a gap; a part that stands off the table is closed at the height where its seen sides
end, and never below space that some view saw to be empty.
Source: "The Sum of Its Parts", section V-A; we differ as said.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import ndimage, sparse
from scipy.sparse.linalg import spsolve

from steelyard.check import Array
from steelyard.shape.mesh import Integers

_DOWNWARD = -0.35  # a normal that points down by more than this belongs to an underside that was seen
_CONTACT = 3.0  # a side that ends within this many grid widths of the table, no gap seen, stands on it


@dataclass(frozen=True, eq=False)
class Underside:
    """Height over the table at which the object begins, on a grid.

    low     (2,) corner of the grid [m]
    pitch   width of its cells [m]
    height  (I, J) [m], inf where there is no object above
    seen    (I, J) whether surface points lie on that underside already
    """

    low: Array
    pitch: float
    height: Array
    seen: Any

    def points(self) -> tuple[Array, Array]:
        """Return points (N, 3) that close the underside, in the table's frame, and their normals (N, 3)."""
        i, j = np.nonzero(np.isfinite(self.height) & ~self.seen)
        filled = np.where(np.isfinite(self.height), self.height, np.nan)
        slope = np.stack([_slope(filled, 0), _slope(filled, 1)])[:, i, j] / self.pitch
        normal = np.stack([slope[0], slope[1], -np.ones(len(i))], axis=1)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        xy = self.low + self.pitch * (np.stack([i, j], axis=1) + 0.5)
        return np.column_stack([xy, self.height[i, j]]), normal

    def below(self, points: Array) -> Any:
        """Return whether points (N, 3) lie under the object or under the table."""
        place = np.floor((points[:, :2] - self.low) / self.pitch).astype(int)
        inside = ((place >= 0) & (place < self.height.shape)).all(1)
        place = np.clip(place, 0, np.array(self.height.shape) - 1)
        height = self.height[place[:, 0], place[:, 1]]
        return (points[:, 2] < 0) | (inside & np.isfinite(height) & (points[:, 2] < height - 0.5 * self.pitch))


def _slope(height: Array, axis: int) -> Array:
    """Return half the difference of the neighbours along an axis, 0 where one has no height."""
    after, before = np.roll(height, -1, axis), np.roll(height, 1, axis)
    return np.nan_to_num((after - before) / 2)


def underside(
    xyz: Array, normal: Array, low: Array, pitch: float, empty_to: Array, table_seen: Any, top: Array
) -> Underside:
    """Return where the object begins above the table.

    xyz, normal  (N, 3) the seen surface, in the table's frame
    low, pitch   the grid
    empty_to     (I, J) height up to which each column was seen to be empty [m], inf if up to the top
    table_seen   (I, J) whether the table itself was seen there
    top          (I, J) highest seen surface in the column, -inf without
    """
    under = np.isfinite(empty_to) & (empty_to < top)
    cell = np.floor((xyz[:, :2] - low) / pitch).astype(int)
    down = normal[:, 2] < _DOWNWARD
    seen = np.isfinite(_mean(cell[down], xyz[down, 2], under.shape)) & under
    out = ndimage.median_filter(np.where(under, empty_to, top), 3, mode='nearest')
    return Underside(low, pitch, np.where(under, out, np.inf), seen)


def _lowest(cell: Integers, height: Array, shape: tuple[int, ...]) -> Array:
    """Return the lowest height in each cell of a grid, inf where there is none."""
    out = np.full(shape, np.inf)
    inside = ((cell >= 0) & (cell < shape)).all(1)
    np.minimum.at(out, (cell[inside, 0], cell[inside, 1]), height[inside])
    return out


def _mean(cell: Integers, height: Array, shape: tuple[int, ...]) -> Array:
    """Return the mean height in each cell of a grid, inf where there is none."""
    inside = ((cell >= 0) & (cell < shape)).all(1)
    place = np.ravel_multi_index(tuple(cell[inside].T), shape)
    count = np.bincount(place, minlength=shape[0] * shape[1])
    total = np.bincount(place, height[inside], shape[0] * shape[1])
    return np.where(count > 0, total / np.maximum(count, 1), np.inf).reshape(shape)


def _shifted(values: Array, fill: float) -> Array:
    """Return the nine neighbours (9, I, J) of each cell, itself among them."""
    padded = np.pad(values, 1, constant_values=fill)
    i, j = values.shape
    return np.stack([padded[a : a + i, b : b + j] for a in range(3) for b in range(3)])


def _spread_minimum(values: Array) -> Array:
    return np.asarray(_shifted(values, np.inf).min(0))


def _eroded(mask: Any) -> Any:
    return _shifted(mask, False).all(0)


def _grown(mask: Any) -> Any:
    return _shifted(mask, False).any(0)


def _spanned(height: Array, fixed: Any, under: Any) -> Array:
    """Return heights under the object that bend as little as can be, `fixed` cells kept (a thin plate).

    Where a band of the underside was seen its slope goes on smoothly; from a bare rim the plate hangs flat.
    """
    free = under & ~fixed
    out = np.where(under, height, np.nan)
    if not free.any():
        return out
    number = np.full(under.shape, -1)
    number[under] = np.arange(under.sum())
    inner = under & np.stack([np.roll(under, step, axis) for axis in (0, 1) for step in (-1, 1)]).all(0)
    inner[[0, -1]] = inner[:, [0, -1]] = False
    i, j = np.nonzero(inner & (free | _grown(free)))
    near = [number[i, j], number[i - 1, j], number[i + 1, j], number[i, j - 1], number[i, j + 1]]
    row = np.tile(np.arange(len(i)), 5)
    weight = np.repeat([4.0, -1.0, -1.0, -1.0, -1.0], len(i))
    bend = sparse.csc_matrix((weight, (row, np.concatenate(near))), (len(i), int(under.sum())))
    known, unknown = number[fixed & under], number[free]
    A = bend[:, unknown]
    load = A.T @ (bend[:, known] @ height[fixed & under])
    out[free] = spsolve((A.T @ A + 1e-9 * sparse.identity(len(unknown))).tocsc(), -load)
    return out
