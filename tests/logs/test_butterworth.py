"""The zero-phase low-pass against SciPy's, which is as good and slow to import."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from steelyard.errors import BadValue
from steelyard.logs.conditioning import lowpass


@pytest.mark.parametrize("order", [2, 4, 6])
@pytest.mark.parametrize(("cutoff", "rows"), [(0.3, 2000), (7.0, 500), (49.0, 200), (2.0, 12), (5.0, 2), (5.0, 1)])
def test_it_filters_as_scipy_does(order: int, cutoff: float, rows: int) -> None:
    walk = 5 + np.random.default_rng(rows).normal(size=(rows, 3)).cumsum(0)
    expected = sosfiltfilt(
        butter(order, cutoff / 50, output="sos"), walk, axis=0, padlen=min(rows - 1, int(300 / cutoff))
    )
    np.testing.assert_allclose(lowpass(walk, cutoff, 100.0, order), expected, rtol=0, atol=1e-10 * abs(walk).max())


def test_a_line_passes_as_it_is() -> None:
    line = np.linspace(0, 1, 300)[:, None] * [1.0, -2.0]
    np.testing.assert_allclose(lowpass(line, 3.0, 100.0), line, atol=1e-3)
    np.testing.assert_allclose(lowpass(np.full((300, 1), 9.81), 3.0, 100.0), 9.81, rtol=1e-12)


def test_what_was_given_stays_as_it_was() -> None:
    steps = np.repeat([[0], [1]], 50, axis=0)
    smooth = lowpass(steps, 5.0, 100.0)
    assert set(steps.ravel().tolist()) == {0, 1}
    np.testing.assert_allclose(smooth, lowpass(steps.astype(float), 5.0, 100.0))
    assert 0.4 < smooth[49:51].mean() < 0.6


@pytest.mark.parametrize("cutoff", [0.0, 50.0, 80.0])
def test_a_cutoff_beyond_half_the_rate_is_refused(cutoff: float) -> None:
    with pytest.raises(BadValue, match=r"half the rate \(50 Hz\)"):
        lowpass(np.zeros((10, 1)), cutoff, 100.0)
