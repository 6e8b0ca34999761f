"""A hand that pushes the payload for a while is named, and what robots measured meanwhile is left out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from steelyard.logs.team_log import TeamLog
from steelyard.simulate.team import TeamTrial, simulate_team
from steelyard.simulate.team_cases import CASES, TeamNoise, TeamScene, case
from steelyard.team.estimate import TeamEstimate
from steelyard.team.joint import JointTeam

PUSH = np.array([12.0, -6.0, 8.0])


def pushed(trial: TeamTrial, number: int, starts: tuple[float, ...], seconds: float, force: np.ndarray) -> TeamLog:
    """The log with a hand that pushes in one recording with up to `force` (3,) [N] in R; all robots give way alike."""
    log = trial.log
    recording, count = log.recordings[number], len(log.names)
    tracks = {}
    for name, turn in zip(log.names, trial.truth.grasps.rotation.matrix, strict=True):
        track = recording.tracks[name]
        since = track.time[:, None] - track.time[0] - np.array(starts)
        size = np.where((since > 0) & (since < seconds), np.sin(np.pi * since / seconds) ** 2, 0.0).sum(1)
        felt = track.channels["force"] - size[:, None] * (turn.T @ force) / count
        tracks[name] = replace(track, channels={**track.channels, "force": felt})
    every = [replace(recording, tracks=tracks) if k == number else r for k, r in enumerate(log.recordings)]
    return log.with_recordings(*every)


def worst(found: TeamEstimate, trial: TeamTrial) -> float:
    error = np.append(found.mass, found.com) - np.append(trial.truth.body.mass, trial.truth.body.com)
    return float(np.abs(error / found.std[:4]).max())


@pytest.mark.parametrize("name", ["B", "C"])
def test_pushes_in_motion_are_named_and_left_out(name: str) -> None:
    trial = simulate_team(replace(case(name), motion_samples=3000), 3)
    found = JointTeam().identify(pushed(trial, -1 % len(trial.log.recordings), (6.0, 17.0), 2.0, PUSH))
    (said,) = (f.message for f in found.findings if f.code == "contact")
    assert f"of '{trial.log.recordings[-1].name}' robots push up to " in said
    assert float(said.split("For ")[1].split(" s of")[0]) == pytest.approx(6.5, abs=2.0)
    assert float(said.split("up to ")[1].split(" N")[0]) == pytest.approx(np.linalg.norm(PUSH), rel=0.3)
    assert "wrench-unexplained" not in found.codes()
    right = JointTeam().identify(trial.log)
    assert worst(found, trial) < 4
    assert (found.std[:4] < 1.6 * right.std[:4]).all()


def test_a_recording_that_a_hand_moves_throughout_is_not_weighed() -> None:
    trial = simulate_team(replace(case("C"), motion_samples=3000), 5)
    starts = tuple(np.arange(0.2, 9.5, 1.2))
    found = JointTeam().identify(pushed(trial, 0, starts, 1.8, 1.5 * PUSH))
    assert "contact" in found.codes()
    assert "wrench-unexplained" not in found.codes()
    assert worst(found, trial) < 4


def test_what_is_usual_is_told_by_other_recordings_where_a_hand_pushes_most_of_one() -> None:
    trial = simulate_team(replace(case("C"), motion_samples=3000), 3)
    starts = tuple(np.arange(0.2, 18.0, 1.2))
    found = JointTeam().identify(pushed(trial, len(trial.log.recordings) - 1, starts, 1.8, 1.5 * PUSH))
    assert found.codes() == {"contact"}
    assert worst(found, trial) < 4


@pytest.mark.parametrize(("robots", "seed", "share"), [(2, 0, 0.3), (2, 1, 0.6), (3, 1, 0.3), (3, 2, 0.6)])
def test_a_hand_is_no_sign_that_is_wrong(robots: int, seed: int, share: float) -> None:
    """Where robots push little against one another a hand in a tenth of the log fits another sign of one better."""
    noise = TeamNoise(pose_rad=3e-4, pose_m=2e-4, force_white_N=0.3, torque_white_Nm=0.02)
    six_axis = frozenset(range(robots))
    scene = TeamScene(noise, robots, sensing="poses", six_axis=six_axis, kinds=("motion",), motion_samples=3000)
    trial = simulate_team(replace(scene, squeeze_N=1.0), seed)
    force = share * 9.81 * trial.truth.body.mass * np.array([0.8, 0.3, -0.5])
    found = JointTeam().identify(pushed(trial, 0, (12.0,), 3.0, force))
    assert found.codes() == {"contact"}
    assert worst(found, trial) < 4


def test_a_hand_is_found_beside_forces_that_are_misread() -> None:
    trial = simulate_team(replace(case("C"), motion_samples=3000), 4)
    log = pushed(trial, len(trial.log.recordings) - 1, (6.0, 17.0), 2.0, PUSH)
    mixed = []
    for recording in log.recordings:
        track = recording.tracks["robot1"]
        channels = {**track.channels, "force": track.channels["force"][:, [1, 0, 2]]}
        mixed.append(replace(recording, tracks={**recording.tracks, "robot1": replace(track, channels=channels)}))
    found, right = (JointTeam().identify(one) for one in (log.with_recordings(*mixed), log))
    assert found.codes() == {"contact", "force-unit"}
    np.testing.assert_allclose(found.std, right.std, rtol=1e-4)


def test_what_is_needed_of_one_recording_is_not_left_out() -> None:
    trial = simulate_team(TeamScene(CASES["C"], kinds=("still", "motion"), motion_samples=1500), 5)
    starts = tuple(np.arange(0.2, 14.5, 1.2))
    found = JointTeam().identify(pushed(trial, -1 % len(trial.log.recordings), starts, 1.8, 1.5 * PUSH))
    assert "contact" not in found.codes()
    assert "wrench-unexplained" in found.codes()


@pytest.mark.parametrize("name", ["A", "C", "D"])
def test_sound_logs_are_not_touched(name: str) -> None:
    for seed in range(3):
        assert "contact" not in JointTeam().identify(simulate_team(case(name), seed).log).codes()
