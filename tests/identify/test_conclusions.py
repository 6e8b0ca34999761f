"""What is said about an answer: error bars against scatter, leave-one-out against real refits, what is identified."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bench_logs import BIAS, ESTIMATORS, MOTIONS, OBJECTS, Estimator, bench_log, people, truth

from steelyard.errors import CannotAnswer
from steelyard.identify.fit import Bias
from steelyard.identify.geodesic import Geodesic
from steelyard.identify.least_squares import LeastSquares
from steelyard.identify.noise_aware import NoiseAware
from steelyard.identify.problem import BiasPrior
from steelyard.logs.log import MotionLog
from steelyard.logs.moments import Moments
from steelyard.simulate.logs import simulate_log
from steelyard.simulate.noise import SPECTRA, Spectrum


@pytest.mark.parametrize("spectrum", SPECTRA)
def test_error_bars_cover_the_truth(spectrum: Spectrum) -> None:
    """A quick look: 100 logs, pooled by kind; the bench has a thousand."""
    inside = []
    for seed in range(100):
        name = OBJECTS[seed % 3]
        log, true = simulate_log(name, "stop_go", "moderate", seed, shuffled=False, spectrum=spectrum)
        found = NoiseAware(bias="none").identify(log)
        inside.append(np.abs(people(found.parameters) - people(true)) < 1.96 * found.std)
    share = np.array(inside).mean(0)
    for kind in (share[:1], share[1:4], share[4:]):
        assert 0.88 <= float(kind.mean()) <= 0.99


def test_no_bar_is_narrower_than_leaving_blocks_out_shows() -> None:
    """Stretches in which one torque is a little off: what is wrong is the same all through a stretch."""
    wider = 0
    for seed in range(4):
        log, _ = simulate_log("hammer", "stop_go", "moderate", seed, shuffled=False)
        stretch = np.arange(len(log)) * 20 // len(log)
        wrong = np.zeros((len(log), 6))
        wrong[:, 0] = np.random.default_rng(seed).normal(0, 0.02, 20)[stretch]
        found = NoiseAware().identify(replace(log, wrench=log.wrench + wrong, pose=stretch))
        jackknife, known = found.evidence.jackknife_people, found.identified
        assert jackknife is not None
        assert known.all()
        assert (found.std > 0.999 * jackknife).all()
        wider += int((found.std > 1.001 * jackknife).sum())
        np.testing.assert_allclose(found.covariance, found.covariance.T, atol=1e-15)
    assert wider  # a bar that is wider for its own reasons stays so


def test_error_bars_shrink_with_the_root_of_the_rows() -> None:
    def std(repeats: int) -> np.ndarray:
        log, _ = simulate_log("mallet", "stop_go", "moderate", 0, shuffled=True, repeats=repeats)
        return NoiseAware(bias="none").identify(log).std

    np.testing.assert_allclose(std(1) / std(16), 4, rtol=0.35)


def refits(log: MotionLog, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Parameters of real refits (B, 10) without one pose, and the mean squared error (6,) of predicting it."""
    moments = Moments.of_log(log)
    found, misses, rows = [], np.zeros(6), 0
    for pose in np.unique(log.pose[log.pose >= 0]):
        without = ESTIMATORS[name].solve(moments.where(moments.block != pose))
        held = log.rows(log.pose == pose)
        misses += ((held.wrench - held.predicted(without.parameters.vector) - without.wrench_bias) ** 2).sum(0)
        rows += len(held)
        found.append(without.parameters.vector)
    return np.array(found), misses / rows


@pytest.mark.parametrize("name", ["noise-aware", "weighted", "total"])
def test_holdout_is_that_of_real_refits(name: str) -> None:
    log = bench_log("mallet", "stop_go", "moderate", 2)
    seen = ESTIMATORS[name].solve(Moments.of_log(log)).evidence
    _, square = refits(log, name)
    assert seen.holdout_force_N == pytest.approx(np.sqrt(square[3:].mean()), rel=2e-3)
    assert seen.holdout_torque_Nm == pytest.approx(np.sqrt(square[:3].mean()), rel=2e-3)


def test_jackknife_is_that_of_real_refits() -> None:
    log = bench_log("mallet", "stop_go", "moderate", 2)
    seen = NoiseAware().solve(Moments.of_log(log)).evidence
    moved, _ = refits(log, "noise-aware")
    count = len(moved)
    spread = np.sqrt((count - 1) / count * ((moved - moved.mean(0)) ** 2).sum(0))
    np.testing.assert_allclose(seen.jackknife, spread, rtol=0.05)


def test_no_holdout_where_blocks_are_few() -> None:
    log = replace(bench_log("mallet", "stop_go", "moderate"), pose=None)
    seen = NoiseAware().identify(log).evidence
    assert seen.holdout_force_N is None
    assert seen.jackknife is None


@pytest.mark.parametrize("estimator", [NoiseAware(), LeastSquares("ordinary"), LeastSquares("total"), Geodesic()])
def test_still_logs_do_not_tell_the_inertia(estimator: Estimator) -> None:
    log = bench_log("hammer", "stop_go", "moderate")
    still = log.rows(log.still)
    poses = MotionLog.of_poses(still.wrench[::20], still.gravity[::20])
    for seen in (still, poses):
        found = estimator.identify(seen)
        assert found.inertia_com is None
        assert found.identified[:4].all()
        assert "inertia-not-identified" in found.codes()
        assert abs(found.mass / 0.945888 - 1) < 0.01


def test_of_fast_motion_all_is_identified() -> None:
    for thing in OBJECTS:
        found = NoiseAware().identify(bench_log(thing, "dyn_fast", "moderate"))
        assert found.identified.all()
        assert found.inertia_com is not None
        assert found.evidence.rank == 10
        np.testing.assert_allclose(found.inertia_com, found.parameters.inertia_com)


@pytest.mark.parametrize("motion", MOTIONS)
def test_evidence_of_a_log_with_declared_noise(motion: str) -> None:
    log = bench_log("mallet", motion, "moderate", 1)
    seen = NoiseAware().identify(log).evidence
    assert seen.samples == 1000
    assert seen.still_samples <= int(log.still.sum())
    assert seen.chi2_per_dof == pytest.approx(1, abs=0.1)
    residual = log.wrench - log.predicted(truth("mallet").vector) - BIAS
    if motion != "stop_go":  # there resting rows are predicted without their measured acceleration
        assert seen.residual_force_N == pytest.approx(np.sqrt((residual[:, 3:] ** 2).mean()), rel=0.02)
        assert seen.residual_torque_Nm == pytest.approx(np.sqrt((residual[:, :3] ** 2).mean()), rel=0.05)
    assert seen.spread is not None
    assert (seen.spread > 0).all()


def test_a_tight_bias_prior_is_a_known_bias() -> None:
    log = bench_log("mallet", "dyn_slow", "moderate", 1)
    known = NoiseAware(bias="none").identify(replace(log, wrench=log.wrench - BIAS))
    tight = NoiseAware(bias=Bias(prior=BiasPrior(BIAS, 1e14 * np.eye(6)))).identify(log)
    np.testing.assert_allclose(tight.wrench_bias, BIAS, atol=1e-6)
    assert (np.abs(people(tight.parameters) - people(known.parameters)) < 1e-3 * known.std).all()
    # Correlation along time is estimated from residuals, less the parameters' share: 16 or 10 of them.
    np.testing.assert_allclose(tight.std, known.std, rtol=0.02)


def test_a_loose_bias_prior_is_none() -> None:
    log = bench_log("mallet", "dyn_slow", "moderate", 1)
    free = NoiseAware().identify(log)
    loose = NoiseAware(bias=Bias(prior=BiasPrior(BIAS + 5, 1e-9 * np.eye(6)))).identify(log)
    assert (np.abs(people(loose.parameters) - people(free.parameters)) < 1e-4 * free.std).all()
    np.testing.assert_allclose(loose.std, free.std, rtol=1e-4)
    np.testing.assert_allclose(loose.wrench_bias, free.wrench_bias, atol=1e-6)


def test_a_bias_prior_of_middling_strength_narrows_the_error_bars() -> None:
    log = bench_log("mallet", "dyn_slow", "moderate", 1)
    free = NoiseAware().identify(log)
    prior = BiasPrior(BIAS, np.linalg.inv(free.bias_covariance))
    shared = NoiseAware(bias=Bias(prior=prior)).identify(log)
    # Twice the information about the bias halves its variance.
    ratio = np.diag(shared.bias_covariance) / np.diag(free.bias_covariance)
    assert (ratio < 0.75).all()
    assert (ratio > 0.35).all()
    assert (shared.std <= free.std * 1.01).all()


def drifting(log: MotionLog, change: np.ndarray) -> MotionLog:
    assert log.time is not None
    share = (2 * log.time - log.time[0] - log.time[-1]) / (log.time[-1] - log.time[0])
    return replace(log, wrench=log.wrench + share[:, None] * change / 2)


@pytest.mark.parametrize("name", ["noise-aware", "weighted", "total"])
def test_a_linear_drift_is_recovered(name: str) -> None:
    change = np.array([0.1, -0.06, 0.04, 2.0, -4.0, 1.0])
    log = drifting(bench_log("mallet", "stop_go"), change)
    found = replace(ESTIMATORS[name], bias=Bias(drift=True)).identify(log)
    np.testing.assert_allclose(people(found.parameters), people(truth("mallet")), rtol=1e-5, atol=1e-7)
    np.testing.assert_allclose(found.wrench_bias, BIAS, atol=1e-5)


def test_a_drift_in_noise_is_recovered_within_its_error_bars() -> None:
    change = np.array([0.1, -0.06, 0.04, 2.0, -4.0, 1.0])
    log = drifting(bench_log("mallet", "stop_go", "moderate"), change)
    with_drift = NoiseAware(bias=Bias(drift=True)).identify(log)
    gap = np.abs(people(with_drift.parameters) - people(truth("mallet")))
    assert (gap < 4 * with_drift.std).all()
    without = NoiseAware().identify(log)
    assert abs(without.mass - 0.4224) > 10 * abs(with_drift.mass - 0.4224)


def test_drift_without_a_clock() -> None:
    log = replace(bench_log("mallet", "stop_go"), time=None)
    with pytest.raises(CannotAnswer) as caught:
        NoiseAware(bias=Bias(drift=True)).identify(log)
    assert str(caught.value) == "A drifting bias needs a clock; the log has none. Record a time column."
