"""The side that lies on the table: closed at the table where the object comes down to it, and flat where it does not.

The paper projects the whole cloud on the table. Here the space over each spot of the table counts as the object's only
as far down as no view saw it to be empty. Under a part that stands off the table that leaves a wedge which no sight
line reached, as steep as the lowest sight line: there the underside goes on flat from where it was last seen.
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
_STEEPER = 1.3  # than the lowest sight line: a slope that is the object's own, not the edge of what was seen


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
        under = np.isfinite(self.height)
        i, j = np.nonzero(under & ~self.seen)
        filled = np.where(under, self.height, np.nan)
        slope = np.stack([_slope(filled, 0)[i, j], _slope(filled, 1)[i, j]]) / self.pitch
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
    return np.asarray(np.nan_to_num((np.roll(height, -1, axis) - np.roll(height, 1, axis)) / 2))


def underside(
    xyz: Array, normal: Array, low: Array, pitch: float, empty_to: Array, top: Array, sight: float
) -> Underside:
    """Return where the object begins above the table.

    xyz, normal  (N, 3) the seen surface, in the table's frame
    low, pitch   the grid
    empty_to     (I, J) height up to which each column was seen to be empty [m], inf if up to the top
    top          (I, J) highest seen surface in the column, -inf without
    sight        slope of the lowest sight lines
    """
    under = np.isfinite(empty_to) & (empty_to < top)
    cell = np.floor((xyz[:, :2] - low) / pitch).astype(int)
    down = cell[normal[:, 2] < _DOWNWARD]
    seen = np.zeros(under.shape, np.bool_)
    down = down[((down >= 0) & (down < under.shape)).all(1)]
    seen[down[:, 0], down[:, 1]] = True
    height = np.where(under, empty_to, 0.0)
    smooth = _smooth(ndimage.median_filter(height, 3), under)
    steep = under & (_steepness(smooth, under) / pitch > _STEEPER * sight)
    rim = under & ~ndimage.binary_erosion(under, np.ones((3, 3)))
    bare = rim & ~steep
    height = np.where(bare, _median_along(height, rim), height)
    span = _spanned(height, rim | steep, under)
    return Underside(low, pitch, np.where(under, np.clip(span, 0.0, np.where(under, top, 0.0)), np.inf), seen & under)


def _median_along(height: Array, rim: Any) -> Array:
    """Return for each cell the median height of the cells of the rim within two cells of it, 0 without any."""
    padded = np.pad(np.where(rim, height, np.nan), 2, constant_values=np.nan)
    i, j = height.shape
    near = np.sort(np.stack([padded[a : a + i, b : b + j] for a in range(5) for b in range(5)]), axis=0)
    middle = np.maximum(np.isfinite(near).sum(0) - 1, 0) // 2
    return np.nan_to_num(np.take_along_axis(near, middle[None], axis=0)[0])


def _smooth(height: Array, under: Any) -> Array:
    """Return heights averaged with their neighbours under the object."""
    weight = ndimage.gaussian_filter(under.astype(float), 1.0)
    return np.asarray(ndimage.gaussian_filter(np.where(under, height, 0.0), 1.0) / np.maximum(weight, 1e-9))


def _steepness(height: Array, under: Any) -> Array:
    """Return the largest rise from a cell to those of its neighbours that lie under the object too, per cell width."""
    out = np.zeros(height.shape)
    for axis in (0, 1):
        total, count = np.zeros(height.shape), np.zeros(height.shape)
        for step in (-1, 1):
            there = np.roll(under, step, axis) & under
            total += np.where(there, step * (height - np.roll(height, step, axis)), 0.0)
            count += there
        out += (total / np.maximum(count, 1)) ** 2
    return np.sqrt(out)


def _spanned(height: Array, fixed: Any, under: Any) -> Array:
    """Return heights under the object that are the mean of their neighbours', `fixed` cells kept (Laplace)."""
    free = under & ~fixed
    out = np.where(under, height, 0.0)
    if not free.any():
        return out
    number = np.full(under.shape, -1)
    number[free] = np.arange(free.sum())
    i, j = np.nonzero(free)
    rows, columns, load, degree = [], [], np.zeros(len(i)), np.zeros(len(i))
    for a, b in ((i - 1, j), (i + 1, j), (i, j - 1), (i, j + 1)):
        inside = under[a, b]
        degree += inside
        near: Integers = number[a, b]
        rows.append(np.flatnonzero(near >= 0))
        columns.append(near[near >= 0])
        load += np.where(inside & (near < 0), out[a, b], 0.0)
    row, column = np.concatenate(rows), np.concatenate(columns)
    size = (len(i), len(i))
    matrix = sparse.diags(degree) - sparse.csc_matrix((np.ones(len(row)), (row, column)), size)
    out[free] = spsolve(matrix.tocsc(), load)
    return out
