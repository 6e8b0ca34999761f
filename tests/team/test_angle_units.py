"""Degrees of one robot beside radians of another: named, with the keys that say so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_teams import NOISY_TWISTS, trial
from scipy.spatial.transform import Rotation as Turn

from steelyard.errors import BadValue
from steelyard.logs.team_log import TeamLog
from steelyard.logs.team_track import Track
from steelyard.pipelines.shared_payload import METHODS, Method, identify_team
from steelyard.simulate.team import simulate_team
from steelyard.simulate.team_cases import CASES, TeamScene
from steelyard.spatial import Rotation
from steelyard.team.misread.files import require_one_angle_unit


def scaled(track: Track, factor: float) -> Track:
    """Return the track with roll, pitch and yaw, or rates, read in another unit."""
    channels = dict(track.channels)
    angles = Turn.from_matrix(channels["rotation"].copy()).as_euler("xyz")
    channels["rotation"] = Turn.from_euler("xyz", factor * angles).as_matrix()
    if "angular_velocity" in channels:
        channels["angular_velocity"] = factor * channels["angular_velocity"]
    return replace(track, channels=channels)


def misread(log: TeamLog, name: str, factor: float) -> TeamLog:
    *others, last = log.recordings
    return log.with_recordings(*others, replace(last, tracks={**last.tracks, name: scaled(last.tracks[name], factor)}))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("factor", "said"),
    [(180 / np.pi, "faster than .*degrees read as radians"), (np.pi / 180, "slower than .*radians read as degrees")],
)
def test_one_robot_in_another_unit_is_named(method: Method, factor: float, said: str) -> None:
    for robots, sensing in ((3, "poses"), (4, "poses"), (3, "twists")):
        log = misread(trial(NOISY_TWISTS, 102, robots=robots, sensing=sensing).log, "robot1", factor)
        with pytest.raises(BadValue, match=rf"'robot1' turns \d+ times {said}. Set the unit"):
            identify_team(log, method)


def test_of_two_robots_either_may_be_wrong() -> None:
    log = misread(trial(NOISY_TWISTS, 102, robots=2).log, "robot1", np.pi / 180)
    with pytest.raises(BadValue, match="or that of the other robot"):
        require_one_angle_unit(log)


@pytest.mark.parametrize("case", CASES)
def test_good_logs_pass(case: str) -> None:
    for seed in range(100, 104):
        require_one_angle_unit(simulate_team(TeamScene(CASES[case], motion_samples=600), seed).log)


def test_what_turns_slower_but_not_in_step_is_left_to_the_fit() -> None:
    log = trial(NOISY_TWISTS, 102).log
    *others, last = log.recordings
    track = last.tracks["robot1"]
    shaken = Rotation.exp(3e-5 * np.random.default_rng(0).normal(size=(len(track), 3))).matrix
    stuck = replace(track, channels={**track.channels, "rotation": track.channels["rotation"][0] @ shaken})
    require_one_angle_unit(log.with_recordings(*others, replace(last, tracks={**last.tracks, "robot1": stuck})))


def test_short_recordings_and_lonely_robots_are_not_judged() -> None:
    log = misread(trial(NOISY_TWISTS, 102).log, "robot1", np.pi / 180)
    *_, last = log.recordings
    short = replace(last, tracks={n: t.rows(slice(0, 150)) for n, t in last.tracks.items()})
    alone = replace(last, tracks={"robot1": last.tracks["robot1"]})
    unturned = replace(last, tracks={n: t.without("rotation") for n, t in last.tracks.items()})
    for recording in (short, alone, unturned):
        require_one_angle_unit(log.with_recordings(log.recordings[0], recording, replace(last, kind="still")))
