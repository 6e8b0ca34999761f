"""The noise-aware cost: equal to a plain sum over rows, its derivatives and information to brute force."""

from __future__ import annotations

import numpy as np
import pytest
from bench_logs import BIAS, bench_log, truth
from hypothesis import given, settings

from steelyard.identify.cost import newton, noise_cost
from steelyard.identify.problem import Problem
from steelyard.inertia import InertialParameters, forms
from steelyard.inertia.regressor import basis, design, motion_map
from steelyard.logs.log import MotionLog, Noise
from steelyard.logs.moments import Moments, features
from strategies import log_choleskys

NOISES = (Noise.of_std(0.4, 0.05, 0.3, 0.01), Noise.of_std(0.02, 0.01, 0.2, 0.004))
GAMMA, LOG_SIZE, PRECISION = 0.5, float(np.log(0.03)), 1.0
KNOWN_BIAS, KNOWN_PRECISION = BIAS + 0.1, np.diag([1e4, 2e4, 3e4, 10.0, 20.0, 30.0]) + 1.0
PRIORS = newton.Priors(GAMMA, LOG_SIZE, PRECISION, KNOWN_BIAS, KNOWN_PRECISION)


def two_class_log() -> MotionLog:
    log = bench_log("hammer", "dyn_fast", "moderate", 1)
    rng = np.random.default_rng(0)
    fields = (log.wrench, log.gravity, log.acceleration, log.angular_velocity, log.angular_acceleration)
    return MotionLog(*fields, noise_class=rng.integers(0, 2, len(log)), noise=NOISES).rows(slice(0, 200))


LOG = two_class_log()
PROBLEM = Problem.of(Moments.of_log(LOG), with_bias=True)
ROWS = newton.Rows(PROBLEM.T, PROBLEM.scatter, PROBLEM.acceleration, PROBLEM.wrench)
POINT = np.concatenate([1.1 * truth("hammer").vector, BIAS + 0.2])
bodies = log_choleskys()


def row_covariance(phi: np.ndarray, noise: Noise) -> np.ndarray:
    M = np.block(
        [
            [forms.inertia_matrix(phi), cross(phi[1:4])],
            [-cross(phi[1:4]), phi[0] * np.eye(3)],
        ]
    )
    return np.diag(noise.wrench) + M @ np.diag(noise.acceleration) @ M.T


def cross(v: np.ndarray) -> np.ndarray:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def plain_cost(linear: np.ndarray) -> float:
    """sum_t r^T (Sigma_w + M Sigma_a M^T)^-1 r, one row after the other."""
    residual = LOG.wrench - LOG.predicted(linear[:10]) - linear[10:]
    weights = [np.linalg.inv(row_covariance(linear[:10], noise)) for noise in NOISES]
    return sum(float(r @ weights[c] @ r) for r, c in zip(residual, LOG.noise_class, strict=True))


def central(function, x: np.ndarray, steps: np.ndarray) -> np.ndarray:  # type: ignore[no-untyped-def]
    """Central differences along each coordinate, last axis the coordinate."""
    return np.stack(
        [(function(x + h * e) - function(x - h * e)) / (2 * h) for h, e in zip(steps, np.eye(len(x)), strict=True)],
        axis=-1,
    )


def close(found: np.ndarray, expected: np.ndarray, share: float) -> None:
    """Entries agree to `share` of the geometric mean of their row's and column's diagonal (or of the largest)."""
    size = np.sqrt(np.abs(np.outer(np.diag(expected), np.diag(expected)))) if expected.ndim == 2 else np.abs(expected)
    assert (np.abs(found - expected) <= share * np.maximum(size, 1e-9 * np.abs(expected).max())).all()


def test_the_regressor_is_newton_euler() -> None:
    z = features(LOG)
    phi = truth("hammer").vector
    np.testing.assert_allclose((z[:, :12] @ motion_map(phi).T), LOG.predicted(phi), atol=1e-12)
    K = PROBLEM.residual_map(np.concatenate([phi, BIAS]))
    np.testing.assert_allclose(z @ K.T, LOG.wrench - LOG.predicted(phi) - BIAS, atol=1e-12)
    np.testing.assert_allclose(np.tensordot(phi, basis(), 1), motion_map(phi), atol=1e-15)
    assert design(False).shape == (10, 6, 19)
    assert not basis().flags.writeable


@given(theta=bodies)
@settings(max_examples=10)
def test_cost_is_the_sum_over_rows(theta: np.ndarray) -> None:
    linear = np.concatenate([forms.from_log_cholesky(theta), BIAS])
    found, _ = noise_cost.value(PROBLEM.residual_map(linear), *ROWS[1:])
    assert found == pytest.approx(plain_cost(linear), rel=1e-9)


def test_weight_is_the_inverse_covariance_of_a_row() -> None:
    for noise in NOISES:
        W = noise_cost.weight(PROBLEM.residual_map(POINT), noise.acceleration, noise.wrench)
        np.testing.assert_allclose(W @ row_covariance(POINT[:10], noise), np.eye(6), atol=1e-9)


def steps_of(point: np.ndarray, share: float) -> np.ndarray:
    size = np.concatenate([[1.0], np.full(3, 0.1), np.full(6, 0.01), np.full(3, 0.1), np.full(3, 1.0)])
    return share * size[: len(point)]


def test_first_derivatives() -> None:
    value, gradient, _ = noise_cost.derivatives(PROBLEM.residual_map(POINT), *ROWS)
    assert value == pytest.approx(plain_cost(POINT), rel=1e-9)
    numeric = central(plain_cost, POINT, steps_of(POINT, 1e-4))
    np.testing.assert_allclose(gradient, numeric, rtol=1e-4, atol=1e-5 * np.abs(numeric).max())


def test_second_derivatives() -> None:
    def gradient(linear: np.ndarray) -> np.ndarray:
        return noise_cost.derivatives(PROBLEM.residual_map(linear), *ROWS)[1]

    hessian = noise_cost.derivatives(PROBLEM.residual_map(POINT), *ROWS)[2]
    np.testing.assert_array_equal(hessian, hessian.T)
    close(hessian, central(gradient, POINT, steps_of(POINT, 1e-5)), 1e-6)


@given(theta=bodies)
@settings(max_examples=10)
def test_log_cholesky_of_the_newton_iteration_is_that_of_bodies(theta: np.ndarray) -> None:
    np.testing.assert_allclose(newton.linear_of(theta), forms.from_log_cholesky(theta), rtol=1e-10, atol=1e-12)
    J = newton.jacobian(theta, newton.factor(theta))
    np.testing.assert_allclose(J, forms.log_cholesky_jacobian(theta), rtol=1e-9, atol=1e-12)


@given(theta=bodies)
@settings(max_examples=10)
def test_shape_prior_derivatives(theta: np.ndarray) -> None:
    def prior(t: np.ndarray) -> np.ndarray:
        return np.array(newton.shape_prior(t, GAMMA, LOG_SIZE, PRECISION)[0])

    def slope(t: np.ndarray) -> np.ndarray:
        return newton.shape_prior(t, GAMMA, LOG_SIZE, PRECISION)[1]

    _, gradient, hessian = newton.shape_prior(theta, GAMMA, LOG_SIZE, PRECISION)
    steps = np.full(10, 1e-5) * np.where(np.arange(10) < 4, 1, 0.05)
    np.testing.assert_allclose(gradient, central(prior, theta, steps), rtol=1e-5, atol=1e-4)
    numeric = central(slope, theta, steps)
    np.testing.assert_allclose(hessian, numeric, rtol=1e-4, atol=1e-5 * np.abs(numeric).max())
    # Neither mass nor centre of mass are pulled.
    assert not gradient[[0, 7, 8, 9]].any()


def test_a_ball_of_the_given_size_is_at_the_bottom_of_the_prior() -> None:
    ball = np.array([0.3, LOG_SIZE, LOG_SIZE, LOG_SIZE, 0, 0, 0, 0.1, 0.2, 0.3])
    value, gradient, hessian = newton.shape_prior(ball, GAMMA, LOG_SIZE, PRECISION)
    assert value == pytest.approx(0, abs=1e-12)
    assert float(np.abs(gradient).max()) < 1e-12
    assert float(np.linalg.eigvalsh(hessian[1:7, 1:7])[0]) > 0


def test_derivatives_in_log_cholesky_coordinates() -> None:
    u = np.concatenate([truth("hammer").log_cholesky() + 0.05, BIAS + 0.1])

    def gradient(x: np.ndarray) -> np.ndarray:
        return newton.cost_derivatives(x, ROWS, PRIORS)[1]

    def value(x: np.ndarray) -> np.ndarray:
        return np.array(newton.cost_derivatives(x, ROWS, PRIORS)[0])

    total, first, second = newton.cost_derivatives(u, ROWS, PRIORS)
    off = u[10:] - KNOWN_BIAS
    shape = newton.shape_prior(u[:10], GAMMA, LOG_SIZE, PRECISION)[0]
    linear = np.concatenate([forms.from_log_cholesky(u[:10]), u[10:]])
    assert total == pytest.approx(0.5 * plain_cost(linear) + shape + 0.5 * off @ KNOWN_PRECISION @ off, rel=1e-9)
    assert total == pytest.approx(float(value(u)), rel=1e-12)
    steps = np.concatenate([np.full(4, 1e-5), np.full(6, 1e-6), np.full(6, 1e-4)])
    numeric = central(value, u, steps)
    np.testing.assert_allclose(first, numeric, rtol=1e-4, atol=1e-5 * np.abs(numeric).max())
    close(second, central(gradient, u, steps), 1e-5)


def test_newton_ends_where_the_gradient_vanishes() -> None:
    start = np.concatenate([truth("hammer").log_cholesky() + 0.2, BIAS + 1])
    u, value, converged = newton.minimise(start, ROWS, PRIORS, 60)
    assert converged
    _, gradient, hessian = newton.cost_derivatives(u, ROWS, PRIORS)
    assert float(np.linalg.eigvalsh(hessian)[0]) > 0
    assert float(gradient @ np.linalg.solve(hessian, gradient)) < 1e-8
    assert value <= newton.cost_derivatives(start, ROWS, PRIORS)[0]


@pytest.mark.parametrize("nudge", [0.0, 0.3, -0.4])
def test_newton_finds_the_same_minimum_from_elsewhere(nudge: float) -> None:
    start = np.concatenate([truth("hammer").log_cholesky() + nudge * np.array([1, 1, -1, 1, 0, 0, 0, 0.1, 0, 0]), BIAS])
    u, _, converged = newton.minimise(start, ROWS, PRIORS, 60)
    reference = newton.minimise(np.concatenate([truth("hammer").log_cholesky(), BIAS]), ROWS, PRIORS, 60)[0]
    assert converged
    np.testing.assert_allclose(newton.linear_of(u), newton.linear_of(reference), rtol=1e-6, atol=1e-8)


def noisy_draws(draws: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Scatter of one exact log, information (H, D) at the truth, scores (draws, p) and mean noisy scatter."""
    body, noise = truth("hammer").vector, NOISES[0]
    exact = bench_log("hammer", "dyn_slow").rows(slice(0, 1000, 20))
    linear = np.concatenate([body, BIAS])
    T = design(True)
    K = noise_cost.residual_map_of(T, linear)
    rng = np.random.default_rng(7)
    z = features(exact)
    scores, information = np.zeros((draws, 16)), np.zeros((2, draws, 16, 16))
    std = np.sqrt(np.concatenate([noise.acceleration, noise.wrench]))
    for k in range(draws):
        seen = z.copy()
        seen[:, [*range(6), *range(12, 18)]] += rng.normal(size=(len(z), 12)) * std
        S = (seen.T @ seen)[None]
        data = (S, noise.acceleration[None], noise.wrench[None])
        scores[k] = 0.5 * noise_cost.derivatives(K, T, *data)[1]
        information[0, k], information[1, k], _ = noise_cost.information(K, T, *data)
    clean = (z.T @ z)[None]
    W = row_weight(linear, noise)
    plain = sum(np.einsum("pi,ij,qj->pq", slope, W, slope) for slope in np.einsum("pij,nj->npi", T, z))
    assert clean.shape == (1, 19, 19)
    return scores, information[0].mean(0), information[1].mean(0), plain


def row_weight(linear: np.ndarray, noise: Noise) -> np.ndarray:
    return np.linalg.inv(row_covariance(linear[:10], noise))


def test_information_and_extra_variance_against_monte_carlo() -> None:
    """E H is the information about the true motion; the variance of the score is H + D; its mean is zero."""
    draws = 2500
    scores, H, D, clean = noisy_draws(draws)
    close(H, clean, 0.05)
    spread = np.cov(scores.T)
    size = np.sqrt(np.diag(H + D))
    # The standard error of a variance from n draws is sqrt(2/n) of it.
    assert (np.abs(spread - (H + D)) < 5 * np.sqrt(2 / draws) * np.outer(size, size)).all()
    assert (np.abs(scores.mean(0)) < 5 * size / np.sqrt(draws)).all()
    # D matters here: without it the variance would be far off.
    assert float((np.diag(D) / np.diag(H)).max()) > 0.5


def test_plain_information_is_that_of_the_rows_as_measured() -> None:
    _, _, plain = noise_cost.information(PROBLEM.residual_map(POINT), *ROWS)
    total = np.zeros((16, 16))
    for row, c in zip(features(LOG), LOG.noise_class, strict=True):
        slope = design(True) @ row
        total += slope @ row_weight(POINT, NOISES[c]) @ slope.T
    close(plain, total, 1e-9)


def test_truth_is_a_stationary_point_without_noise() -> None:
    body = truth("mallet")
    log = bench_log("mallet", "dyn_slow")
    log = MotionLog(
        log.wrench, log.gravity, log.acceleration, log.angular_velocity, log.angular_acceleration, noise=NOISES[:1]
    )
    problem = Problem.of(Moments.of_log(log), True)
    linear = np.concatenate([body.vector, BIAS])
    value, gradient, _ = noise_cost.derivatives(
        problem.residual_map(linear), problem.T, problem.scatter, problem.acceleration, problem.wrench
    )
    assert abs(value) < 1e-6
    assert float(np.abs(gradient).max()) < 1e-4
    assert InertialParameters(linear[:10]).validity().consistent
