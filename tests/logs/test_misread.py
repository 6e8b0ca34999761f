"""Rotation vectors that were read as roll, pitch, yaw are had back row by row."""

from __future__ import annotations

import numpy as np
import pytest

from steelyard.logs.misread import MISREAD
from steelyard.spatial import Rotation

(VECTOR,) = (m for m in MISREAD if "are a rotation vector, not roll" in m.words)


def swaying(seed: int, rows: int) -> Rotation:
    """Return a smooth motion about a hand that points down, as robots of UR write it with vectors near half a turn."""
    rng = np.random.default_rng(seed)
    time = np.linspace(0, 1, rows)[:, None, None]
    waves = np.sin(2 * np.pi * rng.uniform(0.5, 4, (3, 3)) * time + rng.uniform(0, 6, (3, 3)))
    down = Rotation.exp(np.pi * np.array([np.cos(0.4 * seed), np.sin(0.4 * seed), 0.0]))
    return Rotation.exp(0.4 * waves.sum(2)) @ down


@pytest.mark.parametrize("seed", range(8))
def test_vectors_that_go_round_at_half_a_turn_come_back_in_all_rows(seed: int) -> None:
    meant = swaying(seed, 2000)
    back = VECTOR.right(Rotation.from_rpy(meant.log()).matrix)
    assert back is not None
    np.testing.assert_allclose(back, meant.matrix, atol=1e-5)


def test_a_table_without_rows_or_with_one_is_read_too() -> None:
    for rows in (0, 1):
        meant = swaying(0, 5)[:rows]
        back = VECTOR.right(Rotation.from_rpy(meant.log()).matrix)
        assert back is not None
        assert back.shape == (rows, 3, 3)


(ANGLES,) = (m for m in MISREAD if "are roll, pitch, yaw, not a rotation vector" in m.words)


@pytest.mark.parametrize("seed", range(8))
def test_angles_that_were_read_as_a_vector_come_back_in_all_rows(seed: int) -> None:
    meant = swaying(seed, 2000)
    angles = meant.rpy()
    back = ANGLES.right(Rotation.exp(angles).matrix)
    assert back is not None
    off = np.abs(back - meant.matrix).max((1, 2)) > 1e-5
    assert np.linalg.norm(angles, axis=1).max() > np.pi  # longer than a rotation vector is
    assert off.mean() < 0.02
