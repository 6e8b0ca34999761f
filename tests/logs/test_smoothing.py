"""The smoother: right on average, right about its own error, and blind to the choice of frames."""

import numpy as np
import pytest

from steelyard.errors import BadValue
from steelyard.logs.smooth_turns import smooth_rotations, turning
from steelyard.logs.smoothing import passed, smooth
from steelyard.spatial import Rotation


def wave(t, k=0):
    w = np.array([1.1, 2.3, 3.1])
    phase = np.array([0.0, 1.0, 2.0]) + k * np.pi / 2
    return w**k * np.sin(w * t[:, None] + phase)


@pytest.mark.parametrize("noise", [1e-5, 1e-3])
@pytest.mark.parametrize("rate", [30.0, 200.0])
def test_recovers_analytic_derivatives_within_its_own_error(noise, rate):
    rng = np.random.default_rng(3)
    t = np.cumsum(rng.uniform(0.7, 1.3, int(20 * rate)) / rate)
    s = smooth(t, wave(t) + noise * rng.normal(size=(len(t), 3)))
    assert s.noise_std == pytest.approx(noise, rel=0.1)
    at = rng.uniform(t[0] + 1, t[-1] - 1, 1000)
    states, variance = s.at(at)
    for k in range(3):
        chi2 = np.mean((states[:, k] - wave(at, k)) ** 2 / variance[:, k, None])
        assert 0.2 < chi2 < 1.6  # smooth motion is easier than the model expects, never harder


def test_variances_are_calibrated_on_signals_of_its_own_kind():
    rng = np.random.default_rng(0)
    scores = []
    for _ in range(12):
        dt, jerk = 0.01, 40.0
        a = np.cumsum(jerk * np.sqrt(dt) * rng.normal(size=2000))
        v = np.cumsum(a) * dt
        x = np.cumsum(v) * dt
        t = dt * np.arange(2000)
        s = smooth(t, (x + 1e-3 * rng.normal(size=2000))[:, None])
        error = s.states[100:-100, 2, 0] - a[101:-99]  # the second difference of x is one step ahead
        scores.append(np.mean(error**2 / s.variance[100:-100, 2]))
    assert np.mean(scores) == pytest.approx(1.0, abs=0.2)


def test_noise_comes_through_where_nothing_is_taken_off_the_signal():
    rng = np.random.default_rng(1)
    t = np.arange(0, 40, 0.01)
    s = smooth(t, wave(t) + 1e-3 * rng.normal(size=(len(t), 3)))
    inner = slice(200, -200)
    error = s.states[inner, 2] - wave(t[inner], 2)
    assert np.mean(error**2) == pytest.approx(np.mean(s.variance[inner, 2]) * s.passed[2], rel=0.35)
    for order in (3, 4, 5):
        expected = 1 - (2 * np.arange(order) + 1) / (2 * order)
        np.testing.assert_allclose(passed(order, 7.0), expected, rtol=1e-3)
        assert (passed(order, 7.0, 7.0) < expected).all()


def test_a_low_pass_leaves_values_and_derivatives_of_what_is_slow():
    t = np.arange(0, 12, 0.01)
    slow, quick = (np.sin(2 * np.pi * f * t)[:, None] for f in (1.0, 20.0))
    s = smooth(t, slow + 1e-3 * quick, cutoff_hz=5.0)
    assert t[0] + 0.2 <= s.time[0] < s.time[-1] <= t[-1] - 0.2
    at = np.arange(1.0, 11.0, 0.037)
    states, _ = s.at(at)
    for k, value in enumerate((np.sin(2 * np.pi * at), np.cos(2 * np.pi * at), -np.sin(2 * np.pi * at))):
        np.testing.assert_allclose(states[:, k, 0], (2 * np.pi) ** k * value, atol=2e-3 * (2 * np.pi) ** k)


def test_rotation_smoothing_does_not_care_about_frames():
    rng = np.random.default_rng(5)
    t = np.arange(0, 6, 0.01)
    R = Rotation.exp(0.9 * wave(t)) @ Rotation.exp(1e-3 * rng.normal(size=(len(t), 3)))
    A, B = Rotation.exp([0.3, -2.0, 1.0]), Rotation.exp([2.5, 0.4, -0.2])
    at = np.linspace(0.5, 5.5, 200)
    R1, w1, a1, v1 = turning(*smooth_rotations(t, R).at(at))
    R2, w2, a2, v2 = turning(*smooth_rotations(t, A @ R @ B).at(at))
    assert np.allclose((A @ R1 @ B).matrix, R2.matrix, atol=1e-6)
    assert np.allclose(B.inverse().apply(w1), w2, atol=1e-5)
    assert np.allclose(B.inverse().apply(a1), a2, atol=1e-3)
    assert np.allclose(v1, v2, rtol=1e-2)


def test_angular_rates_of_a_known_spin():
    t = np.arange(0, 8, 0.01)
    spin = 0.8 * np.sin(1.5 * t)[:, None] * np.array([0.0, 1.0, 0.0])
    rng = np.random.default_rng(1)
    R = Rotation.exp(spin) @ Rotation.exp(1e-5 * rng.normal(size=(len(t), 3)))
    _, omega, alpha, variance = turning(*smooth_rotations(t, R).at(t))
    inner = slice(50, -50)
    assert np.allclose(omega[inner, 1], (1.2 * np.cos(1.5 * t))[inner], atol=2e-3)
    assert np.allclose(alpha[inner, 1], (-1.8 * np.sin(1.5 * t))[inner], atol=5 * np.sqrt(variance[:, 2].mean()))
    assert np.abs(omega[inner][:, [0, 2]]).max() < 2e-3


def test_too_few_samples_are_refused():
    with pytest.raises(BadValue, match="at least 12 samples"):
        smooth(np.arange(5.0), np.zeros((5, 1)))
