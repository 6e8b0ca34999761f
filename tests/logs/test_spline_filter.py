"""The filter and its pass back against least squares over all states at once."""

from math import factorial

import numpy as np
import pytest

from steelyard.logs.spline_filter import WARM_UP, backward, forward

WIDE = 1e6


def at_once(clock, values, order, density):
    """Mean (N, n, D), covariance (N, n, n) and least cost of all states, by one orthogonal factorisation."""
    rows, size = len(clock), len(clock) * order
    F, Q = np.zeros((order, order)), np.zeros((order, order))
    equations = [np.eye(order, size) / np.sqrt(WIDE), np.eye(size)[::order]]
    for k in range(1, rows):
        dt = clock[k] - clock[k - 1]
        for i in range(order):
            for j in range(order):
                a, b = order - 1 - i, order - 1 - j
                F[i, j] = dt ** (j - i) / factorial(j - i) if j >= i else 0.0
                Q[i, j] = density * dt ** (a + b + 1) / (factorial(a) * factorial(b) * (a + b + 1))
        step = np.zeros((order, size))
        step[:, (k - 1) * order : k * order], step[:, k * order : (k + 1) * order] = -F, np.eye(order)
        equations.append(np.linalg.solve(np.linalg.cholesky(Q), step))
    A = np.concatenate(equations)
    right = np.zeros((len(A), values.shape[1]))
    right[0], right[order : order + rows] = values[0] / np.sqrt(WIDE), values
    q, r = np.linalg.qr(A)
    mean, back = np.linalg.solve(r, q.T @ right), np.linalg.inv(r)
    covariance = (back @ back.T).reshape(rows, order, rows, order)[np.arange(rows), :, np.arange(rows)]
    return mean.reshape(rows, order, -1), covariance, ((right - A @ mean) ** 2).sum()


@pytest.mark.parametrize("order", [3, 4, 5])
def test_states_and_innovations_are_those_of_least_squares(order):
    rng = np.random.default_rng(order)
    clock = np.cumsum(rng.uniform(0.5, 1.5, 30))
    values = np.sin(0.6 * clock)[:, None] + 0.3 * rng.normal(size=(30, 2))
    states, covariances, weights, quad, log_det, count = forward(clock, values, order, np.array([0.7]), True)
    clock = 0.7 * clock
    filtered, cost = states.copy(), np.zeros(30)
    for k in range(WARM_UP - 1, 30):
        mean, covariance, cost[k] = at_once(clock[: k + 1], values[: k + 1], order, 0.7)
        np.testing.assert_allclose(filtered[k], mean[-1], rtol=1e-6, atol=1e-6)
        np.testing.assert_allclose(covariances[k], covariance[-1], rtol=1e-6, atol=1e-6)
    assert count == 30 - WARM_UP
    assert quad[0] == pytest.approx(cost[-1] - cost[WARM_UP - 1], rel=1e-6)
    assert log_det[0] == pytest.approx(-np.log(1 - covariances[WARM_UP:, 0, 0]).sum(), rel=1e-9)
    backward(clock, values, states, covariances, weights)
    np.testing.assert_allclose(states, mean, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(covariances[order:], covariance[order:], rtol=1e-6, atol=1e-6)
    # those of the first rows are what is left of the wide start
    own, expected = (np.einsum("kii->ki", c[:order]) for c in (covariances, covariance))
    np.testing.assert_allclose(own, expected, rtol=2e-3)


def test_filters_side_by_side_are_those_one_by_one():
    rng = np.random.default_rng(0)
    clock, values = np.cumsum(rng.uniform(0.5, 1.5, 50)), rng.normal(size=(50, 3))
    scales = np.geomspace(1e-3, 3.0, 7)
    states, _, _, quad, log_det, count = forward(clock, values, 4, scales, False)
    assert states.shape == (0, 4, 3)
    for k, scale in enumerate(scales):
        kept = forward(clock, values, 4, np.array([scale]), True)
        assert kept[0].shape == (50, 4, 3)
        np.testing.assert_allclose([quad[k], log_det[k], count], [kept[3][0], kept[4][0], kept[5]], rtol=1e-12)


def test_the_likelihood_stays_finite_where_every_step_is_a_gap():
    clock, values = 1e4 * np.arange(40.0), np.zeros((40, 1))
    *_, log_det, _ = forward(clock, values, 5, np.array([1.0, 1e4**0.5]), False)
    assert np.isfinite(log_det).all()
