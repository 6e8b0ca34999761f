"""One body has one mass: what is accelerated beside what is weighed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from steelyard.findings import Finding
from steelyard.logs.log import MotionLog
from steelyard.sanity.fitted import load_motion
from steelyard.sanity.fitted.load_motion import TwoMasses, examine_masses, two_masses
from steelyard.simulate.logs import simulate_log

MOTIONS = ("stop_go", "dyn_slow", "dyn_fast")


def made(motion: str, noise: str = "low", seed: int = 0, tool: str = "drill") -> MotionLog:
    return simulate_log(tool, motion, noise, seed, shuffled=False)[0]


def codes(log: MotionLog, known: tuple[Finding, ...] = ()) -> list[str]:
    return [f.code for f in examine_masses(log, known)]


def weighing_less(log: MotionLog, share: float) -> MotionLog:
    """Return the log of a controller that takes a share of the weight away from the forces."""
    held = two_masses(log)
    assert held is not None
    taken = share * held.weighed * log.gravity
    return replace(log, wrench=log.wrench + np.hstack([np.zeros_like(taken), taken]))


def of_the_tip(log: MotionLog, tip: tuple[float, float, float]) -> MotionLog:
    """Return the log whose positions are those of another point, `tip` [m] in S."""
    omega, alpha = log.angular_velocity, log.angular_acceleration
    return replace(log, acceleration=log.acceleration + np.cross(alpha, tip) + np.cross(omega, np.cross(omega, tip)))


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("noise", ["low", "moderate", "high"])
@pytest.mark.parametrize("seed", range(3))
def test_a_sound_log_is_silent(motion: str, noise: str, seed: int) -> None:
    for tool in ("drill", "screwdriver"):
        assert codes(made(motion, noise, seed, tool)) == []


@pytest.mark.parametrize(
    ("motion", "share"), [("stop_go", 0.6), ("dyn_slow", 0.6), ("dyn_fast", 0.25), ("dyn_fast", 0.6)]
)
def test_a_weight_that_is_taken_away(motion: str, share: float) -> None:
    log = weighing_less(made(motion), share)
    found = two_masses(log)
    assert found is not None
    assert found.weighed / found.mass == pytest.approx(1 - share, abs=0.1)
    assert codes(log) == ["weight-compensated"]


@pytest.mark.parametrize("share", [0.03, 0.06])
def test_a_small_weight_that_is_taken_away_where_the_motion_shows_it(share: float) -> None:
    assert codes(weighing_less(made("dyn_fast"), share)) == ["weight-compensated"]


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("smooth_s", [0.03, 0.06, 0.1])
def test_positions_through_a_filter_are_no_controller(motion: str, smooth_s: float) -> None:
    """Their accelerations are too small, the more the quicker: up to 11 % here."""
    log = made(motion)
    assert log.time is not None
    smooth = gaussian_filter1d(log.acceleration, smooth_s / float(log.time[1] - log.time[0]), axis=0)
    assert codes(replace(log, acceleration=smooth)) == []


def test_accelerations_of_another_scale_are_no_controller() -> None:
    log = made("dyn_fast")
    assert codes(replace(log, acceleration=0.985 * log.acceleration)) == []


@pytest.mark.parametrize("motion", ["stop_go", "dyn_fast"])
def test_positions_of_the_tip_of_the_tool(motion: str) -> None:
    assert codes(of_the_tip(made(motion), (0.0, 0.0, 0.15))) == ["motion-mismatch"]


def test_accelerations_that_are_too_large() -> None:
    log = made("dyn_fast")
    assert codes(replace(log, acceleration=2 * log.acceleration)) == ["motion-mismatch"]


def test_it_is_said_once() -> None:
    log = weighing_less(made("dyn_fast"), 0.6)
    assert codes(log, (Finding.of("weight-compensated", "So it is."),)) == []


def test_rows_at_rest_say_nothing() -> None:
    log = made("stop_go")
    assert two_masses(log.rows(log.still)) is None


def test_about_one_axis_noise_of_the_motion_is_allowed_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """A lever passes for a mass there, and noise of either draws both (a sound sweep of one joint came out so)."""
    log = made("dyn_slow")
    found = TwoMasses(1.92, np.array([0.0, 0, 0.1]), np.array([0.42, 0, 0, -0.1]), np.full(4, 0.026), 0.89, 9.0, 0.146)
    monkeypatch.setattr(load_motion, "two_masses", lambda log, bending=False: found)
    assert codes(log) == ["weight-compensated"]
    one_axis = replace(log, gravity=log.gravity * [0.001, 1, 1])
    assert codes(one_axis) == []
    monkeypatch.setattr(load_motion, "two_masses", lambda log, bending=False: replace(found, noise=0.01))
    assert codes(one_axis) == ["weight-compensated"]
