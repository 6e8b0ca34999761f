"""The table under low, flat objects, whatever the noise, and where there is next to nothing to see."""

from __future__ import annotations

import numpy as np
import pytest

from steelyard.errors import CannotAnswer
from steelyard.shape.scans.table_plane import find_table
from steelyard.shape.views import TablePlane

CAMERAS = np.array([[0.4, 0.0, 0.5], [-0.2, 0.35, 0.5], [-0.2, -0.35, 0.5]])


@pytest.mark.parametrize("noise", [0.0, 1e-5, 1e-4, 1e-3])
@pytest.mark.parametrize("share", [0.1, 0.22, 0.35])
def test_a_flat_object_leaves_the_table_where_it_is(noise: float, share: float) -> None:
    rng = np.random.default_rng(0)
    xy = rng.uniform(-0.3, 0.3, (6000, 2))
    half = 0.3 * np.sqrt(share)
    height = np.where((np.abs(xy) < half).all(1), 0.004, 0.0) + noise * rng.standard_normal(6000)
    found = find_table(np.column_stack([xy, height]), CAMERAS, 0.6)
    assert found.normal == pytest.approx([0, 0, 1], abs=2e-3)
    assert abs(found.offset) < 1e-3 if share < 0.3 else abs(found.offset) < 2.5e-3


def test_next_to_nothing_measured() -> None:
    with pytest.raises(CannotAnswer, match="next to no measurements"):
        find_table(np.zeros((2, 3)), CAMERAS, 0.6)


@pytest.mark.parametrize(("share", "found"), [(0.12, True), (0.04, False)])
def test_a_stand_that_is_given_as_the_table_may_be_small(share: float, found: bool) -> None:
    """It stands on a table of which the views show far more."""
    rng = np.random.default_rng(0)
    points = rng.uniform(-0.3, 0.3, (5000, 3)) * [1, 1, 0] - [0, 0, 0.1]
    points[: int(share * 5000)] *= [0.3, 0.3, 0]
    given = TablePlane(np.array([0.0, 0.0, 1.0]), 0.0)
    if found:
        assert abs(find_table(points, CAMERAS, 0.6, given).offset) < 1e-6
        assert find_table(points, CAMERAS, 0.6).offset == pytest.approx(-0.1)
    else:
        with pytest.raises(CannotAnswer, match="expected 8 % or more"):
            find_table(points, CAMERAS, 0.6, given)
