"""Teams whose answer is known: two or three robots and their usual noise, with what a test wants otherwise."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from steelyard.simulate.team import TeamTrial, simulate_team
from steelyard.simulate.team_cases import Hinge, TeamNoise, TeamScene

NOISY = TeamNoise(pose_rad=3e-4, pose_m=2e-4, force_white_N=1.0)
NOISY_TWISTS = replace(NOISY, rate_rad_s=2e-3, velocity_m_s=5e-4)
ALL_KINDS = ("grasp", "still", "motion")

# Four robots, two to a body.
HINGE = Hinge(
    frozenset({2, 3}), np.array([0.0, 1.0, 0.0]), np.array([-0.3, 0.0, 0.0]), 4.0, np.array([0.3, 0.4, 0.5]),
    np.array([-0.6, 0.0, 0.0]),
)  # fmt: skip


def trial(noise: TeamNoise = NOISY, seed: int = 100, **scene: Any) -> TeamTrial:
    """Return a simulated team: poses are measured, still and in motion, unless fields of its `scene` say otherwise."""
    usual: dict[str, Any] = {"sensing": "poses", "kinds": ("still", "motion"), "motion_samples": 1500}
    if scene.get("robots") == 2:
        usual["six_axis"] = frozenset({0})  # two gimbals alone let the payload swing
    return simulate_team(TeamScene(noise, **(usual | scene)), seed)
