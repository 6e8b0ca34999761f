"""What seems to rest on nothing is as round below as above, and nothing else is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from steelyard.check import Array
from steelyard.shape.scans.grid import Grid
from steelyard.shape.scans.round_below import round_below
from steelyard.shape.scans.underside import Underside

RADIUS, SIGMA = 0.006, 0.00075
GRID = Grid(np.array([-0.04, -0.01]), 0.001, (80, 20))
ALONG, ACROSS = GRID.middles(np.argwhere(np.ones(GRID.shape, bool))).T
BULGE = np.sqrt(np.maximum(RADIUS**2 - ACROSS**2, 0)).reshape(GRID.shape)
UNDER = (np.abs(ACROSS) < RADIUS - 0.0004).reshape(GRID.shape)


def rod(left: float, empty: float = 0.0, top: float | None = None) -> tuple[Underside, Array]:
    """Return a rod whose underside goes on flat from `left` over the table, and the points of its upper side [m].

    empty  height up to which views saw that nothing is there
    top    of it, where that is flat
    """
    high = RADIUS + (BULGE if top is None else np.full(GRID.shape, top - RADIUS))
    points = np.column_stack([ALONG, ACROSS, high.ravel()])[UNDER.ravel()]
    height = np.where(UNDER, left, np.inf)
    none = np.zeros(GRID.shape, bool)
    return Underside(GRID, height, none, np.where(UNDER, high, -np.inf), np.where(UNDER, empty, 0.0)), points


def test_a_rod_that_was_left_flat_is_round_below() -> None:
    at_rim = RADIUS - BULGE[UNDER].min()
    bottom, points = rod(at_rim)
    filled = round_below(bottom, points, SIGMA)
    round_ = np.where(UNDER, RADIUS - BULGE, np.inf)
    assert np.abs(filled.height[UNDER] - round_[UNDER]).mean() < 0.1 * RADIUS
    assert filled.filled == pytest.approx((at_rim - filled.height[UNDER]).sum() * GRID.pitch**2)


def test_space_that_was_seen_to_be_empty_stays_so() -> None:
    bottom, points = rod(RADIUS - BULGE[UNDER].min(), empty=0.002)
    assert round_below(bottom, points, SIGMA).height[UNDER].min() >= 0.002 - 1e-12


@pytest.mark.parametrize(
    ("bottom", "sigma"),
    [(rod(0.003, top=0.012), SIGMA), (rod(0.0), SIGMA), (rod(0.003), 0.0004)],
    ids=["flat above", "rests", "seen from below"],
)
def test_what_does_not_hide_how_it_goes_on_below_is_left(bottom: tuple[Underside, Array], sigma: float) -> None:
    assert round_below(*bottom, sigma).filled == pytest.approx(0.0, abs=1e-12)


def test_a_part_that_comes_down_to_the_table_bears_the_rest() -> None:
    bottom, points = rod(RADIUS - BULGE[UNDER].min())
    on_a_foot = replace(bottom, height=np.where(UNDER & (ALONG < -0.02).reshape(GRID.shape), 0.0, bottom.height))
    assert round_below(on_a_foot, points, SIGMA) is on_a_foot
