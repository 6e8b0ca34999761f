"""One robot's gain, or sign, that no squeeze shows: named with bars that hold it; sound teams keep their answers."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from steelyard.check import Array
from steelyard.logs.team_log import TeamLog
from steelyard.simulate.team import TeamTrial, simulate_team
from steelyard.simulate.team_cases import TeamNoise, TeamScene
from steelyard.team.estimate import TeamEstimate
from steelyard.team.joint import JointTeam

QUIET = TeamNoise(pose_rad=3e-4, pose_m=2e-4, force_white_N=0.3, torque_white_Nm=0.03)
SLOW = replace(QUIET, force_white_N=1.0, force_spectrum="2hz")


def team(seed: int, noise: TeamNoise = QUIET, **scene: Any) -> TeamTrial:
    kinds = {"kinds": ("still", "motion"), "squeeze_N": 0.0, "motion_samples": 2000, **scene}
    return simulate_team(TeamScene(noise, sensing="poses", **kinds), seed)


def with_gain(log: TeamLog, name: str, times: float) -> TeamLog:
    recordings = []
    for one in log.recordings:
        track = one.tracks[name]
        channels = {c: times * v if c in {"force", "torque"} else v for c, v in track.channels.items()}
        recordings.append(replace(one, tracks={**one.tracks, name: replace(track, channels=channels)}))
    return replace(log, recordings=tuple(recordings))


def bars_off(found: TeamEstimate, made: TeamTrial) -> Array:
    """Return by how many bars mass and centre of mass are off (4,)."""
    return np.abs(found.parameters.people - made.truth.body.people)[:4] / found.std[:4]


def named(found: TeamEstimate) -> str:
    (message,) = (one.message for one in found.findings if one.code in {"common-gain-unseen", "wrench-unexplained"})
    return message


@pytest.mark.parametrize(
    ("factor", "scene"),
    [
        *((f, {}) for f in (0.85, 1.15, -1.0)),
        *((f, {"six_axis": frozenset(range(4)), "robots": 4}) for f in (0.85, 1.15)),
    ],
)
def test_a_gain_without_squeeze_is_named_and_in_the_bars(factor: float, scene: dict[str, Any]) -> None:
    made = team(31, **scene)
    found = JointTeam().identify(with_gain(made.log, "robot1", factor))
    if "wrench-sign-flipped" not in found.codes():  # which puts it right
        assert "'robot1'" in named(found)
    assert bars_off(found, made).max() < 3.0


def test_of_two_robots_both_are_named() -> None:
    made = team(32, robots=2, six_axis=frozenset({0, 1}))
    found = JointTeam().identify(with_gain(made.log, "robot0", 1.15))
    assert {"'robot0'", "'robot1'"} <= {word.strip(",.") for word in named(found).split()}
    assert bars_off(found, made).max() < 3.0


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("loud", [False, True])
def test_sound_teams_keep_their_answers(seed: int, loud: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    made = team(40 + seed, SLOW, robots=2 + seed, six_axis=frozenset(range(2 + seed)) if seed < 2 else frozenset())
    log = made.log
    if loud:
        log = with_slow_noise(log, "robot1", seed)
    found = JointTeam().identify(log)
    monkeypatch.setattr("steelyard.team.weighed.own_gain", lambda *_: None)
    before = JointTeam().identify(log)
    assert found.codes() == before.codes()
    assert np.array_equal(found.parameters.vector, before.parameters.vector)
    assert np.array_equal(found.covariance, before.covariance)


def with_slow_noise(log: TeamLog, name: str, seed: int) -> TeamLog:
    """Return the log with noise of 1 N below 0.5 Hz on one robot's forces."""
    rng, recordings = np.random.default_rng(seed), []
    for one in log.recordings:
        track = one.tracks[name]
        force = track.channels["force"]
        rows = np.arange(0, len(force) + 100, 100)
        knots = rng.normal(size=(len(rows), 3))
        slow = np.stack([np.interp(np.arange(len(force)), rows, axis) for axis in knots.T], axis=1)
        channels = {**track.channels, "force": force + slow}
        recordings.append(replace(one, tracks={**one.tracks, name: replace(track, channels=channels)}))
    return replace(log, recordings=tuple(recordings))
