"""One robot on a moving base, which measures twists, among standing ones, which measure poses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.logs.team_log import TeamLog
from steelyard.simulate.team import TeamTrial, simulate_team
from steelyard.simulate.team_cases import TeamNoise, TeamScene
from steelyard.spatial import Pose, Rotation
from steelyard.team.joint import JointTeam
from steelyard.team.twists.rows import derived

NOISE = TeamNoise(
    pose_rad=3e-4, pose_m=1e-4, rate_rad_s=2e-3, velocity_m_s=5e-4, force_white_N=0.1, torque_white_Nm=0.01
)


def mixed(seed: int, moving: str) -> TeamTrial:
    """Return a session in which all six-axis robots stand but `moving`."""
    scene = TeamScene(NOISE, sensing="poses", six_axis=frozenset(range(3)), motion_samples=3000)
    stand = simulate_team(scene, seed)
    roll = simulate_team(replace(scene, sensing="twists", bases_move=True), seed)
    recordings = tuple(
        replace(one, tracks={**one.tracks, moving: other.tracks[moving]})
        for one, other in zip(stand.log.recordings, roll.log.recordings, strict=True)
    )
    rolling = {robot.name: robot for robot in roll.log.robots}
    robots = tuple(rolling[robot.name] if robot.name == moving else robot for robot in stand.log.robots)
    return replace(stand, log=TeamLog(robots, recordings, stand.log.reference))


def scores(made: TeamTrial) -> tuple[Array, Array]:
    """Return by how many bars grasps' places, then centre of mass and inertia, are off."""
    found, names = JointTeam().identify(made.log), made.log.names
    body, upper = made.truth.body, np.triu_indices(3)
    places = [
        (found.grasps[name].pose.position - made.truth.grasps[i].position) / found.grasps[name].std_m
        for i, name in enumerate(names)
        if name != made.log.reference
    ]
    off = np.concatenate([found.com - body.com, (found.parameters.inertia_com - body.inertia_com)[upper]])
    return np.concatenate(places), off / found.std[1:]


@pytest.mark.parametrize("moving", ["robot0", "robot1"])
def test_a_moving_base_among_standing_ones_errs_as_bars_say(moving: str) -> None:
    places, bodies = (np.stack(each) for each in zip(*[scores(mixed(seed, moving)) for seed in range(4)], strict=True))
    assert 0.25 < np.sqrt(np.mean(places**2)) < 1.3
    assert 0.25 < np.sqrt(np.mean(bodies**2)) < 1.3


@pytest.mark.parametrize(("rate", "hz", "off"), [(100.0, 1.0, 1e-6), (100.0, 3.0, 1e-3), (20.0, 1.0, 1e-3)])
def test_twists_from_poses_have_the_size_of_measured_ones(rate: float, hz: float, off: float) -> None:
    time = np.arange(0, 6, 1 / rate)
    phase = 2 * np.pi * hz * time
    axis, place = np.array([0.6, 0.0, 0.8]), np.array([0.3, -0.2, 0.1])
    turn = Rotation.exp(0.4 * np.sin(phase)[:, None] * axis)
    twist, good = derived(Pose(turn, np.sin(phase)[:, None] * place), np.ones(len(time), np.bool_), rate)
    speed = 2 * np.pi * hz * np.cos(phase)[:, None]
    true = np.concatenate([0.4 * speed * axis, turn.inverse().apply(speed * place)], axis=1)
    assert np.abs(twist - true)[good].max() < off * np.abs(true).max()
    assert good.sum() > 0.9 * len(time)


def test_rows_near_a_gap_have_no_twist() -> None:
    seen = np.ones(100, np.bool_)
    seen[50] = False
    _, good = derived(Pose(Rotation.identity(100), np.zeros((100, 3))), seen, 100.0)
    assert np.flatnonzero(~good).tolist() == [*range(17), *range(33, 68), *range(83, 100)]


def test_a_moving_robot_without_twists_is_named() -> None:
    log = simulate_team(TeamScene(NOISE, sensing="poses", kinds=("still", "motion"), motion_samples=500), 0).log
    rolls = tuple(replace(one, base="moving") if one.name == "robot1" else one for one in log.robots)
    with pytest.raises(CannotAnswer, match="'robot1' gives no twists while others move"):
        JointTeam().identify(replace(log, robots=rolls))
