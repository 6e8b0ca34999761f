"""Slopes between the ten parameters and the numbers people read: against differences, and inverse."""

from __future__ import annotations

import numpy as np
import pytest

from steelyard.inertia import InertialParameters, forms
from steelyard.inertia.people import half_trace_com, parameter_jacobian, people_jacobian


@pytest.mark.parametrize("seed", range(5))
def test_slopes_agree_with_differences_and_with_each_other(seed: int) -> None:
    rng = np.random.default_rng(seed)
    phi = InertialParameters.from_point_masses(rng.uniform(0.1, 2, 6), rng.normal(size=(6, 3))).vector
    there = people_jacobian(phi)
    steps = 1e-6 * np.eye(10)
    differences = (forms.people(phi + steps) - forms.people(phi - steps)) / 2e-6
    np.testing.assert_allclose(there, differences.T, rtol=1e-6, atol=1e-7)
    np.testing.assert_array_equal(there[0], np.eye(10)[0])
    np.testing.assert_allclose(there @ parameter_jacobian(phi), np.eye(10), atol=1e-11)
    assert half_trace_com(phi) == pytest.approx(np.trace(forms.inertia_com(phi)) / 2, rel=1e-11)
