"""Means, medians and quantiles are those of NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from steelyard.logs.middles import mean, median, quantile


@pytest.mark.parametrize("rows", [1, 2, 3, 10, 101, 1000])
def test_the_middle_of_a_column_is_that_of_numpy_to_the_last_digit(rows: int) -> None:
    values = np.random.default_rng(rows).normal(size=(4, rows))
    assert np.array_equal(median(values), np.median(values, axis=1))
    assert median(values[0]) == np.median(values[0])
    for share in (0.1, 0.5, 0.8, 0.9):
        assert np.array_equal(quantile(values, share), np.quantile(values, share, axis=1))


def test_the_mean_of_rows_keeps_their_shape() -> None:
    values = np.random.default_rng(0).normal(size=(500, 3, 3))
    np.testing.assert_allclose(mean(values), values.mean(0), atol=1e-15)
    np.testing.assert_allclose(mean(values[:, 0, 1:]), values[:, 0, 1:].mean(0), atol=1e-15)
