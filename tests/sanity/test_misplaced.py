"""Positions of another point than S are found, and the answer is that of S all the same."""

from __future__ import annotations

import re

import numpy as np
import pytest

from sanity.held_poses import BODY, of_the_tip, recorded
from steelyard.identify.estimate import Estimate
from steelyard.logs.log import MotionLog
from steelyard.pipelines.held_object import identify
from steelyard.pipelines.left_over import left_over, of_another_fit
from steelyard.sanity.misplaced import misplaced
from steelyard.simulate.logs import simulate_log

TIPS = [(0.0, 0.0, 0.03), (0.0, 0.05, 0.0), (0.02, -0.03, 0.1)]


def off(found: Estimate) -> float:
    """Return how many standard deviations mass, centre of mass and inertia are off at most."""
    inertia = (found.parameters.inertia_com - BODY.inertia_com)[np.triu_indices(3)]
    gap = np.concatenate([[found.mass - BODY.mass], found.com - BODY.com, inertia])
    return float(np.abs(gap / found.std).max())


@pytest.mark.parametrize("tip", TIPS)
def test_the_tip_of_a_tool_is_told_and_the_answer_holds(tip: tuple[float, float, float]) -> None:
    recording = of_the_tip(recorded("paper", 0), tip)
    found = identify(recording)
    assert [f.code for f in found.findings] == ["motion-mismatch"]
    said = re.search(r"a point \((.*?)\) ±", found.findings[0].message)
    assert said is not None
    np.testing.assert_allclose([float(v) for v in said[1].split(",")], 1e3 * np.array(tip), atol=1.5)
    assert off(found) < 3.5
    assert not of_another_fit(found, left_over(recording, found)[1])


def test_positions_of_the_sensor_are_left_alone() -> None:
    found = identify(recorded("paper", 0))
    assert found.codes() == set()
    assert off(found) < 3.5


def made(motion: str, noise: str, seed: int) -> MotionLog:
    return simulate_log("drill", motion, noise, seed, shuffled=False)[0]


@pytest.mark.parametrize("motion", ["stop_go", "dyn_slow", "dyn_fast"])
@pytest.mark.parametrize("noise", ["low", "moderate", "high"])
def test_a_sound_log_shows_no_other_point(motion: str, noise: str) -> None:
    for seed in range(3):
        found = misplaced(made(motion, noise, seed))
        assert found is not None
        assert not found.sure


def test_rows_at_rest_show_no_point() -> None:
    log = made("stop_go", "low", 0)
    assert misplaced(log.rows(log.still)) is None
