"""Words of the two readings of quaternions whose scalar stands at the other end."""

from __future__ import annotations

import numpy as np
import pytest

from steelyard.logs.misread import MISREAD
from steelyard.spatial import Rotation

SAID = "in the order {}, not {} as was said or assumed"


@pytest.mark.parametrize(
    ("places", "written", "read"), [(-1, "x, y, z, w", "w, x, y, z"), (1, "w, x, y, z", "x, y, z, w")]
)
def test_the_order_that_undoes_it_is_that_of_the_numbers_written(places: int, written: str, read: str) -> None:
    """Numbers written in one order and read in the other: the words of what puts them right name the written one."""
    meant = np.random.default_rng(0).normal(size=(5, 4))
    turns = Rotation.from_quaternion_wxyz(meant).matrix
    misread = Rotation.from_quaternion_wxyz(np.roll(meant, places, -1)).matrix
    orders = [m for m in MISREAD if m.code == "quaternion-order"]
    right = [m for m in orders if np.allclose(m.right(misread), turns)]
    assert len(orders) == 2
    assert [m.words.partition(" are ")[2] for m in right] == [SAID.format(written, read)]
