"""Errors of poses that come back with the pose, as of an arm that is not well calibrated, are in the bars of grasps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from steelyard.logs.team_log import TeamLog
from steelyard.logs.team_track import Track
from steelyard.simulate.team import simulate_team
from steelyard.simulate.team_cases import TeamNoise, TeamScene
from steelyard.spatial import Pose, Rotation
from steelyard.spatial.screws import exp_pose, log_pose
from steelyard.team.joint import JointTeam

NOISE = TeamNoise(pose_rad=1e-4, pose_m=1e-4, force_white_N=0.3)
# Errors per turn by a radian, or move by 0.3 m [rad, m].
TURN, PLACE = 3e-3, 3e-3


def poses(track: Track) -> Pose:
    return Pose(Rotation(track.channels["rotation"]), track.channels["position"])


def bent(track: Track, middle: Pose, rng: np.random.Generator) -> Track:
    """Return poses that are off by an error linear in how far they are from `middle`."""
    size = np.repeat([TURN, PLACE], 3)
    A = size[:, None] * rng.normal(size=(6, 6)) / np.repeat([1.0, 0.3], 3)
    seen = poses(track) @ exp_pose(log_pose(middle.inverse() @ poses(track)) @ A.T)
    return replace(track, channels={**track.channels, "rotation": seen.rotation.matrix, "position": seen.position})


def miscalibrated(log: TeamLog, seed: int) -> TeamLog:
    moving = log.recordings[-1].tracks
    middles = {n: Pose(poses(t).rotation[0], poses(t).position.mean(0)) for n, t in moving.items()}

    def read(tracks: Mapping[str, Track]) -> dict[str, Track]:
        return {n: bent(t, middles[n], np.random.default_rng([seed, i])) for i, (n, t) in enumerate(tracks.items())}

    return log.with_recordings(*(replace(r, tracks=read(r.tracks)) for r in log.recordings))


def off(seed: int, *, bad: bool) -> np.ndarray:
    """Return errors of grasps over their bars."""
    made = simulate_team(TeamScene(NOISE, sensing="poses", motion_samples=2000), seed)
    found = JointTeam().identify(miscalibrated(made.log, seed) if bad else made.log)
    assert any("come back with the pose: bars allow for it" in note for note in found.notes) == bad
    out = []
    for number, name in enumerate(made.log.names):
        if name != found.reference:
            grasp, true = found.grasps[name], made.truth.grasps[number]
            out.append((grasp.pose.position - true.position) / grasp.std_m)
            out.append((grasp.pose.rotation @ true.rotation.inverse()).log() / np.deg2rad(grasp.std_deg))
    return np.concatenate(out)


@pytest.mark.parametrize("bad", [False, True])
def test_bars_hold_what_comes_back_with_the_pose(bad: bool) -> None:
    errors = np.concatenate([off(seed, bad=bad) for seed in range(8)])
    assert 0.6 < float(np.sqrt((errors**2).mean())) < 1.5
