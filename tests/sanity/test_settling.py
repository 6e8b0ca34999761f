"""A sensor that warms up ever slower: its offset settles, and is no hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from steelyard.identify.fit import Bias
from steelyard.identify.noise_aware import NoiseAware
from steelyard.logs.drift import STEADILY, settled_course
from steelyard.logs.log import MotionLog
from steelyard.sanity.fitted.biases import drift_of
from steelyard.sanity.holding.contact import untouched
from steelyard.simulate import scenarios
from steelyard.simulate.logs import simulate_log

CHANGE = np.array([0.05, -0.03, 0.02, 1.5, -2.0, 0.8])


def warming(settling: float, level: str = "moderate", motion: str = "stop_go") -> MotionLog:
    """A log whose offset changes by CHANGE [tau, f], and settles with a time constant [s]."""
    log, _ = simulate_log("hammer", motion, level, 3, shuffled=False, spectrum="white", bias=None)
    course = (settled_course(np.asarray(log.time), settling) + 1) / 2
    return replace(log, noise=None, wrench=log.wrench + course[:, None] * CHANGE)


def test_a_course_runs_from_one_end_to_the_other_and_slows() -> None:
    time = np.linspace(3.0, 13.0, 101)
    for settling in (0.5, 4.0, 1e4, STEADILY):
        assert settled_course(time, settling)[[0, -1]] == pytest.approx([-1, 1])
    assert settled_course(time, 4.0)[50] > 0.4
    assert settled_course(time, 1e5) == pytest.approx(settled_course(time, STEADILY), abs=1e-4)


@pytest.mark.parametrize("settling", [1.0, 3.0, STEADILY])
def test_it_is_told_how_fast_an_offset_settles(settling: float) -> None:
    found = drift_of(warming(settling))
    assert found is not None
    assert found.large
    assert found.settling == pytest.approx(settling, rel=0.4)
    assert (np.abs(found.growth - CHANGE) < 5 * found.std + 0.1 * np.abs(CHANGE)).all()


@pytest.mark.parametrize("motion", ["stop_go", "dyn_slow"])
@pytest.mark.parametrize("settling", [1.0, 3.0])
def test_what_warms_up_is_no_hand(settling: float, motion: str) -> None:
    assert untouched(warming(settling, "low", motion), True)[1] == ()


def test_an_offset_that_settles_is_taken_out() -> None:
    log, truth = warming(2.0, "none"), float(scenarios.body("hammer").parameters().mass)
    found = NoiseAware(bias=Bias(drift=True, settling=2.0)).identify(log)
    assert found.mass == pytest.approx(truth, rel=1e-5)
    assert abs(NoiseAware(bias=Bias(drift=True)).identify(log).mass / truth - 1) > 1e-3
