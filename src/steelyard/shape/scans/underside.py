"""The side that lies on the table: closed at the table where the object comes down to it, and flat where it does not.

The paper projects the whole cloud on the table. Here the space over each spot of the table counts as the object's only
as far down as no view saw it to be empty. Under a part that stands off the table that leaves a wedge which no sight
line reached, as steep as the lowest sight line: there the underside goes on from where it was last seen, bending as
little as can be.
Source: "The Sum of Its Parts", section V-A; we differ as said.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import ndimage, sparse
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree

from steelyard.check import Array, Integers, Mask
from steelyard.shape.scans import sight_lines
from steelyard.shape.scans.grid import Grid
from steelyard.shape.scans.scene import WINDOW, Scene
from steelyard.spatial import unit_vectors

_WALL = 0.5  # a normal less upright than this belongs to a wall
_FOOT, _HIGHEST_FOOT = 0.0005, 0.008  # steps in which the end of a wall is sought, and how far up [m]
DOWNWARD = -0.35  # a normal that points down by more than this belongs to an underside that was seen
_TAUT = 1e-3  # weight of the underside's slope beside its bending
_STEEPER = 1.3  # than the lowest sight line: a slope that is the object's own, not the edge of what was seen


@dataclass(frozen=True, eq=False)
class Underside:
    """Height over the table at which the object begins, on a grid.

    grid    on the table
    height  (I, J) [m], inf where there is no object above
    seen    (I, J) whether surface points lie on that underside already
    top     (I, J) highest seen surface [m], -inf without
    empty   (I, J) height up to which views saw that nothing is there [m], 0 where there is no object above
    filled  volume of it that is there only if the object is as round below as it is above [m^3]
    """

    grid: Grid
    height: Array
    seen: Any
    top: Array
    empty: Array
    filled: float = 0.0

    @property
    def under(self) -> Mask:
        """Over which cells (I, J) there is an object."""
        return np.isfinite(self.height)

    def points(self) -> tuple[Array, Array]:
        """Return points (N, 3) that close the underside, in the table's frame, and their normals (N, 3)."""
        open_ = self.under & ~self.seen
        filled = np.where(self.under, self.height, np.nan)
        slope = np.stack([_slope(filled, 0)[open_], _slope(filled, 1)[open_]]) / self.grid.pitch
        normal = unit_vectors(np.stack([slope[0], slope[1], -np.ones(slope.shape[1])], axis=1))
        return self.grid.spots(open_, self.height[open_]), normal

    def below(self, points: Array) -> Any:
        """Return whether points (N, 3) lie under the table, under the object, or beside it where it covers no table."""
        cells, within = self.grid.cells_under(points)
        height = np.where(within, self.height[cells], np.inf)
        return (points[:, 2] < 0) | (points[:, 2] < height - 0.5 * self.grid.pitch)


def _slope(height: Array, axis: int) -> Array:
    """Return half the difference of the neighbours along an axis, 0 where one has no height."""
    return np.asarray(np.nan_to_num((np.roll(height, -1, axis) - np.roll(height, 1, axis)) / 2))


def closed_below(scene: Scene, xyz: Array, normal: Array, pitch: float) -> Underside:
    """Return the underside of the seen surface, points (N, 3) with normals, on a grid of `pitch` [m]."""
    grid = Grid.under(xyz, pitch)
    top = np.full(grid.shape, -np.inf)
    np.maximum.at(top, grid.cells_under(xyz)[0], xyz[:, 2])
    top = ndimage.maximum_filter(top, 3, mode="constant", cval=-np.inf)
    high = np.isfinite(top)
    foot = grid.spots(high)
    up = np.tile([0.0, 0.0, 1.0], (len(foot), 1))
    support = sight_lines.settled(scene.images, settled := foot.copy(), up, WINDOW, scene.noise, 2)
    table = np.zeros(grid.shape, bool)
    table[high] = (support[:, 0] + support[:, 1] >= scene.enough) & (settled[:, 2] < 0.3 * scene.sigma)
    empty_to = np.full(grid.shape, np.inf)
    sight = _lowest_sight(scene)
    away = sight * pitch * ndimage.distance_transform_edt(table | ~high)
    empty_to[high] = _empty_to(scene, foot, table[high], top[high], pitch, away[high])
    _raise_to_feet(scene, xyz, normal, grid, empty_to, top)
    return _underside(xyz, normal, grid, empty_to, top, sight)


def _raise_to_feet(scene: Scene, xyz: Array, normal: Array, grid: Grid, empty_to: Array, top: Array) -> None:
    """Raise the empty height of the outermost columns under the object to where the walls over them end."""
    under = np.isfinite(empty_to) & (empty_to < top)
    rim = rim_of(under)
    wall = np.abs(normal[:, 2]) < _WALL
    i, j = np.nonzero(rim)
    if not len(i) or not wall.any():
        return
    away, nearest = cKDTree(xyz[wall, :2]).query(grid.spots(rim)[:, :2], distance_upper_bound=2 * grid.pitch)
    has = np.isfinite(away)
    i, j, nearest = i[has], j[has], nearest[has]
    level = unit_vectors(normal[wall][nearest] * [1.0, 1.0, 0.0])
    foot = sight_lines.feet(
        scene.images, xyz[wall][nearest].copy(), level, _FOOT, int(_HIGHEST_FOOT / _FOOT), scene.noise
    )
    empty_to[i, j] = np.maximum(empty_to[i, j], np.minimum(foot, top[i, j] - 1e-6))


def _lowest_sight(scene: Scene) -> float:
    """Return the slope of the low sight lines to the object, a quarter of the views being lower."""
    return float(np.percentile(scene.p[:, 2] / np.linalg.norm(scene.p[:, :2], axis=1), 25))


def _empty_to(scene: Scene, foot: Array, table_seen: Any, top: Array, step: float, near: Array) -> Array:
    """Return up to which height the column over each foot (N, 3) was seen to be empty [m], inf if up to its top."""
    out = np.where(table_seen, np.minimum(near, top), 0.0)
    # Sight lines that end on the table pass over it; nearer to it than the noise only their slope tells how high.
    height = 3 * scene.sigma
    open_ = np.flatnonzero(table_seen)
    out[table_seen & (top <= np.minimum(height, near))] = np.inf
    while len(open_):
        open_ = open_[top[open_] > height]
        at = foot[open_].copy()
        at[:, 2] = height
        open_ = open_[scene.seen_empty(at)]
        out[open_] = height + step / 2
        out[open_[top[open_] <= height + step]] = np.inf
        height += step
    return out


def _underside(xyz: Array, normal: Array, grid: Grid, empty_to: Array, top: Array, sight: float) -> Underside:
    """Return where the object begins above the table.

    xyz, normal  (N, 3) the seen surface, in the table's frame
    empty_to     (I, J) height up to which each column was seen to be empty [m], inf if up to the top
    top          (I, J) highest seen surface in the column, -inf without
    sight        slope of the lowest sight lines
    """
    under = np.isfinite(empty_to) & (empty_to < top)
    seen = np.zeros(under.shape, np.bool_)
    seen[grid.cells_under(xyz[normal[:, 2] < DOWNWARD])[0]] = True
    height = np.where(under, empty_to, 0.0)
    smooth = _smooth(ndimage.median_filter(height, 3), under)
    steep = under & (_steepness(smooth, under) / grid.pitch > _STEEPER * sight)
    rim = rim_of(under)
    bare = rim & ~steep
    height = np.where(bare, median_along(height, rim), height)
    span = _spanned(height, rim, steep, under)
    closed = np.where(under, np.clip(span, 0.0, np.where(under, top, 0.0)), np.inf)
    return Underside(grid, closed, seen & under, top, np.where(under, empty_to, 0.0))


def rim_of(under: Any) -> Any:
    """Return the outermost of cells (I, J)."""
    return under & ~ndimage.binary_erosion(under, np.ones((3, 3)))


def median_along(height: Array, rim: Any) -> Array:
    """Return heights (I, J), those of the rim the median of the cells of the rim within two cells of them."""
    out, padded = height.copy(), np.pad(np.where(rim, height, np.nan), 2, constant_values=np.nan)
    i, j = np.nonzero(rim)
    beside, above = np.divmod(np.arange(25), 5)
    near = np.sort(padded[i[:, None] + beside, j[:, None] + above], axis=1)  # cells of no rim come last
    out[i, j] = near[np.arange(len(i)), (np.isfinite(near).sum(1) - 1) // 2]
    return out


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
    return np.asarray(np.sqrt(out))


def _spanned(height: Array, rim: Any, steep: Any, under: Any) -> Array:
    """Return heights under the object that bend as little as can be, cells of `rim` and `steep` kept.

    Where a slope of the object itself was seen it goes on and levels out, as a rod's does; from a rim, whose slope says
    nothing, the underside goes on flat. The least sum over cells of (mean of the neighbours - height)^2, and _TAUT
    times that of the steps between neighbours.
    """
    out = np.where(under, height, 0.0)
    fixed = (rim | steep) & under
    free = under & ~fixed
    if not free.any():
        return out
    number = np.full(under.shape, -1)
    number[under] = np.arange(under.sum())
    steps = _steps(number)
    laplace = (steps.T @ steps).tocsr()
    bend = laplace[number[free | (steep & under)]]
    energy = (bend.T @ bend + _TAUT * laplace).tocsr()
    kept, open_ = number[fixed], number[free]
    rows = energy[open_]
    # Symmetric and positive: rows need not be exchanged, and an order for symmetric matrices fills in less.
    factor = splu(
        rows[:, open_].tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    out[free] = factor.solve(-rows[:, kept] @ out[fixed])
    return out


def _steps(number: Integers) -> Any:
    """Return the matrix of the differences of neighbouring cells; `number` is -1 where there is none."""
    pairs = [(number[1:], number[:-1]), (number[:, 1:], number[:, :-1])]
    a, b = (np.concatenate([pair[k].ravel() for pair in pairs]) for k in (0, 1))
    both = (a >= 0) & (b >= 0)
    a, b = a[both], b[both]
    row = np.arange(len(a))
    value = np.concatenate([np.ones(len(a)), -np.ones(len(a))])
    return sparse.csr_matrix((value, (np.concatenate([row, row]), np.concatenate([a, b]))), (len(a), number.max() + 1))
