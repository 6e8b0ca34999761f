"""What a body leaves of the wrench does not follow the motion, unless joints moved otherwise than poses say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from steelyard.findings import Finding
from steelyard.logs.log import MotionLog
from steelyard.sanity.fitted.load_motion import examine_motion
from steelyard.simulate.logs import simulate_log


def made(motion: str, noise: str = "low", seed: int = 0, tool: str = "drill") -> MotionLog:
    return simulate_log(tool, motion, noise, seed, shuffled=False)[0]


def codes(log: MotionLog, *known: str) -> list[str]:
    return [f.code for f in examine_motion(log, tuple(Finding.of(code, "Known.") for code in known))]


def one_joint_harder(log: MotionLog, times: float) -> MotionLog:
    """Return the log of a wrench in which turns about z of S were accelerated so many times as much."""
    harder = replace(log, angular_acceleration=log.angular_acceleration * np.array([1.0, 1.0, times]))
    body = simulate_log("drill", "stop_go", "low", 0, shuffled=False)[1]
    return replace(log, wrench=log.wrench + harder.predicted(body.vector) - log.predicted(body.vector))


@pytest.mark.parametrize("motion", ["stop_go", "dyn_slow", "dyn_fast"])
@pytest.mark.parametrize("noise", ["low", "moderate", "high"])
@pytest.mark.parametrize("seed", range(3))
def test_a_sound_log_is_silent(motion: str, noise: str, seed: int) -> None:
    for tool in ("drill", "screwdriver"):
        assert codes(made(motion, noise, seed, tool)) == []


def test_a_joint_that_was_accelerated_more_than_poses_say() -> None:
    assert codes(one_joint_harder(made("stop_go"), 4.0)) == ["motion-mismatch"]


def test_a_little_more_is_not_told() -> None:
    assert codes(one_joint_harder(made("stop_go"), 1.02)) == []


@pytest.mark.parametrize("code", ["motion-mismatch", "weight-compensated", "sensor-turned"])
def test_what_another_finding_explains_is_told_once(code: str) -> None:
    assert codes(one_joint_harder(made("stop_go"), 4.0), code) == []
