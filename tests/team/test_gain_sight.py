"""What the changes of forces say of their gains: sizes that they rule out are in no bar, those that they show are."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from steelyard.simulate.team import TeamTrial, simulate_team
from steelyard.simulate.team_cases import TeamNoise, TeamScene
from steelyard.team.joint import JointTeam
from steelyard.team.payload.gain_sight import GainSight

QUIET = TeamNoise(pose_rad=3e-4, pose_m=2e-4, force_white_N=0.2, torque_white_Nm=0.02)


def motion(noise: TeamNoise, seed: int, **changes: Any) -> TeamTrial:
    """Return one recording of a motion, by three robots unless said otherwise."""
    scene: dict[str, Any] = {"sensing": "poses", "kinds": ("motion",), "motion_samples": 3000} | changes
    return simulate_team(TeamScene(noise, **scene), seed)


def test_bars_hold_no_gain_error_that_a_motion_rules_out() -> None:
    noise = TeamNoise(pose_rad=1e-4, pose_m=1e-4, force_white_N=0.2, torque_white_Nm=0.02, force_bias_N=2.0)
    log = motion(noise, 3, robots=2, six_axis=frozenset({0, 1}), motion_samples=4000).log
    asked, without = JointTeam().identify(log), JointTeam(gains=False).identify(log)
    assert np.all(asked.std[:4] < 1.3 * without.std[:4])


@pytest.mark.parametrize("gain", [0.01, 0.05])
def test_bars_hold_the_gain_error_that_a_motion_shows(gain: float) -> None:
    off, said = [], 0
    for seed in range(6):
        made = motion(replace(QUIET, force_bias_N=1.0, force_gain=gain), 40 + seed)
        found = JointTeam().identify(made.log)
        off.append((found.parameters.people - made.truth.body.people)[:4] / found.std[:4])
        said += any(finding.code == "common-gain-unseen" for finding in found.findings)
    assert np.sqrt(np.square(off).mean()) < 1.5
    assert said >= 5


def test_evidence_and_squares_are_those_of_dense_matrices() -> None:
    rng = np.random.default_rng(0)
    A = rng.normal(size=(40, 6))
    y = rng.normal(size=40)
    sight = GainSight(A.T @ A, A.T @ y)

    def dense(size: float) -> float:
        V = np.eye(40) + size**2 * A @ A.T
        return float(-0.5 * (np.linalg.slogdet(V)[1] + y @ np.linalg.solve(V, y)))

    assert np.allclose(sight.evidence(np.array([0.0, 0.3])), [0.0, dense(0.3) - dense(0.0)])
    spread = np.linalg.inv(A.T @ A + np.eye(6) / 0.3**2)
    mean = spread @ A.T @ y
    assert np.allclose(sight.squares(0.3), spread + np.outer(mean, mean))
