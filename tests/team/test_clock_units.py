"""Milliseconds of one robot beside seconds of the others are named, and a mass below its bar is no answer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from steelyard.errors import BadValue, CannotAnswer
from steelyard.logs.team_log import TeamLog, TeamRecording, Track
from steelyard.pipelines import shared_payload
from steelyard.simulate.team import simulate_team
from steelyard.simulate.team_cases import CASES, TeamScene
from steelyard.team.joint import JointTeam


def tracks(factors: Mapping[str, float], begin: float = 3.0) -> dict[str, Track]:
    """Ten seconds at 100 Hz of every robot, in units of its own."""
    time, turns = begin + 0.01 * np.arange(1000), np.tile(np.eye(3), (1000, 1, 1))
    return {name: Track.of(factor * time, rotation=turns) for name, factor in factors.items()}


@pytest.mark.parametrize("factor", [1e3, 1e6, 1e-3])
@pytest.mark.parametrize("begin", [0.0, 3.0])
def test_the_robot_is_named_that_the_others_do_not_go_with(factor: float, begin: float) -> None:
    with pytest.raises(BadValue, match=r"in 'run' the rows of .* the time of 'b' is not in the unit .* Set the unit"):
        TeamRecording("motion", tracks({"a": 1.0, "b": factor, "c": 1.0}, begin), "run")


def test_of_two_robots_it_is_one() -> None:
    TeamRecording("motion", tracks({"a": 1.0, "b": 1.0}), "run")
    with pytest.raises(BadValue, match="the time of one of them is not in the unit"):
        TeamRecording("motion", tracks({"a": 1.0, "b": 1e3}), "run")


def test_a_slow_logger_and_a_long_recording_pass() -> None:
    made = tracks({"a": 1.0, "b": 1.0, "c": 1.0})
    slow, long = 3.0 + 2.0 * np.arange(5), 0.01 * np.arange(200_000)
    made["b"] = Track.of(slow, rotation=np.tile(np.eye(3), (5, 1, 1)))
    made["c"] = Track.of(long, rotation=np.tile(np.eye(3), (len(long), 1, 1)))
    TeamRecording("motion", made, "run")


@pytest.mark.parametrize(("rows", "step"), [(600, 1e-3), (2, 5e-4)])
def test_a_short_burst_beside_a_slow_logger_passes(rows: int, step: float) -> None:
    made = tracks({"a": 1.0, "b": 1.0})
    made["a"] = Track.of(0.1 * np.arange(600), rotation=np.tile(np.eye(3), (600, 1, 1)))
    made["b"] = Track.of(30 + step * np.arange(rows), rotation=np.tile(np.eye(3), (rows, 1, 1)))
    TeamRecording("motion", made, "run")


def test_a_mass_that_is_less_than_its_bar_is_no_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    log = simulate_team(TeamScene(CASES["A"], motion_samples=400), 0).log
    found = JointTeam().identify(log)

    class Open:
        def identify(self, log: TeamLog) -> object:
            return replace(found, covariance=found.covariance * (1.1 * found.mass / found.std[0]) ** 2)

    monkeypatch.setattr(shared_payload, "ESTIMATORS", {"joint": Open()})
    with pytest.raises(CannotAnswer, match=r"the data do not tell the mass: .* kg, with a standard deviation of"):
        shared_payload.identify_team(log)
