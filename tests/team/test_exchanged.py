"""Files of two robots that stand in each other's place in one recording are named; nothing else is."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import made_teams
import numpy as np
import pytest

from steelyard.errors import BadValue
from steelyard.logs.team_log import TeamLog
from steelyard.simulate.team import simulate_team
from steelyard.simulate.team_cases import CASES, TeamScene
from steelyard.team.joint import JointTeam
from steelyard.team.misread.poses import require_own_files

trial = partial(made_teams.trial, kinds=made_teams.ALL_KINDS, motion_samples=1200, grasp_samples=600)


def exchanged(log: TeamLog, number: int, first: str, second: str) -> TeamLog:
    recordings = list(log.recordings)
    tracks = dict(recordings[number].tracks)
    tracks[first], tracks[second] = tracks[second], tracks[first]
    recordings[number] = replace(recordings[number], tracks=tracks)
    return log.with_recordings(*recordings)


@pytest.mark.parametrize(
    ("number", "pair"), [(0, ("robot0", "robot1")), (1, ("robot1", "robot2")), (5, ("robot0", "robot2"))]
)
def test_an_exchange_is_named_with_robots_and_recording(number: int, pair: tuple[str, str]) -> None:
    made = trial(late_s={1: 0.013})
    log = exchanged(made.log, number, *pair)
    said = f"the files of '{pair[0]}' and '{pair[1]}' look exchanged in '{log.recordings[number].name}': "
    with pytest.raises(BadValue, match=said):
        JointTeam().identify(log)


def test_of_two_recordings_either_may_be_wrong() -> None:
    log = exchanged(trial(kinds=("grasp", "motion")).log, 1, "robot0", "robot1")
    with pytest.raises(BadValue, match=r"exchanged in 'grasp-0' or 'motion-1': .* Exchange their \"path\" there"):
        JointTeam().identify(log)


def test_exchanged_throughout_is_another_name() -> None:
    log = trial(kinds=("motion",)).log
    require_own_files(exchanged(log, 0, "robot0", "robot1"))


@pytest.mark.parametrize("case", ["A", "D"])
def test_good_logs_pass(case: str) -> None:
    require_own_files(simulate_team(TeamScene(CASES[case], grasp_samples=300, motion_samples=600), 3).log)


def test_other_disagreement_is_left_to_its_own_finding() -> None:
    require_own_files(trial(robots=4, hinge=made_teams.HINGE, kinds=("still", "motion")).log)
    made = trial()
    *others, last = made.log.recordings
    track = last.tracks["robot2"]
    shaken = track.channels["position"] + np.random.default_rng(0).normal(0, 0.05, (len(track), 3))
    worse = replace(track, channels={**track.channels, "position": shaken})
    require_own_files(made.log.with_recordings(*others, replace(last, tracks={**last.tracks, "robot2": worse})))
