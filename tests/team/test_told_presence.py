"""What a robot does while it says that it holds nothing is not the payload's motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_teams import NOISY, NOISY_TWISTS

from steelyard.logs.team_log import TeamLog
from steelyard.pipelines.shared_payload import METHODS, Method, identify_team
from steelyard.simulate.team import TeamTrial, simulate_team
from steelyard.simulate.team_cases import Presence, TeamScene

LEAVES = 6.0


def made(who: int, sensing: str) -> TeamTrial:
    noise = NOISY if sensing == "poses" else NOISY_TWISTS
    usual = {"sensing": sensing, "bases_move": sensing == "twists", "motion_samples": 1500}
    return simulate_team(TeamScene(noise, 4, presence=(Presence(who, leaves=LEAVES),), **usual), 0)


def told(log: TeamLog, name: str) -> TeamLog:
    """The log with a robot that says in the motion when it holds the payload."""
    last = log.recordings[-1]
    track = last.tracks[name]
    says = replace(track, carrying=track.time - track.time[0] < LEAVES)
    return log.with_recordings(*log.recordings[:-1], replace(last, tracks={**last.tracks, name: says}))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("who", "sensing"), [(2, "poses"), (0, "poses"), (2, "twists")])
def test_who_says_that_he_left_bends_nothing(who: int, sensing: str, method: Method) -> None:
    trial = made(who, sensing)
    found = identify_team(told(trial.log, f"robot{who}"), method)
    assert not found.codes()
    error = np.append(found.mass, found.com) - np.append(trial.truth.body.mass, trial.truth.body.com)
    assert np.abs(error / found.std[:4]).max() < 4
    gap, _ = found.away_from(dict(zip(trial.log.names, trial.truth.grasps, strict=True)))
    assert gap < 1.0


def test_poses_of_a_robot_that_was_away_say_nothing() -> None:
    log = made(2, "poses").log
    last = log.recordings[-1]
    away = replace(last, away=frozenset({"robot2"}))
    left = log.with_recordings(*log.recordings[:-1], away).while_holding()
    seen = left.recordings[-1].tracks["robot2"]
    assert not seen.has("rotation")
    assert seen.has("force")
    assert left.recordings[:-1] == log.recordings[:-1]
