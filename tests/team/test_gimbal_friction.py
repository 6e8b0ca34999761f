"""Friction in passive gimbals: moments alone that nothing explains are named, at bars of their own size."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from steelyard.logs.team_log import TeamLog
from steelyard.simulate.team import TeamTrial, simulate_team
from steelyard.simulate.team_cases import TeamNoise, TeamScene
from steelyard.spatial import cross_matrix
from steelyard.team.joint import JointTeam

NOISE = TeamNoise(pose_rad=3e-4, pose_m=2e-4, force_white_N=0.5)
FRICTION = 1.5  # [N m] of all gimbals about an axis
TURNS_HZ = np.array([0.1, 0.13, 0.07])


def rubbed(trial: TeamTrial) -> TeamLog:
    """The log with forces that also bear friction: steady at rest, with the sign of a slow turn in motion."""
    log, rng = trial.log, np.random.default_rng(0)
    grasps = trial.truth.grasps
    bears = np.linalg.pinv(
        np.hstack(
            [np.vstack([cross_matrix(p) @ R, R]) for R, p in zip(grasps.rotation.matrix, grasps.position, strict=True)]
        )
    )[:, :3]
    made = []
    for recording in log.recordings:
        signs, phase, tracks = rng.choice([-1.0, 1.0], 3), rng.uniform(0, 2 * np.pi, 3), {}
        for name, bear in zip(log.names, np.split(bears, len(log.names)), strict=True):
            track = recording.tracks[name]
            turns = np.sign(np.sin(2 * np.pi * track.time[:, None] * TURNS_HZ + phase))
            moment = FRICTION * (turns if recording.kind == "motion" else signs + 0 * turns)
            tracks[name] = replace(
                track, channels={**track.channels, "force": track.channels["force"] + moment @ bear.T}
            )
        made.append(replace(recording, tracks=tracks))
    return log.with_recordings(*made)


@pytest.mark.parametrize("robots", [3, 4])
def test_bars_are_of_its_size(robots: int) -> None:
    scene = TeamScene(NOISE, robots, kinds=("still", "motion"), sensing="poses", motion_samples=2000)
    trial = simulate_team(scene, 3)
    found = JointTeam().identify(rubbed(trial))
    assert "wrench-unexplained" in found.codes()
    assert (found.std[1:4] < 0.01).all()
    assert (np.abs(found.com - trial.truth.body.com) < 3 * found.std[1:4]).all()
