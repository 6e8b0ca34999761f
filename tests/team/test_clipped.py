"""A robot whose force sensor runs into its limit: named, and its rows left out of the sum of forces."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from steelyard.check import Array
from steelyard.logs.team_log import TeamLog
from steelyard.pipelines.shared_payload import identify_team
from steelyard.simulate.team import simulate_team
from steelyard.simulate.team_cases import CASES, Presence, TeamNoise, TeamScene, case
from steelyard.team.lost_wrenches import without_clipped

NOISE = TeamNoise(pose_rad=3e-4, pose_m=2e-4, force_white_N=0.5, torque_white_Nm=0.02)
SCENE = TeamScene(
    NOISE, 3, sensing="poses", six_axis=frozenset(range(3)), kinds=("still", "motion"), motion_samples=2000
)
Change = Callable[[Array], Array]


def forced(log: TeamLog, change: Change, names: tuple[str, ...]) -> TeamLog:
    """Return the log with other forces of some robots."""
    recordings = []
    for recording in log.recordings:
        tracks = {
            name: replace(t, channels={**t.channels, "force": change(t.channels["force"])})
            if name in names and "force" in t.channels
            else t
            for name, t in recording.tracks.items()
        }
        recordings.append(replace(recording, tracks=tracks))
    return log.with_recordings(*recordings)


def limit(log: TeamLog, name: str, share: float) -> tuple[int, float]:
    """Return the axis of a robot's force that reaches farthest, and what it passes in `share` of the rows."""
    force = np.concatenate([r.tracks[name].channels["force"] for r in log.recordings if r.tracks[name].has("force")])
    axis = int(np.abs(force).max(0).argmax())
    return axis, float(np.quantile(np.abs(force[:, axis]), 1 - share))


def cut(axis: int, most: float) -> Change:
    def change(force: Array) -> Array:
        out = force.copy()
        out[:, axis] = np.clip(out[:, axis], -most, most)
        return out

    return change


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_force_that_was_cut_off_is_named_and_left_out(seed: int) -> None:
    trial = simulate_team(SCENE, seed)
    log = forced(trial.log, cut(*limit(trial.log, "robot1", 0.15)), ("robot1",))
    found = identify_team(log)
    told = [one for one in found.findings if one.code == "channel-saturated"]
    assert told
    assert all("of 'robot1' stops at" in one.message and "left out" in one.message for one in told)
    assert not {"contact", "wrench-unexplained", "rows-missing"} & {one.code for one in found.findings}
    truth = trial.truth.body
    assert abs(found.mass - truth.mass) < 3.5 * found.std[0]
    assert (np.abs(found.com - truth.com) < 3.5 * found.std[1:4]).all()


def test_more_clipped_rows_than_can_be_spared_are_named_only() -> None:
    trial = simulate_team(SCENE, 0)
    log = forced(trial.log, cut(*limit(trial.log, "robot1", 0.8)), ("robot1",))
    kept, found = without_clipped(log)
    assert len(found) > 0
    assert "used as they are" in found[0].message
    assert kept is log


def steps(size: float) -> Change:
    return lambda force: np.asarray(size * np.round(force / size))


@cache
def sound_logs(seed: int) -> tuple[TeamLog, ...]:
    leaves = (Presence(2, leaves=20.0),)
    scenes = [*(case(name) for name in CASES), SCENE, replace(SCENE, presence=leaves, robots=4)]
    return tuple(simulate_team(replace(scene, grasp_samples=200), seed).log for scene in scenes)


@pytest.mark.parametrize("change", [lambda force: force, steps(0.1), steps(1.0), steps(5.0)])
@pytest.mark.parametrize("seed", range(4))
def test_coarse_forces_and_robots_that_let_go_are_not_cut_off(change: Change, seed: int) -> None:
    for log in sound_logs(seed):
        assert without_clipped(forced(log, change, log.names))[1] == ()
