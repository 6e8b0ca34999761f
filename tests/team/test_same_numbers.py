"""Numbers that nobody measured: one file for two robots, and forces that never change."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from steelyard.errors import BadValue
from steelyard.findings import Finding
from steelyard.logs.team_log import TeamLog
from steelyard.logs.team_track import Track
from steelyard.pipelines.shared_payload import identify_team
from steelyard.simulate.team import simulate_team
from steelyard.simulate.team_cases import EXACT, case
from steelyard.team.lost_wrenches import stuck_forces


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


def test_one_file_for_two_robots_is_refused_though_torques_are_read_for_one_alone(log: TeamLog) -> None:
    track = log.recordings[-1].tracks["robot0"]
    torque = {"torque": np.ones((len(track), 3))}
    twin = replace(track, channels={**track.channels, **torque})
    with pytest.raises(BadValue, match="'robot0' and 'robot2' have the same numbers"):
        identify_team(with_track(log, -1, "robot2", twin))


def test_a_force_that_never_changes_in_motion_is_named(log: TeamLog) -> None:
    track = log.recordings[-1].tracks["robot1"]
    dead = Track(track.time, {**track.channels, "force": np.zeros((len(track), 3))}, track.valid, track.carrying)
    found = identify_team(with_track(log, len(log.recordings) - 1, "robot1", dead)).findings
    assert found[0].code == "channel-stuck"
    assert found[0].message.startswith("Force x, y, z of 'robot1' is the same in all 1000 rows of 'motion-5'")


def with_forces(log: TeamLog, name: str, axes: list[int], value: float) -> TeamLog:
    """The log with some axes of one robot's force at one value in all rows."""
    parts = []
    for part in log.recordings:
        track = part.tracks[name]
        force = track.channels["force"].copy()
        force[:, axes] = value
        dead = Track(track.time, {**track.channels, "force": force}, track.valid, track.carrying)
        parts.append(replace(part, tracks={**part.tracks, name: dead}))
    return log.with_recordings(*parts)


def stuck(log: TeamLog) -> list[Finding]:
    return [one for one in stuck_forces(log) if one.code == "channel-stuck"]


@pytest.mark.parametrize("case_name", ["A", "D"])
@pytest.mark.parametrize(("axes", "words"), [([0, 1, 2], "x, y, z"), ([2], "z"), ([0], "x")])
@pytest.mark.parametrize("value", [0.0, 7.25])
def test_a_force_that_is_dead_in_all_poses_at_rest_is_named(
    case_name: str, axes: list[int], words: str, value: float
) -> None:
    log = simulate_team(replace(case(case_name), kinds=("still",)), 100).log
    (found,) = stuck(with_forces(log, "robot1", axes, value))
    assert found.message.startswith(f"Force {words} of 'robot1' is the same in all 400 rows of all 4 poses at rest. ")
    assert "'robot1'" in found.remedy


def test_a_dead_force_is_named_once_with_all_its_recordings(log: TeamLog) -> None:
    found = identify_team(with_forces(log, "robot2", [0, 1, 2], 0.0)).findings
    (one,) = [one for one in found if one.code == "channel-stuck"]
    where = "all 2400 rows of 'grasp-0' and 'motion-5' and all 4 poses at rest."
    assert one.message.startswith(f"Force x, y, z of 'robot2' is the same in {where}")
    assert "record again" in one.remedy


def test_forces_that_do_not_move_at_rest_are_not_called_stuck() -> None:
    exact = simulate_team(replace(case("A"), noise=EXACT, kinds=("still",), still_turns=((0.1, 0.0, 0.0),)), 100).log
    assert not stuck(exact)
    coarse = simulate_team(replace(case("A"), kinds=("still",)), 100).log
    parts = []
    for part in coarse.recordings:
        tracks = {
            n: Track(t.time, {**t.channels, "force": 20 * np.round(t.channels["force"] / 20)}, t.valid, t.carrying)
            for n, t in part.tracks.items()
        }
        parts.append(replace(part, tracks=tracks))
    assert not stuck(coarse.with_recordings(*parts))


def test_a_robot_that_says_it_holds_nothing_is_not_called_stuck(log: TeamLog) -> None:
    dead = with_forces(log, "robot1", [0, 1, 2], 0.0)
    parts = []
    for part in dead.recordings:
        t = part.tracks["robot1"]
        idle = Track(t.time, t.channels, t.valid, np.zeros(len(t), np.bool_))
        parts.append(replace(part, tracks={**part.tracks, "robot1": idle}))
    assert not stuck(dead.with_recordings(*parts))


@pytest.mark.parametrize("name", ["A", "B", "C", "D"])
def test_noisy_logs_have_no_stuck_force(name: str) -> None:
    for seed in range(100, 103):
        assert not stuck(simulate_team(replace(case(name), motion_samples=300), seed).log)


def test_good_logs_raise_nothing(log: TeamLog) -> None:
    assert not [f for f in identify_team(log).findings if f.code == "channel-stuck"]
