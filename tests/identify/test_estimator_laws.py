"""Laws that every estimator obeys: the truth without noise, no care for order, frames, units or the base."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from bench_logs import BIAS, ESTIMATORS, MOTIONS, OBJECTS, Estimator, bench_log, declared, gaps, same_bits, truth
from hypothesis import given, settings
from hypothesis import strategies as st

from steelyard.errors import BadValue
from steelyard.identify.fit import Bias
from steelyard.identify.geodesic import Geodesic
from steelyard.identify.least_squares import LeastSquares
from steelyard.identify.noise_aware import NoiseAware
from steelyard.inertia import InertialParameters
from steelyard.logs.log import MotionLog, Noise
from steelyard.logs.moments import Moments
from steelyard.logs.recording import Recording
from steelyard.pipelines import held_object
from steelyard.simulate import hammer, scenarios
from steelyard.spatial import Pose, Rotation
from strategies import log_choleskys, rotation_vectors

# What is left of mass, first moment and inertia without noise: rounding, the levels that an undeclared log is given (at
# least 1e-6 N), and for the geodesic estimator its prior.
EXACT = {
    "noise-aware": [1e-7, 1e-7, 5e-6],
    "ordinary": [1e-12, 1e-12, 1e-11],
    "weighted": [1e-12, 1e-12, 1e-11],
    "total": [1e-9, 1e-9, 1e-8],
    "entropic": [1e-6, 1e-6, 2e-5],
    "riemannian": [1e-6, 1e-6, 2e-5],
}
every_estimator = pytest.mark.parametrize("name", ESTIMATORS)


@every_estimator
@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("thing", OBJECTS)
def test_the_truth_without_noise(name: str, motion: str, thing: str) -> None:
    log = bench_log(thing, motion)
    found = ESTIMATORS[name].identify(log)
    assert (gaps(found.parameters, truth(thing)) < EXACT[name]).all()
    np.testing.assert_allclose(found.wrench_bias, BIAS, atol=1e-5)
    assert found.evidence.chi2_per_dof is not None
    assert found.evidence.chi2_per_dof >= 0


@every_estimator
def test_the_truth_of_a_tared_sensor(name: str) -> None:
    log = bench_log("mallet", "stop_go", biased=False)
    found = replace(ESTIMATORS[name], bias="none").identify(log)
    assert (gaps(found.parameters, truth("mallet")) < EXACT[name]).all()
    assert not found.wrench_bias.any()
    assert not found.bias_covariance.any()


@given(theta=log_choleskys(), bias=st.lists(st.floats(-20, 20), min_size=6, max_size=6))
@settings(max_examples=8)
def test_the_truth_of_any_body(theta: np.ndarray, bias: list[float]) -> None:
    body = InertialParameters.from_log_cholesky(theta)
    motion = bench_log("hammer", "dyn_fast")
    log = replace(motion, wrench=motion.predicted(body.vector) + np.array(bias))
    for name in ("noise-aware", "weighted", "total"):
        found = ESTIMATORS[name].identify(log).parameters
        assert (gaps(found, body) < [1e-6, 1e-5, 1e-4]).all(), name


@pytest.mark.parametrize("distance", ["entropic", "riemannian"])
def test_the_geodesic_error_without_noise_goes_with_alpha(distance: str) -> None:
    log, true = bench_log("mallet", "stop_go"), truth("mallet")
    errors = [
        gaps(Geodesic(distance=distance, alpha=alpha).identify(log).parameters, true)  # type: ignore[arg-type]
        for alpha in (1e-12, 1e-11, 1e-10)
    ]
    for weak, strong in pairwise(errors):
        assert (strong > 3 * weak).all()
        assert (strong < 20 * weak).all()


@pytest.mark.parametrize("distance", ["entropic", "riemannian"])
def test_a_geodesic_prior_that_is_the_truth_does_no_harm(distance: str) -> None:
    log, true = bench_log("hacksaw", "stop_go"), truth("hacksaw")
    found = Geodesic(prior=true, distance=distance, alpha=1e-3).identify(log).parameters  # type: ignore[arg-type]
    assert (gaps(found, true) < 1e-7).all()


@every_estimator
def test_same_input_same_output(name: str) -> None:
    log = bench_log("mallet", "stop_go", "moderate", 3)
    copy = replace(log, wrench=np.array(log.wrench))
    assert same_bits(ESTIMATORS[name].identify(log), ESTIMATORS[name].identify(copy))
    moments = Moments.of_log(log)
    assert same_bits(ESTIMATORS[name].solve(moments), ESTIMATORS[name].solve(moments))


@every_estimator
@pytest.mark.parametrize("known_noise", [True, False])
def test_order_of_samples_is_irrelevant(name: str, known_noise: bool) -> None:
    log = bench_log("mallet", "stop_go", "moderate", 3)
    log = log if known_noise else replace(log, noise=None)
    one = ESTIMATORS[name].identify(log)
    other = ESTIMATORS[name].identify(log.rows(np.random.default_rng(0).permutation(len(log))))
    if known_noise:
        assert (gaps(other.parameters, one.parameters) < 1e-10).all()
        np.testing.assert_allclose(other.std, one.std, rtol=1e-7)
        assert other.codes() == one.codes()
    else:
        # Undeclared noise of moving rows comes from the still ones, which order does not touch either.
        assert (gaps(other.parameters, one.parameters) < 1e-9).all()


def adjoint(X: Pose) -> np.ndarray:
    """The linear map (10, 10) that takes parameters in S to those in A."""
    return np.stack([InertialParameters(unit).in_frame(X).vector for unit in np.eye(10)], axis=1)


@every_estimator
@given(turn=rotation_vectors(), shift=st.lists(st.floats(-0.2, 0.2), min_size=3, max_size=3))
@settings(max_examples=6)
def test_another_sensor_frame_without_noise(name: str, turn: np.ndarray, shift: list[float]) -> None:
    X = Pose(Rotation.exp(turn), np.array(shift))
    log = bench_log("mallet", "stop_go")
    found = ESTIMATORS[name].identify(log.in_frame(X))
    assert (gaps(found.parameters, truth("mallet").in_frame(X)) < 5 * np.array(EXACT[name])).all()


@every_estimator
@given(turn=rotation_vectors())
@settings(max_examples=6)
def test_a_turned_sensor_turns_the_answer_and_its_covariance(name: str, turn: np.ndarray) -> None:
    """Noise that is alike on the three axes stays so when S turns (but not when it moves)."""
    X = Pose(Rotation.exp(turn), np.zeros(3))
    log = bench_log("mallet", "stop_go", "moderate", 1)
    moments, turned = Moments.of_log(log), Moments.of_log(replace(log.in_frame(X), noise=log.noise))
    one, other = ESTIMATORS[name].solve(moments), ESTIMATORS[name].solve(turned)
    # Newton on the cone ends at a relative fall of the cost, so that its last digits depend on the path.
    exact = 1e-6 if isinstance(ESTIMATORS[name], Geodesic) else 1e-9
    assert (gaps(other.parameters, one.parameters.in_frame(X)) < exact).all()
    A = adjoint(X)
    expected = A @ one.covariance @ A.T
    size = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    # Information that noise in the regressor leaves below zero is set to zero along axes that turn with S.
    assert float((np.abs(other.covariance - expected) / size).max()) < (0.02 if name == "noise-aware" else 1e-4)
    bias = np.concatenate([X.rotation.apply(one.wrench_bias[:3]), X.rotation.apply(one.wrench_bias[3:])])
    np.testing.assert_allclose(other.wrench_bias, bias, atol=1e-6)


@pytest.mark.parametrize("name", ["noise-aware", "ordinary", "weighted", "total"])
@pytest.mark.parametrize("factor", [4.448221615, 0.224809, 20.0])
def test_another_unit_of_force(name: str, factor: float) -> None:
    """The geodesic prior's strength is a trace in the units at hand, so that only the others obey this.

    Total least squares takes its weights from a solution held to the size of things that are held, at 1e-6 of them.
    """
    log = bench_log("mallet", "stop_go", "moderate", 2)
    noise = tuple(Noise(n.acceleration, factor**2 * n.wrench) for n in log.noise or ())
    one = ESTIMATORS[name].solve(Moments.of_log(log))
    other = ESTIMATORS[name].solve(Moments.of_log(replace(log, wrench=factor * log.wrench, noise=noise)))
    assert (
        gaps(InertialParameters(other.parameters.vector / factor), one.parameters) < (1e-6 if name == "total" else 1e-8)
    ).all()
    np.testing.assert_allclose(other.std / factor * ([1] + 3 * [factor] + 6 * [1]), one.std, rtol=1e-5)
    np.testing.assert_allclose(other.wrench_bias / factor, one.wrench_bias, atol=1e-7)


@given(scale=st.floats(0.1, 10))
@settings(max_examples=5)
def test_louder_noise_of_the_same_rows_widens_the_error_bars_alone(scale: float) -> None:
    """Weighted least squares does not care about a common factor of the declared noise."""
    log = bench_log("mallet", "stop_go", "moderate", 2)
    one = LeastSquares("weighted").solve(Moments.of_log(declared(log, 0, 0, 0.3, 0.01)))
    other = LeastSquares("weighted").solve(Moments.of_log(declared(log, 0, 0, 0.3 * scale, 0.01 * scale)))
    assert (gaps(other.parameters, one.parameters) < 1e-10).all()


def turned_base(recording: Recording, turn: Rotation) -> Recording:
    """The same recording told in a world frame turned by `turn`."""
    streams = []
    for stream in recording.streams:
        channels = dict(stream.channels)
        if "rotation" in channels:
            channels["rotation"] = (turn @ Rotation(channels["rotation"])).matrix
        if "position" in channels:
            channels["position"] = turn.apply(channels["position"])
        streams.append(replace(stream, channels=channels))
    return replace(recording, streams=tuple(streams), gravity=turn.apply(recording.gravity))


def test_the_base_may_stand_anyhow() -> None:
    made = hammer.recording(4).recording
    one = held_object.identify(made)
    other = held_object.identify(turned_base(made, Rotation.exp([0.4, -1.1, 0.7])))
    # Delay and row selection are found by searches that stop at a tolerance; they must not leave the error bars.
    assert (np.abs(other.parameters.vector - one.parameters.vector)[0] < 0.05 * one.std[0]).all()
    assert (np.abs(other.com - one.com) < 0.05 * one.std[1:4]).all()
    assert other.codes() == one.codes()


@given(
    thing=st.sampled_from(scenarios.object_names()),
    motion=st.sampled_from(MOTIONS),
    noise=st.sampled_from(["low", "moderate", "high"]),
    seed=st.integers(0, 10_000),
    bias=st.sampled_from(["free", "none"]),
    known=st.booleans(),
)
@settings(max_examples=40)
def test_noise_aware_is_always_a_rigid_body(
    thing: str, motion: str, noise: str, seed: int, bias: str, known: bool
) -> None:
    log = bench_log(thing, motion, noise, seed, biased=bias == "free")
    found = NoiseAware(bias=bias).identify(log if known else replace(log, noise=None))
    assert found.parameters.validity().consistent
    assert float(np.linalg.eigvalsh(found.parameters.pseudo_inertia)[0]) > 0
    assert (np.abs(found.std) < np.inf).all()
    assert (np.linalg.eigvalsh(found.covariance) > -1e-12 * np.trace(found.covariance)).all()


@pytest.mark.parametrize("distance", ["entropic", "riemannian"])
@pytest.mark.parametrize("motion", MOTIONS)
def test_geodesic_is_always_a_rigid_body(distance: str, motion: str) -> None:
    for seed in range(5):
        log = bench_log("hacksaw", motion, "high", seed)
        found = Geodesic(distance=distance, alpha=1e-8).identify(log)  # type: ignore[arg-type]
        assert found.parameters.validity().consistent


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: LeastSquares("huber"), "kind must be one of ordinary, weighted, total; got 'huber'."),  # type: ignore[arg-type]
        (lambda: Geodesic(distance="euclid"), "distance must be entropic or riemannian; got 'euclid'."),  # type: ignore[arg-type]
        (lambda: Bias("fixed"), "bias must be free or none; got 'fixed'."),  # type: ignore[arg-type]
        (lambda: Bias.of("fixed"), "bias must be free or none; got 'fixed'."),
        (
            lambda: Bias("none", drift=True),
            'A tared sensor (bias "none") cannot drift; use bias "free" with drift.',
        ),
    ],
)
def test_options_that_make_no_sense(make: object, text: str) -> None:
    with pytest.raises(BadValue) as caught:
        make()  # type: ignore[operator]
    assert str(caught.value) == text


@every_estimator
def test_a_statistic_without_noise_is_refused(name: str) -> None:
    moments = Moments.of_log(bench_log("hammer", "stop_go"))
    with pytest.raises(BadValue, match=r"^The statistic must carry its noise; got none\."):
        ESTIMATORS[name].solve(moments)


def plain_ordinary(log: MotionLog) -> np.ndarray:
    """Ordinary least squares [phi, bias] (16,) from the stacked regressor, row by row."""
    Y = np.stack([log.predicted(unit).ravel() for unit in np.eye(10)], axis=1)
    Y = np.concatenate([Y, np.tile(np.eye(6), (len(log), 1))], axis=1)
    return np.linalg.lstsq(Y, log.wrench.ravel(), rcond=None)[0]


def test_ordinary_is_numpy_least_squares() -> None:
    log = bench_log("mallet", "dyn_fast", "moderate", 5)
    found = LeastSquares("ordinary").identify(log)
    expected = plain_ordinary(log)
    np.testing.assert_allclose(found.parameters.vector, expected[:10], rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(found.wrench_bias, expected[10:], rtol=1e-8, atol=1e-8)


def test_total_least_squares_beats_weighted_where_the_regressor_is_noisy() -> None:
    def error(estimator: Estimator) -> float:
        seen = [estimator.identify(bench_log("hammer", "dyn_slow", "high", s)).parameters for s in range(8)]
        return float(np.median([gaps(found, truth("hammer"))[1] for found in seen]))

    assert error(LeastSquares("total")) < 0.5 * error(LeastSquares("weighted"))
    assert error(NoiseAware()) < 0.5 * error(LeastSquares("weighted"))
