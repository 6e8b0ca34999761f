"""Linear velocities of one robot in another unit are named; good logs are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from steelyard.errors import BadValue
from steelyard.logs.team_log import TeamLog
from steelyard.simulate.team import simulate_team
from steelyard.simulate.team_cases import TeamNoise, TeamScene
from steelyard.team.joint import JointTeam
from steelyard.team.misread.twists import UNITS, require_twists_well_read
from steelyard.team.twists.team import TwistTeam

NOISE = TeamNoise(rate_rad_s=2e-3, velocity_m_s=5e-4, force_white_N=0.1, torque_white_Nm=0.01)


def made(robots: int, seed: int, late: float = 0.0) -> TeamLog:
    rigid = frozenset({0} if robots == 2 else ())
    scene = TeamScene(
        NOISE, robots, "twists", rigid, bases_move=True, late_s={1: late}, motion_samples=1000, grasp_samples=500
    )
    return simulate_team(scene, seed).log


def scaled(log: TeamLog, name: str, factor: float) -> TeamLog:
    recordings = []
    for recording in log.recordings:
        track = recording.tracks[name]
        channels = {**track.channels, "linear_velocity": factor * track.channels["linear_velocity"]}
        recordings.append(replace(recording, tracks={**recording.tracks, name: replace(track, channels=channels)}))
    return log.with_recordings(*recordings)


@pytest.mark.parametrize("robots", [2, 3])
@pytest.mark.parametrize("unit", UNITS)
def test_a_velocity_in_another_unit_is_named(unit: str, robots: int) -> None:
    for seed, wrong in ((100, "robot0"), (101, "robot1")):
        log = scaled(made(robots, seed), wrong, 1 / UNITS[unit])
        with pytest.raises(BadValue, match=rf"if the linear velocities of '{wrong}' are in {unit}: ") as caught:
            JointTeam().identify(log)
        assert " or " not in str(caught.value)


@pytest.mark.parametrize("robots", [2, 3, 5])
def test_good_logs_pass(robots: int) -> None:
    for seed, late in ((100, 0.0), (101, 0.02), (102, 0.5)):
        log = made(robots, seed, late)
        require_twists_well_read(log, TwistTeam.of(log, late < 0.1))


def test_velocities_that_are_all_zero_are_no_unit() -> None:
    log = scaled(made(3, 100), "robot1", 0.0)
    with np.errstate(all="raise"):
        require_twists_well_read(log, TwistTeam.of(log, False))
