"""Moments about another point than the grasp whose pose is logged: found, named and taken to the grasps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from steelyard.check import Array
from steelyard.logs.team_log import TeamLog
from steelyard.simulate.team import TeamTrial, simulate_team
from steelyard.simulate.team_cases import TeamNoise, TeamScene
from steelyard.team.estimate import TeamEstimate
from steelyard.team.joint import JointTeam
from steelyard.team.misread.readings import as_taken

ARMS = TeamNoise(force_white_N=0.3, torque_white_Nm=0.02, pose_rad=2e-4, pose_m=1e-4)
BIASED = replace(ARMS, force_bias_N=0.3, torque_bias_Nm=0.03)
BEHIND = np.array([0.0, 0.0, -0.08])


def team(robots: int, seed: int, noise: TeamNoise = ARMS) -> TeamTrial:
    """Arms that hold the payload still, then move it."""
    scene = TeamScene(
        noise, robots, "poses", frozenset(range(robots)), kinds=("still", "motion"), motion_samples=2500, squeeze_N=10.0
    )
    return simulate_team(scene, seed)


def about(log: TeamLog, places: Mapping[str, Array]) -> TeamLog:
    """The log with moments of some robots about these places of their grasps."""

    def moved(name: str, channels: Mapping[str, Array]) -> dict[str, Array]:
        torque = channels["torque"] - np.cross(places[name], channels["force"])
        return {**channels, "torque": torque}

    return log.with_recordings(
        *(
            replace(
                r,
                tracks={
                    n: replace(t, channels=moved(n, t.channels)) if n in places else t for n, t in r.tracks.items()
                },
            )
            for r in log.recordings
        )
    )


def off(found: TeamEstimate, trial: TeamTrial) -> Array:
    """Errors of mass and centre of mass (4,) in standard deviations."""
    error = np.append(found.mass, found.com) - np.append(trial.truth.body.mass, trial.truth.body.com)
    return np.asarray(error / found.std[:4])


@pytest.mark.parametrize("noise", [ARMS, BIASED])
@pytest.mark.parametrize("robots", [2, 3])
@pytest.mark.parametrize("alike", [True, False])
def test_they_are_taken_to_the_grasps(robots: int, alike: bool, noise: TeamNoise) -> None:
    trial = team(robots, 5 + robots, noise)
    whose = trial.log.names if alike else trial.log.names[-1:]
    found = JointTeam().identify(about(trial.log, dict.fromkeys(whose, BEHIND)))
    (said,) = (f.message for f in found.findings if f.code == "motion-mismatch")
    assert set(found.wrench_maps) == set(whose)
    assert all(f"'{name}'" in said for name in whose)
    for taken in found.wrench_maps.values():
        assert taken[:3, 3:] == pytest.approx(np.cross(BEHIND, np.eye(3)).T, abs=3e-3)
    assert np.abs(off(found, trial)).max() < 4
    assert np.linalg.norm(found.com - trial.truth.body.com) < 5e-3


def test_a_place_far_away_is_no_riddle() -> None:
    """Moments of a sensor 35 cm before the grasp had been left unexplained."""
    trial = team(3, 3)
    found = JointTeam().identify(about(trial.log, {"robot1": np.array([0.0, 0.0, 0.35])}))
    assert found.codes() == {"motion-mismatch"}
    assert np.abs(off(found, trial)).max() < 4


def test_sound_moments_are_left() -> None:
    trial = team(3, 1)
    found = JointTeam().identify(trial.log)
    assert not found.wrench_maps
    assert "motion-mismatch" not in found.codes()


def test_slow_noise_of_forces_is_no_place() -> None:
    noise = TeamNoise(force_white_N=1.0, torque_white_Nm=0.1, pose_rad=3e-4, pose_m=2e-4, force_spectrum="2hz")
    trial = simulate_team(TeamScene(noise, 4, "poses", frozenset(range(4)), motion_samples=3000, squeeze_N=2.0), 50075)
    found = JointTeam().identify(trial.log)
    assert not found.codes()
    assert np.abs(off(found, trial)).max() < 3


def test_the_report_draws_moments_as_they_were_taken() -> None:
    trial = team(2, 3)
    name = trial.log.names[1]
    log = about(trial.log, {name: BEHIND})
    taken = np.eye(6)
    taken[:3, 3:] = np.cross(BEHIND, np.eye(3)).T
    back = as_taken(log, {name: taken})
    for given, seen in zip(trial.log.recordings, back.recordings, strict=True):
        channels = given.tracks[name].channels, seen.tracks[name].channels
        assert channels[1]["torque"] == pytest.approx(channels[0]["torque"], abs=1e-12)
        assert np.array_equal(channels[1]["force"], channels[0]["force"])


def test_a_few_words_say_from_where() -> None:
    trial = team(2, 3)
    name = trial.log.names[1]
    found = JointTeam().identify(about(trial.log, {name: BEHIND}))
    assert found.wrenches_taken[name].startswith("torque from (")
