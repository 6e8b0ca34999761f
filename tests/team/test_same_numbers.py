"""Numbers that nobody measured: one file for two robots, and forces that never change."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from steelyard.errors import BadValue
from steelyard.logs.team_log import TeamLog
from steelyard.logs.team_track import Track
from steelyard.pipelines.shared_payload import identify_team
from steelyard.simulate.team import simulate_team
from steelyard.simulate.team_cases import case


@pytest.fixture(scope="module")
def log() -> TeamLog:
    return simulate_team(replace(case("A"), motion_samples=1000), 7).log


def with_track(log: TeamLog, number: int, name: str, track: Track) -> TeamLog:
    parts = list(log.recordings)
    parts[number] = replace(parts[number], tracks={**parts[number].tracks, name: track})
    return log.with_recordings(*parts)


@pytest.mark.parametrize("number", [1, -1])
def test_one_file_for_two_robots_is_refused(log: TeamLog, number: int) -> None:
    doubled = with_track(log, number, "robot2", log.recordings[number].tracks["robot0"])
    name = log.recordings[number].name
    with pytest.raises(BadValue, match=f"'robot0' and 'robot2' have the same numbers in '{name}'"):
        identify_team(doubled)


def test_a_force_that_never_changes_in_motion_is_named(log: TeamLog) -> None:
    track = log.recordings[-1].tracks["robot1"]
    dead = Track(track.time, {**track.channels, "force": np.zeros((len(track), 3))}, track.valid, track.carrying)
    found = identify_team(with_track(log, len(log.recordings) - 1, "robot1", dead)).findings
    assert found[0].code == "channel-stuck"
    assert found[0].message.startswith("Force x, y, z of 'robot1' is the same in all 1000 rows of 'motion-5'")


def test_good_logs_raise_nothing(log: TeamLog) -> None:
    assert not [f for f in identify_team(log).findings if f.code == "channel-stuck"]
