"""Modes of log densities: found to the last digit where masses trade against each other, too."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from steelyard.identify.masses.density_priors import CENTRE, LADDER, WIDTH, apart, mode


def valley(seed: int, P: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return A, b and volumes of parts of unlike densities: the sum of masses is seen far better than each of them."""
    rng = np.random.default_rng(seed)
    volume = rng.uniform(2e-5, 2e-4, P)
    masses = volume * np.exp(rng.normal(CENTRE, WIDTH, P))
    root = rng.normal(size=(P, P)) * np.geomspace(1, 300, P)[:, None]
    root[-1] = 1e4
    A = root.T @ root
    return A, root.T @ (root @ masses + rng.normal(size=P)), volume


def cost(y: np.ndarray, A: np.ndarray, b: np.ndarray, volume: np.ndarray, precision: np.ndarray) -> tuple:
    """Return the cost of log densities y (P,) and its slope (P,)."""
    m, off = volume * np.exp(y), y - CENTRE
    return 0.5 * m @ A @ m - b @ m + 0.5 * off @ precision @ off, m * (A @ m - b) + precision @ off


@pytest.mark.parametrize("P", [2, 3, 6, 12])
def test_no_other_search_finds_less(P: int) -> None:
    for seed in range(20):
        A, b, volume = valley(seed, P)
        start = np.full(P, np.log(np.linalg.solve(A, b).sum() / volume.sum()))
        for near in LADDER**2:
            precision = apart(P, float(near), WIDTH**2)
            y, found, hessian = mode(A, b, volume, np.arange(P), precision, np.full(P, CENTRE), start)
            value, slope = cost(y, A, b, volume, precision)
            assert found == pytest.approx(value, rel=1e-6)
            # Newton's decrement: twice what a quadratic step could still win.
            assert slope @ np.linalg.solve(hessian, slope) < 1e-6
            other = minimize(cost, y, (A, b, volume, precision), "BFGS", True, options={"gtol": 1e-9, "maxiter": 200})
            assert found < other.fun + 1e-6 * max(abs(other.fun), 1.0)
