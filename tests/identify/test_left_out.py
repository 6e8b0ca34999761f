"""Blocks left out in turn, against plain least squares on what is left."""

from __future__ import annotations

import numpy as np
import pytest

from steelyard.identify.cost.left_out import block_scatter, jackknife, solutions

RANK = 1e-9


@pytest.mark.parametrize("block", [np.arange(60), np.repeat([7, 3, 5], [10, 49, 1]), np.arange(60) % 4])
def test_solutions_are_those_without_each_block(block: np.ndarray) -> None:
    rng = np.random.default_rng(0)
    rows = rng.normal(size=(60, 3, 5)) * [1, 1e3, 1e-3, 1, 1]
    scatter = block_scatter(rows, block)
    found = solutions(scatter.sum(0) - scatter, RANK, 0.0)
    for number, x in zip(np.unique(block), found, strict=True):
        left = rows[block != number].reshape(-1, 5)
        np.testing.assert_allclose(x, np.linalg.lstsq(left[:, :4], left[:, 4])[0], rtol=1e-9)


def test_columns_of_nothing_take_nothing() -> None:
    rows = np.zeros((4, 3, 3))
    rows[..., 2] = 1.0
    assert not solutions(block_scatter(rows, np.arange(4)), RANK, 1e-12).any()


def test_jackknife_of_a_mean_is_its_textbook_variance() -> None:
    values = np.random.default_rng(0).normal(size=(30, 2))
    without = (values.sum(0) - values) / 29
    np.testing.assert_allclose(jackknife(without - values.mean(0)), np.cov(values.T) / 30, rtol=1e-12)
