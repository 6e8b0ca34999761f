"""A grasp that slips while nobody records is named and put right; recordings that differ by noise are no slip."""

from __future__ import annotations

import numpy as np
import pytest

from steelyard.simulate.team import TeamTrial, simulate_team
from steelyard.simulate.team_cases import CASES, Slip, TeamScene
from steelyard.team.estimate import TeamEstimate
from steelyard.team.joint import JointTeam


def trial(case: str, seed: int, slip: Slip | None = None) -> TeamTrial:
    return simulate_team(TeamScene(CASES[case], slip=slip, motion_samples=2000), seed)


def off(found: TeamEstimate, made: TeamTrial) -> tuple[float, float]:
    """Return by how many bars the grasps and the centre of mass are off (rms)."""
    grasps = [
        (found.grasps[name].pose.position - made.truth.grasps.position[i]) / found.grasps[name].std_m
        for i, name in enumerate(made.log.names)
        if i
    ]
    com = (found.com - made.truth.body.com) / found.std[1:4]
    return float(np.sqrt(np.mean(np.square(grasps)))), float(np.sqrt(np.mean(com**2)))


@pytest.mark.parametrize("case", CASES)
def test_a_slip_before_a_recording_is_named_and_put_right(case: str) -> None:
    change = np.array([0.0, -0.003, 0.004])
    sound = trial(case, 100)
    usual = max(off(JointTeam().identify(sound.log), sound))
    for robot in (0, 1):
        # Before the recording's first sample: in it, the grasp is where it is.
        made = trial(case, 100, Slip(robot, change, -1.0))
        found = JointTeam().identify(made.log)
        (said,) = (f for f in found.findings if f.code == "grasp-slipped")
        assert said.message.startswith(f"The grasp of 'robot{robot}' slipped by ")
        assert "between 'still-4' and 'motion-5'" in said.message
        assert float(said.message.split(" by ")[1].split(" mm")[0]) == pytest.approx(5.0, abs=0.5)
        assert max(off(found, made)) < max(1.5 * usual, 2.5)


def test_a_slip_that_is_far_beyond_noise_is_one_among_many_robots() -> None:
    """One robot in four disagrees, and no other is better off without what it says."""
    slip = Slip(1, np.array([0.001, -0.006, 0.004]), -1.0)
    scene = TeamScene(CASES["A"], 4, slip=slip, kinds=("grasp", "motion"), motion_samples=2000)
    made = simulate_team(scene, 6561)
    found = JointTeam().identify(made.log)
    assert "grasp-slipped" in found.codes()
    assert "robot-excluded" not in found.codes()
    assert off(found, made)[0] < 2.5


@pytest.mark.parametrize("case", CASES)
def test_noise_is_no_slip(case: str) -> None:
    for seed in range(40, 44):
        assert "grasp-slipped" not in JointTeam().identify(trial(case, seed).log).codes()
