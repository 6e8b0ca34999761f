"""Linear velocities of one robot in another unit are named; good logs are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from steelyard.errors import BadValue
from steelyard.logs.team_log import TeamLog
from steelyard.logs.team_track import Track
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
    wrong = f"robot{(list(UNITS).index(unit) + robots) % 2}"  # by turns the reference and another
    log = scaled(made(robots, 100), wrong, 1 / UNITS[unit])
    with pytest.raises(BadValue, match=rf"if the linear velocities of '{wrong}' are in {unit}: ") as caught:
        JointTeam().identify(log)
    assert " or " not in str(caught.value)


@pytest.mark.parametrize("robots", [2, 3, 5])
def test_good_logs_pass(robots: int) -> None:
    for seed, late in ((101, 0.02), (102, 0.5)):
        log = made(robots, seed, late)
        require_twists_well_read(log, TwistTeam.of(log, late < 0.1))


def test_velocities_that_are_all_zero_are_no_unit() -> None:
    log = scaled(made(3, 100), "robot1", 0.0)
    with np.errstate(all="raise"):
        require_twists_well_read(log, TwistTeam.of(log, False))


def in_home_axes(log: TeamLog, *who: str) -> TeamLog:
    """Return the log with twists of some robots in the axes of their homes, as many drivers give them."""

    def turned(track: Track) -> Track:
        names = ("angular_velocity", "linear_velocity")
        return replace(
            track, channels={**track.channels, **{n: track.rotation.apply(track.channels[n]) for n in names}}
        )

    return log.with_recordings(*(
        replace(r, tracks={n: turned(t) if n in who else t for n, t in r.tracks.items()}) for r in log.recordings
    ))  # fmt: skip


@pytest.mark.parametrize(("robots", "who"), [(2, ["robot0"]), (3, ["robot1"]), (3, ["robot0", "robot1", "robot2"])])
def test_twists_in_the_axes_of_homes_are_named(robots: int, who: list[str]) -> None:
    rigid = frozenset({0} if robots == 2 else ())
    log = simulate_team(TeamScene(NOISE, robots, "twists", rigid, motion_samples=1500), 100).log
    said = "all robots are in the axes of their home" if len(who) == robots else f"'{who[0]}' are in the axes of its ho"
    with pytest.raises(BadValue, match=f"if the twists of {said}") as caught:
        JointTeam().identify(in_home_axes(log, *who))
    assert " or if " not in str(caught.value)
