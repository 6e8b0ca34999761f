"""What hangs over the table: space under it that was closed though nobody saw it, and that may as well be empty.

Under a part that stands off the table the lowest sight lines leave a wedge. A rod fills it and a blade does not, and no
view tells which. But a rod hangs below where it was last seen by no more than it rises above that, and what is sheer
from there to its top is no rod. What was closed farther down is as likely air: the volume's bar holds all of it.

Nor is it seen how a thin rod goes on below its sides, so near to the table. The bar holds what was filled there because
the rod is round above, and what was left open and would be filled, too, if it were as round below.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import ndimage

from steelyard.check import Array
from steelyard.findings import Finding, percent
from steelyard.shape.scans.grid import Cells
from steelyard.shape.scans.scene import Scene
from steelyard.shape.scans.underside import Underside, median_along, rim_of

# What a rod hangs below where it was last seen, of its rise above that: (1 - sin e) / (1 + sin e) for sight lines at
# the elevation e, 0.4 at 25 degrees, 0.6 at 15.
_ROD = 0.5
_SIDE = 0.5  # a normal that points up by less than this belongs to a side
_BESIDE = 1.5  # cells: what was seen to be empty up to so near a side ends there
# A side is sheer where so much of it, tops left out, within so many cells has a normal so level; of a rod a third has.
_SHEER, _ABOUT, _LEVEL, _TOP, _FEWEST = 0.85, 9, 0.2, 0.85, 8
_OFF_TABLE = 3.0  # times the depth noise
_LEVELS = 12  # at which a column is asked whether views see through it
_MUCH = 0.06  # of the volume: rods and hammers leave 0.04


def hanging(scene: Scene, bottom: Underside, xyz: Array, normal: Array) -> tuple[tuple[Finding, ...], float]:
    """Return what is said of space closed under overhangs, and what it and rods add to the volume's std [m^3].

    xyz, normal  (N, 3) the seen surface, in the table's frame
    """
    under, grid = bottom.under, bottom.grid
    height, free = bottom.height[under], _free_to(bottom, xyz, normal, _OFF_TABLE * scene.sigma)[under]
    tall = np.maximum(bottom.top[under] - height, 0)
    level = height[:, None] + tall[:, None] * (np.arange(_LEVELS) + 0.5) / _LEVELS
    column, k = np.nonzero(level < free[:, None])
    spots = grid.middles(np.argwhere(under)[column])
    empty = scene.seen_empty(np.column_stack([spots, level[column, k]]))
    size = tall[column] * grid.pitch**2 / _LEVELS
    closed, left = float(size[~empty].sum()), float(tall.sum() * grid.pitch**2 - size[empty].sum())
    unsure = float(np.hypot(closed, bottom.filled + _left_open(bottom)))
    return ((_open(closed / left),) if closed > _MUCH * left else ()), unsure


def _left_open(bottom: Underside) -> float:
    """Return the volume [m^3] that was left open under what rises from its rim, if it falls below as it rises above."""
    under = bottom.under
    nearest = tuple(ndimage.distance_transform_edt(~rim_of(under), return_distances=False, return_indices=True))
    height, top = np.where(under, bottom.height, 0.0), np.where(under, bottom.top, 0.0)
    fallen = height[nearest] - np.maximum(top - top[nearest], 0)
    left = np.where(under & ~bottom.seen, height - np.maximum(fallen, bottom.empty), 0.0)
    return float(np.maximum(left, 0).sum()) * bottom.grid.pitch**2


def _free_to(bottom: Underside, xyz: Array, normal: Array, off_table: float) -> Array:
    """Return the height (I, J) up to which each column may be empty, for all that a rod would fill [m].

    off_table  height over the table from which on something does not stand on it, for all that depth tells [m]
    """
    under = bottom.under
    cells, _ = bottom.grid.cells_under(xyz)
    rim = rim_of(under)
    side = normal[:, 2] < _SIDE
    known = rim | (under & _beside(bottom, (cells[0][side], cells[1][side]), xyz[side, 2]))
    if not known.any():
        return np.zeros(under.shape)
    nearest = tuple(ndimage.distance_transform_edt(~known, return_distances=False, return_indices=True))
    # A single cell of the rim that looks higher than those about it errs.
    usual = np.where(rim, median_along(bottom.empty, rim), np.inf)
    last = np.minimum(bottom.empty, usual)[nearest]
    rise = np.where(under, bottom.top, 0.0) - last
    rod = np.where(_sheer(cells, normal[:, 2], under.shape)[nearest], 0.0, _ROD)
    # What dips below where its side was last seen, as the floor of a bowl does, does not go on flat from there.
    doubtful = ~known & (rise > 0) & (last > off_table)
    return np.where(doubtful, last - rod * rise, 0.0)


def _beside(bottom: Underside, cells: Cells, z: Array) -> Any:
    """Return which cells (I, J) were seen to be empty up to a side: its points lie over `cells`, at z (N,)."""
    low, high = np.full(bottom.empty.shape, np.inf), np.full(bottom.empty.shape, -np.inf)
    np.minimum.at(low, cells, z)
    np.maximum.at(high, cells, z)
    reach = _BESIDE * bottom.grid.pitch
    above = bottom.empty > ndimage.minimum_filter(low, 3) - reach
    return above & (bottom.empty < ndimage.maximum_filter(high, 3) + reach)


def _sheer(cells: Cells, up: Array, shape: tuple[int, ...]) -> Any:
    """Return near which cells (I, J) sides are sheer: `up` (N,) is how far normals of the surface point up."""
    cell = np.ravel_multi_index(cells, shape)

    def count(rows: Any) -> Array:
        found = np.bincount(cell[rows], minlength=int(np.prod(shape)))
        return np.asarray(_ABOUT**2 * ndimage.uniform_filter(found.reshape(shape).astype(float), _ABOUT))

    sides = count(up < _TOP)
    return (sides >= _FEWEST) & (count(np.abs(up) < _LEVEL) > _SHEER * sides)


def _open(share: float) -> Finding:
    text = (
        f"{percent(share)} of the volume is space under parts that hang over the table, which no view looked into: it "
        "counts as solid, and may be empty."
    )
    return Finding("surface-open", text, "Lay the object on a side where it hangs less, or take more low views.")
