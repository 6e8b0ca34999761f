"""Correlation time of residuals: one row of white noise, the closed form of an autoregressive series."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from steelyard.logs.autocorrelation import correlation_time, lagged_products


def remembering(share: float, rows: int = 40_000) -> np.ndarray:
    """Rows (N, 2, 2) of which each keeps a share of the one before, one column silent, one a thousand times larger."""
    series = lfilter([1.0], [1.0, -share], np.random.default_rng(0).normal(size=(rows, 2, 2)), axis=0)
    return series * [[1.0, 1e3], [0.0, 1.0]]


@pytest.mark.parametrize("share", [0.0, 0.5, 0.9])
def test_the_correlation_time_is_that_of_an_autoregression(share: float) -> None:
    series = remembering(share)
    # The sum ends where 0.05 is left.
    assert correlation_time(series, len(series) / 4) == pytest.approx((1 + share) / (1 - share), rel=0.12)
    assert correlation_time(series, len(series) / 4, power=2) == pytest.approx(
        (1 + share**2) / (1 - share**2), rel=0.05
    )


def test_lagged_products_are_plain_sums() -> None:
    x = np.random.default_rng(1).normal(size=(37, 3))
    expected = [(x[lag:] * x[: len(x) - lag]).sum() for lag in range(20)]
    np.testing.assert_allclose(lagged_products(x, 20), expected, atol=1e-12)


def test_silence_is_worth_its_rows() -> None:
    assert correlation_time(np.zeros((10, 3)), 5) == 1
    assert correlation_time(np.zeros((10, 0)), 5) == 1
