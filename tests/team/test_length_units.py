"""Millimetres in one recording of a robot beside metres in another: named, with the key that says so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from steelyard.errors import BadValue
from steelyard.logs.team_log import TeamLog
from steelyard.pipelines.shared_payload import METHODS, Method, identify_team
from steelyard.simulate.team import simulate_team
from steelyard.simulate.team_cases import CASES, TeamNoise, TeamScene
from steelyard.spatial import Pose, Rotation
from steelyard.team.misread.files import require_metres, require_one_length_unit


def made(case: str, seed: int) -> TeamLog:
    return simulate_team(TeamScene(CASES[case], motion_samples=400), seed).log


def misread(log: TeamLog, number: int, factor: float, name: str = "robot1") -> TeamLog:
    """Return the log with the positions of a robot in another unit in one recording."""
    recordings = list(log.recordings)
    track = recordings[number].tracks[name]
    channels = {q: factor * v if q == "position" else v for q, v in track.channels.items()}
    tracks = {**recordings[number].tracks, name: replace(track, channels=channels)}
    recordings[number] = replace(recordings[number], tracks=tracks)
    return log.with_recordings(*recordings)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("number", "factor"), [(0, 1e3), (1, 1e-3), (2, 1e3)])
def test_it_is_named(method: Method, number: int, factor: float) -> None:
    with pytest.raises(BadValue, match=r"positions of 'robot1' are .* Set the unit"):
        identify_team(misread(made("A", 1), number, factor), method)


def test_millimetres_of_all_robots_are_named() -> None:
    log = made("A", 1)
    for number in range(len(log.recordings)):
        for name in log.names:
            log = misread(log, number, 1e3, name)
    with pytest.raises(BadValue, match=r"come out .* m apart: lengths are not in the unit .* Set the unit"):
        identify_team(log)


@pytest.mark.parametrize("case", CASES)
def test_sound_logs_pass(case: str) -> None:
    for seed in range(3):
        require_one_length_unit(made(case, seed))


def test_robots_without_positions_pass() -> None:
    require_one_length_unit(simulate_team(TeamScene(TeamNoise(), sensing="twists", motion_samples=400), 0).log)


def test_one_robot_whose_lengths_are_off_is_named() -> None:
    places = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [700.0, 100.0, 0.0]])
    for order in ([0, 1, 2], [2, 0, 1]):
        names = tuple(f"robot{i}" for i in order)
        with pytest.raises(BadValue, match=r"the grasp of 'robot2' comes out 707 m from the others"):
            require_metres(names, Pose(Rotation.identity(3), places[order]))
