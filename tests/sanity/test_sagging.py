"""A load that sags in its grip: bars hold what that moves the answer by, and a stiff grip keeps its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sound_hammer import hammer_answer
from steelyard.findings import Finding
from steelyard.identify.estimate import Estimate
from steelyard.logs.log import MotionLog
from steelyard.sanity.fitted.full_fit import Rows
from steelyard.sanity.fitted.yielding import allow_sag, sag
from steelyard.simulate.logs import simulate_log

# [m per m/s^2] under its weight the load gives way by 6 mm along x and 1.5 mm along z.
SOFT = 3e-3 / 9.81 * np.array([[2.0, 0.3, 0.0], [0.3, 1.0, -0.4], [0.0, -0.4, 0.5]])


@pytest.fixture(scope="module")
def estimate() -> Estimate:
    return hammer_answer()


def made(motion: str, noise: str = "low", seed: int = 0, tool: str = "drill") -> MotionLog:
    return simulate_log(tool, motion, noise, seed, shuffled=False)[0]


def sagging(log: MotionLog, mass: float, soft: np.ndarray = SOFT) -> MotionLog:
    """Return the log of a load whose centre of mass goes with gravity."""
    turned = np.cross(log.gravity @ soft, mass * (log.acceleration - log.gravity))
    return replace(log, wrench=log.wrench + np.hstack([turned, np.zeros_like(turned)]))


@pytest.mark.parametrize("motion", ["stop_go", "dyn_slow", "dyn_fast"])
@pytest.mark.parametrize("noise", ["low", "moderate", "high"])
@pytest.mark.parametrize("seed", range(3))
def test_a_stiff_grip_keeps_its_bars(motion: str, noise: str, seed: int, estimate: Estimate) -> None:
    for tool in ("drill", "screwdriver"):
        assert allow_sag(made(motion, noise, seed, tool), estimate, ()) is estimate


@pytest.mark.parametrize("motion", ["stop_go", "dyn_fast"])
def test_a_sag_is_seen_and_said(motion: str, estimate: Estimate) -> None:
    log, truth = simulate_log("drill", motion, "low", 0, shuffled=False)[:2]
    soft = sagging(log, truth.mass)
    found, yields = sag(soft), np.linalg.eigvalsh(SOFT)
    assert found is not None
    assert found.uneven == pytest.approx(9.81 * (yields[2] - yields[0]), rel=0.3)
    wider = allow_sag(soft, estimate, ())
    assert f"sags in its grip as gravity turns, {1e3 * found.uneven:.2g} mm more" in wider.notes[-1]
    assert np.diag(wider.covariance - estimate.covariance) == pytest.approx(found.moved**2)


def test_what_it_moves_is_the_error_of_a_stiff_fit() -> None:
    log, truth = simulate_log("drill", "dyn_slow", "low", 0, shuffled=False)[:2]
    found, stiff = sag(sagging(log, truth.mass)), sag(log)
    assert found is not None
    assert stiff is not None
    # The stiff fits of both logs share their noise: what the sag adds to one is what is told of it, to a quarter.
    soft, sound = (Rows.of(each)[0].solve().solution[1:4] for each in (sagging(log, truth.mass), log))
    assert found.moved[1:4] - stiff.moved[1:4] == pytest.approx(soft - sound, abs=0.25 * np.abs(soft - sound).max())


def test_a_grip_that_yields_alike_makes_no_torque() -> None:
    log, truth = simulate_log("drill", "stop_go", "low", 0, shuffled=False)[:2]
    found = sag(sagging(log, truth.mass, 2e-4 * np.eye(3)))
    assert found is not None
    assert found.slowly > 0.9


def test_it_is_not_looked_for_in_a_wrench_that_is_no_bodys(estimate: Estimate) -> None:
    log, truth = simulate_log("drill", "stop_go", "low", 0, shuffled=False)[:2]
    known = (Finding.of("wrench-unexplained", "Known."),)
    assert allow_sag(sagging(log, truth.mass), estimate, known) is estimate
