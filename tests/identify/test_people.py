"""Slopes between the ten parameters and the numbers people read: against the batched form, and inverse."""

from __future__ import annotations

import numpy as np
import pytest

from steelyard.identify.people import half_trace_com, parameter_jacobian, people_jacobian
from steelyard.inertia import InertialParameters, forms


@pytest.mark.parametrize("seed", range(5))
def test_slopes_agree_with_the_batched_form_and_with_each_other(seed: int) -> None:
    rng = np.random.default_rng(seed)
    phi = InertialParameters.from_point_masses(rng.uniform(0.1, 2, 6), rng.normal(size=(6, 3))).vector
    there = people_jacobian(phi)
    np.testing.assert_allclose(there, forms.people_jacobian(phi), rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(there[0], np.eye(10)[0])
    np.testing.assert_allclose(there @ parameter_jacobian(phi), np.eye(10), atol=1e-11)
    assert half_trace_com(phi) == pytest.approx(np.trace(forms.inertia_com(phi)) / 2, rel=1e-11)
