"""Turns of a grasp that no motion shows: level bases settle them, and where they do not, the error bars say so."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.simulate.team import TeamTrial, simulate_team
from steelyard.simulate.team_cases import CASES, STILL_TURNS, TeamNoise, TeamScene
from steelyard.simulate.team_motions import Freedom
from steelyard.spatial import Rotation
from steelyard.team.estimate import TeamEstimate
from steelyard.team.joint import JointTeam

NOISY = TeamNoise(force_white_N=0.5, pose_rad=3e-3, pose_m=1e-3)
NOISIER = replace(NOISY, pose_rad=1e-2, pose_m=3e-3)
X, Y, Z = (np.eye(3)[:, [k]] for k in range(3))
NONE = np.zeros((3, 0))
MOVING = ("grasp", "motion")


def trial(seed: int, freedom: Freedom, noise: TeamNoise = NOISY, **changes: Any) -> TeamTrial:
    scene: dict[str, Any] = {"sensing": "poses", "kinds": MOVING, "motion_samples": 2000, "freedom": freedom} | changes
    return simulate_team(TeamScene(noise, **scene), seed)


def bars_off(made: TeamTrial, found: TeamEstimate) -> Array:
    """By how many standard deviations the ten parameters are off."""
    return np.asarray(np.abs(found.parameters.vector - made.truth.body.vector) / np.sqrt(np.diag(found.covariance)))


@pytest.mark.parametrize(
    ("freedom", "noise"),
    [
        (Freedom(Y, NONE), NOISY),
        (Freedom(Y, np.eye(3)), NOISIER),
        (Freedom(Y, np.eye(3)[:, [0, 2]]), NOISIER),
        (Freedom(NONE, np.eye(3)), NOISIER),
        (Freedom(NONE, Z), NOISIER),
    ],
    ids=["pivot", "one axis", "upright plane", "no turn", "lifted"],
)
@pytest.mark.parametrize("seed", [100, 101])
def test_level_bases_settle_turns_about_level_axes(freedom: Freedom, noise: TeamNoise, seed: int) -> None:
    made = trial(seed, freedom, noise, kinds=("motion",))
    found = JointTeam().identify(made.log)
    assert abs(found.mass - 12.0) < 0.5
    assert bars_off(made, found).max() < 3.5
    assert "grasp-direction-lost" in found.codes()


@pytest.mark.parametrize(
    ("noise", "sensing", "seed"), [("A", "joints", 104), ("B", "joints", 104), ("10 mrad", "poses", 100)]
)
def test_two_still_poses_weigh_the_payload(noise: str, sensing: str, seed: int) -> None:
    size = NOISIER if noise == "10 mrad" else CASES[noise]
    made = trial(seed, Freedom.general(), size, sensing=sensing, kinds=("still",), still_turns=STILL_TURNS[:2])
    found = JointTeam().identify(made.log)
    assert abs(found.mass - 12.0) < 0.5
    assert bars_off(made, found).max() < 3.5


@pytest.mark.parametrize("seed", [100, 101])
def test_turns_about_the_vertical_alone_leave_the_answer_open(seed: int) -> None:
    turns = ((0.0, 0.0, 0.1), (0.0, 0.0, -0.1))
    still = trial(seed, Freedom.general(), CASES["A"], sensing="joints", kinds=("still",), still_turns=turns)
    moved = trial(seed, Freedom(Z, NONE), replace(NOISY, pose_rad=1e-4, pose_m=1e-4))
    for made in (still, moved):
        found = JointTeam().identify(made.log)
        assert bars_off(made, found).max() < 3.5
        assert not found.identified[1:].any()
        assert "grasp-direction-lost" in found.codes()


@pytest.mark.parametrize("moving", [True, False], ids=["moving", "standing"])
@pytest.mark.parametrize(
    ("freedom", "seed"),
    [(Freedom(Y, np.eye(3)), 101), (Freedom(Y, NONE), 100), (Freedom(Z, NONE), 100)],
    ids=["one axis", "pivot", "vertical"],
)
def test_level_sensors_settle_turns_of_teams_with_twists(freedom: Freedom, seed: int, moving: bool) -> None:
    loud = TeamNoise(force_white_N=0.5, rate_rad_s=3e-2, velocity_m_s=1e-2)
    quiet = TeamNoise(force_white_N=0.5, rate_rad_s=8e-3, velocity_m_s=2e-3)
    upright = freedom.rotation is Z
    made = trial(seed, freedom, quiet if upright else loud, sensing="twists", bases_move=moving, kinds=("motion",))
    found = JointTeam().identify(made.log)
    assert bars_off(made, found).max() < 3.5
    assert upright or abs(found.mass - 12.0) < 0.5


def test_a_mass_that_is_open_is_said_to_be() -> None:
    found = JointTeam().identify(trial(100, Freedom(Z, NONE), kinds=("motion",)).log)
    text = next(one.message for one in found.findings if one.code == "inertia-not-identified")
    assert "neither mass nor centre of mass is known: do not use them" in text


def test_bases_that_disagree_hold_no_turn() -> None:
    made = trial(100, Freedom(Y, NONE))
    tilted = replace(made.log.robots[1], gravity=np.array([9.81, 0.0, 0.0]))
    robots = (made.log.robots[0], tilted, made.log.robots[2])
    found, good = (JointTeam().identify(log) for log in (replace(made.log, robots=robots), made.log))
    assert found.grasps["robot1"].std_deg.max() > 5 * good.grasps["robot1"].std_deg.max()


@pytest.mark.parametrize(
    ("freedom", "kinds"),
    [(Freedom.general(), ("motion",)), (Freedom(X, NONE), ("motion",)), (Freedom(Z, NONE), MOVING)],
)
def test_noise_that_hides_the_mass_gives_no_mass(freedom: Freedom, kinds: tuple[str, ...]) -> None:
    loud = replace(NOISY, pose_rad=3e-2, pose_m=1e-2)
    with pytest.raises(CannotAnswer, match="motion and forces do not show the mass"):
        JointTeam().identify(trial(100, freedom, loud, kinds=kinds).log)
    found = JointTeam().identify(trial(100, Freedom.general(), loud, kinds=("still", "motion")).log)
    assert abs(found.mass - 12.0) < 3 * np.sqrt(found.covariance[0, 0])


def test_a_base_that_drifts_is_no_payload_that_did_not_turn() -> None:
    noise = TeamNoise(pose_rad=3e-4, pose_m=2e-4, force_white_N=0.5)
    log = simulate_team(TeamScene(noise, 3, sensing="poses", motion_samples=3000), 1).log
    recordings = []
    for recording in log.recordings:
        track = recording.tracks["robot1"]
        turn = Rotation.exp(np.outer(np.deg2rad(0.15) * track.time, [0.0, 0.0, 1.0])).matrix
        channels = dict(track.channels)
        channels["rotation"] = turn @ channels["rotation"]
        channels["position"] = np.einsum("tij,tj->ti", turn, channels["position"])
        recordings.append(replace(recording, tracks={**recording.tracks, "robot1": replace(track, channels=channels)}))
    found = JointTeam().identify(log.with_recordings(*recordings))
    said = [f for f in found.findings if f.code == "grasp-direction-lost"]
    assert said
    for finding in said:
        assert "which hides how the payload turned" in finding.message
        assert 'base = "moving"' in finding.remedy
