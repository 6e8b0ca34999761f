"""The error bars of least squares are those of its own weights, white noise and correlated."""

from __future__ import annotations

import numpy as np
import pytest

from steelyard.identify.least_squares import LeastSquares
from steelyard.inertia import InertialParameters, forms
from steelyard.simulate.logs import simulate_log


def people(body: InertialParameters) -> np.ndarray:
    return np.concatenate([[body.mass], body.com, forms.upper(body.inertia_com)])


@pytest.mark.parametrize("spectrum", ["white", "2hz"])
@pytest.mark.parametrize("kind", ["ordinary", "weighted", "total"])
def test_std_is_the_scatter_over_seeds(kind: str, spectrum: str) -> None:
    found, stds = [], []
    for seed in range(40):
        log, _ = simulate_log("hammer", "stop_go", "moderate", seed, shuffled=False, spectrum=spectrum)
        estimate = LeastSquares(kind, bias="none").identify(log)
        found.append(people(estimate.parameters))
        stds.append(estimate.std)
    ratio = np.mean(stds, 0) / np.std(found, 0)
    # Forty seeds know their own scatter to 11 %: three of those, and a little for the estimated correlation.
    assert (ratio > 0.62).all(), ratio
    assert (ratio < 1.5).all(), ratio
