"""Error bars of part masses: parts held at zero, and models that the evidence does not decide between."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import nnls
from scipy.stats import halfnorm

from steelyard.identify.masses.density_priors import averaged
from steelyard.identify.masses.nonnegative import nonnegative_masses, spread_about


def data(seed: int, P: int, rank: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return A, b and their root: true masses between 0 and 1, some of them zero, seen through `rank` rows."""
    rng = np.random.default_rng(seed)
    root = 30 * rng.normal(size=(rank, P))
    truth = np.maximum(rng.normal(0.3, 0.4, P), 0)
    seen = root @ truth + rng.normal(size=rank)
    return root.T @ root, root.T @ seen, root, seen


@pytest.mark.parametrize(("P", "rank"), [(1, 3), (3, 10), (6, 10), (14, 10)])
def test_likeliest_masses_are_those_of_lawson_and_hanson(P: int, rank: int) -> None:
    for seed in range(20):
        A, b, root, seen = data(seed, P, rank)
        found = nonnegative_masses(A, b)
        assert (found >= 0).all()
        other = nnls(root, seen)[0]
        cost, best = (float(0.5 * m @ A @ m - b @ m) for m in (found, other))
        assert cost < best + 1e-6 * max(abs(best), 1.0)
        if rank >= P:
            np.testing.assert_allclose(found, other, atol=1e-6)


def test_far_from_zero_the_spread_is_the_plain_one() -> None:
    A = np.array([[400.0, 100.0], [100.0, 900.0]])
    masses = np.array([3.0, 2.0])
    np.testing.assert_allclose(spread_about(A, A @ masses, masses), np.linalg.inv(A), rtol=2e-4)


@pytest.mark.parametrize("slope", [0.0, -1.0, -4.0, -30.0])
def test_a_part_at_zero_has_the_moments_of_a_cut_gaussian(slope: float) -> None:
    """One part with the unconstrained estimate `slope` deviations from zero, by quadrature."""
    std = 0.01
    A, b = np.diag([std**-2, 1e4]), np.array([slope / std, 1e4])
    grid = np.linspace(0, 8 * std, 200_001)
    weight = np.exp(-0.5 * (grid / std - slope) ** 2 + 0.5 * slope**2)
    expected = float(np.sqrt((weight * grid**2).sum() / weight.sum()))
    assert np.sqrt(spread_about(A, b, np.array([0.0, 1.0]))[0, 0]) == pytest.approx(expected, rel=3e-3)
    if slope == 0.0:
        assert expected == pytest.approx(np.sqrt(halfnorm.var() + halfnorm.mean() ** 2) * std, rel=1e-3)


def test_the_spread_is_that_of_sampling_where_parts_trade_mass() -> None:
    """Three parts, two of them all but alike to the data: rejection sampling of the Gaussian, cut off at zero."""
    A = np.array([[900.0, 850.0, 0.0], [850.0, 900.0, 50.0], [0.0, 50.0, 400.0]])
    b = A @ np.array([-0.02, 0.12, 0.3])
    masses = nonnegative_masses(A, b)
    assert masses[0] == 0.0
    rng = np.random.default_rng(0)
    draws = rng.multivariate_normal(np.linalg.solve(A, b), np.linalg.inv(A), 400_000)
    off = draws[(draws >= 0).all(1)] - masses
    expected = np.sqrt((off**2).mean(0))
    np.testing.assert_allclose(np.sqrt(np.diag(spread_about(A, b, masses))), expected, rtol=0.1)


def test_intervals_of_free_masses_hold_masses_near_zero() -> None:
    inside = []
    for seed in range(150):
        rng = np.random.default_rng(seed)
        root = 30 * rng.normal(size=(8, 5))
        truth = np.abs(rng.normal(0, [0.5, 0.02, 0.02, 0.02, 0.5]))
        A, b = root.T @ root, root.T @ (root @ truth + rng.normal(size=8))
        found = nonnegative_masses(A, b)
        inside.append(np.abs(found - truth) <= 1.96 * np.sqrt(np.diag(spread_about(A, b, found))))
    assert 0.92 < np.mean(inside) < 0.985


def test_error_bars_count_a_difference_of_evidence_half_and_the_mean_counts_it_whole() -> None:
    masses, evidence = np.array([[1.0], [2.0]]), np.array([0.0, -4.0])
    mean, covariance = averaged(masses, evidence, np.full((2, 1, 1), 0.01))
    whole, half = 1 / (1 + np.exp(4)), 1 / (1 + np.exp(2))
    assert mean[0] == pytest.approx(1 + whole)
    assert covariance[0, 0] == pytest.approx(0.01 + (1 - half) * whole**2 + half * (1 - whole) ** 2)


def test_decided_models_keep_their_own_error_bars() -> None:
    masses, evidence = np.array([[1.0], [2.0]]), np.array([0.0, -200.0])
    mean, covariance = averaged(masses, evidence, np.full((2, 1, 1), 0.01))
    np.testing.assert_allclose([mean[0], covariance[0, 0]], [1.0, 0.01])
