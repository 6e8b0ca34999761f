"""The body nearest to an answer is found, and what is known well stays where it is."""

from __future__ import annotations

import numpy as np

from steelyard.inertia import InertialParameters
from steelyard.team.assembled import consistent

SIZE = 0.8


def test_an_open_inertia_moves_neither_mass_nor_centre_and_hangs_on_no_rounding() -> None:
    mass, first = 12.0, np.array([1.1, 1.2, 1.3])
    phi = np.concatenate([[mass], first, np.zeros(6)])
    scale = np.concatenate([[mass], np.full(3, mass * SIZE), np.full(6, mass * SIZE**2)])
    spread = np.diag(np.concatenate([[1e-3], np.full(3, 1e-3), np.ones(6)]) * scale) ** 2
    found = consistent(phi, spread, scale)
    assert InertialParameters(found).validity().consistent
    assert np.abs((found - phi)[:4] / np.sqrt(np.diag(spread))[:4]).max() < 0.1
    rng = np.random.default_rng(0)
    nudged = consistent(phi * (1 + 1e-14 * rng.normal(size=10)), spread * (1 + 1e-14), scale)
    assert np.allclose(nudged, found, rtol=1e-9, atol=1e-9)
    # The nearest is a point mass, which is no body yet: found is as near as others that come close to it.
    metric = np.linalg.inv(spread)
    cost = float((found - phi) @ metric @ (found - phi))
    for _ in range(200):
        other = InertialParameters.from_com(mass, first / mass, np.diag(10 ** rng.uniform(-4, 0, 3))).vector
        assert cost < 1.05 * (other - phi) @ metric @ (other - phi)


def test_a_mass_below_zero_becomes_a_body() -> None:
    phi = np.concatenate([[-0.01], np.zeros(3), [1.0, 0, 0, 1.0, 0, 1.0]])
    found = consistent(phi, np.eye(10), np.ones(10))
    assert InertialParameters(found).validity().consistent
