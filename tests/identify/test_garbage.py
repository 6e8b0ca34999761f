"""Logs that hold no body: every estimator answers or raises an error of ours, never anything else, never NaN."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bench_logs import BIAS, ESTIMATORS, bench_log, declared
from hypothesis import given, settings
from hypothesis import strategies as st

from steelyard.errors import BadValue, CannotAnswer, SteelyardError
from steelyard.identify.estimate import Estimate
from steelyard.identify.noise_aware import NoiseAware
from steelyard.logs.log import MotionLog, Noise

KINDS = ("normal", "zero", "constant", "huge", "tiny", "cauchy")


def channel(kind: str, rng: np.random.Generator, rows: int, columns: int) -> np.ndarray:
    values = rng.normal(size=(rows, columns))
    if kind == "cauchy":
        return rng.standard_cauchy((rows, columns))
    if kind == "constant":
        return np.tile(rng.normal(size=(1, columns)), (rows, 1))
    return values * {"normal": 1.0, "zero": 0.0, "huge": 1e8, "tiny": 1e-10}[kind]


@st.composite
def garbage(draw: st.DrawFn) -> MotionLog:
    rng = np.random.default_rng(draw(st.integers(0, 2**20)))
    rows = draw(st.sampled_from([0, 1, 2, 3, 7, 20, 60, 150]))
    kinds = draw(st.tuples(*[st.sampled_from(KINDS)] * 5))
    wrench, gravity, a, omega, alpha = (channel(k, rng, rows, 6 if i == 0 else 3) for i, k in enumerate(kinds))
    if draw(st.booleans()):
        gravity = rng.normal(size=(rows, 3))
        gravity = 9.81 * gravity / np.linalg.norm(gravity, axis=1, keepdims=True)
    noise = None
    if draw(st.booleans()):
        noise = (Noise.of_std(*(10.0 ** rng.uniform(-6, 4, 4))),)
    return MotionLog(
        wrench,
        gravity,
        a,
        omega,
        alpha,
        time=np.sort(rng.uniform(0, 10, rows)) if draw(st.booleans()) else None,
        still=rng.random(rows) < draw(st.sampled_from([0.0, 0.5, 1.0])),
        pose=rng.integers(-1, 5, rows),
        noise=noise,
    )


def sound(found: Estimate) -> None:
    """No NaN anywhere, error bars that are none negative, a covariance that is one."""
    assert np.isfinite(found.parameters.vector).all()
    assert not np.isnan(found.covariance).any()
    assert not np.isnan(found.std).any()
    assert (np.diag(found.covariance) >= 0).all()


@pytest.mark.parametrize("name", ESTIMATORS)
@given(log=garbage(), bias=st.sampled_from(["free", "none"]))
@settings(max_examples=40)
def test_an_answer_or_an_error_of_ours(name: str, log: MotionLog, bias: str) -> None:
    try:
        found = replace(ESTIMATORS[name], bias=bias).identify(log)
    except SteelyardError:
        return
    sound(found)
    if name == "noise-aware":
        assert found.parameters.validity().consistent


def still_poses(directions: list[list[float]], rows: int = 20, seed: int = 0) -> MotionLog:
    """Still rows of a 1 kg body 5 cm off the sensor under gravity along each of the directions."""
    rng = np.random.default_rng(seed)
    gravity = 9.81 * np.repeat(np.array(directions, float), rows, axis=0)
    force = -gravity
    torque = np.cross([0.01, 0.02, 0.05], force)
    log = MotionLog.of_poses(np.concatenate([torque, force], 1) + BIAS, gravity)
    noise = rng.normal(size=log.wrench.shape) * np.repeat([0.002, 0.05], 3)
    return replace(log, wrench=log.wrench + noise, pose=np.repeat(np.arange(len(directions)), rows))


UP, DOWN, SIDE, FRONT = [0, 0, 1.0], [0, 0, -1.0], [1.0, 0, 0], [0, 1.0, 0]
ADVICE = (
    "Add still poses that turn gravity to other axes of the sensor: at least three, more than 30 degrees apart, "
    "about two different axes"
)
TARE = "; or tare the sensor without a load and say --bias none."
AXES = ["the centre of mass along x", "the centre of mass along y", "the centre of mass along z"]


@pytest.mark.parametrize("name", ["noise-aware", "weighted"])
@pytest.mark.parametrize(
    ("directions", "bias", "lost"),
    [
        ([DOWN], "free", ["the mass", *AXES]),
        # Of one pose a tared sensor tells the mass, and the centre of mass across gravity.
        ([DOWN], "none", ["the centre of mass along z"]),
        # Gravity up and down a tool's axis: mass, and the centre of mass across it.
        ([DOWN, UP], "free", ["the centre of mass along z"]),
        ([DOWN, UP], "none", ["the centre of mass along z"]),
    ],
)
def test_too_few_directions(name: str, directions: list[list[float]], bias: str, lost: list[str]) -> None:
    log = still_poses(directions)
    if bias == "none":
        log = replace(log, wrench=log.wrench - BIAS)
    with pytest.raises(CannotAnswer) as caught:
        replace(ESTIMATORS[name], bias=bias).identify(log)
    poses = f"{len(log)} rows in {len(directions)} still poses or time blocks"
    ending = TARE if bias == "free" else "."
    assert str(caught.value) == f"The data do not fix {', '.join(lost)} ({poses}). {ADVICE}{ending}"


@pytest.mark.parametrize("name", ["noise-aware", "weighted", "total"])
def test_three_directions_are_enough(name: str) -> None:
    found = ESTIMATORS[name].identify(still_poses([DOWN, SIDE, FRONT]))
    assert abs(found.mass - 1) < 4 * found.std[0]
    assert (np.abs(found.com - [0.01, 0.02, 0.05]) < 4 * found.std[1:4] + 1e-4).all()
    assert found.inertia_com is None
    assert "inertia-not-identified" in found.codes()


def test_two_directions_of_a_tared_sensor_are_enough() -> None:
    log = still_poses([DOWN, SIDE])
    found = NoiseAware(bias="none").identify(replace(log, wrench=log.wrench - BIAS))
    assert abs(found.mass - 1) < 4 * found.std[0]


@pytest.mark.parametrize("rows", [0, 1])
@pytest.mark.parametrize("name", ESTIMATORS)
def test_too_few_rows(name: str, rows: int) -> None:
    count = "1 usable row" if rows == 1 else "0 usable rows"
    text = f"The log has {count}, which cannot tell a weight from a bias. {ADVICE}."
    log = bench_log("hammer", "stop_go", "moderate").rows(slice(0, rows))
    for version in (log, replace(log, noise=None)):
        with pytest.raises(CannotAnswer) as caught:
            ESTIMATORS[name].identify(version)
        assert str(caught.value) == text


@pytest.mark.parametrize("name", ["noise-aware", "weighted"])
def test_nothing_moves_and_nothing_is_felt(name: str) -> None:
    zero = np.zeros((50, 3))
    with pytest.raises(CannotAnswer):
        ESTIMATORS[name].identify(MotionLog(np.zeros((50, 6)), zero, zero, zero, zero))


@pytest.mark.parametrize("name", ["noise-aware", "weighted"])
def test_an_empty_hand(name: str) -> None:
    """Gravity goes all ways and the sensor feels nothing but its bias: no body of some mass is invented."""
    log = still_poses([DOWN, UP, SIDE, FRONT])
    rng = np.random.default_rng(1)
    empty = replace(log, wrench=BIAS + rng.normal(size=log.wrench.shape) * np.repeat([0.002, 0.05], 3))
    with pytest.raises(CannotAnswer, match="The data do not fix"):
        ESTIMATORS[name].identify(empty)


def test_a_noise_of_zero_is_refused() -> None:
    log = declared(bench_log("hammer", "stop_go"), 0.0, 0.0, 0.0, 0.0)
    found = NoiseAware().identify(log)  # zero means "not known" in a log, and is estimated
    assert found.mass == pytest.approx(0.945888, rel=1e-4)


@pytest.mark.parametrize(
    ("options", "said"),
    [({"prior": -1.0}, "prior"), ({"size": 0.0}, "size"), ({"size_spread": np.nan}, "size"), ({"iterations": 0}, "it")],
)
def test_options_without_sense_are_refused(options: dict[str, float], said: str) -> None:
    with pytest.raises(BadValue, match=f"^{said}"):
        NoiseAware(**options)  # type: ignore[arg-type]
