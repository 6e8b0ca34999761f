"""Rows of a team side by side: what brief gaps of one robot cost."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_teams import trial

from steelyard.simulate.team import simulate_team
from steelyard.simulate.team_cases import TeamNoise, TeamScene
from steelyard.team.joint import JointTeam
from steelyard.team.stacked import bridged


@pytest.mark.parametrize("rate", [50.0, 200.0, 1000.0])
def test_gaps_are_bridged_by_rows_and_by_time(rate: float) -> None:
    time = np.arange(2000) / rate

    def held(missing: int) -> bool:
        good = np.ones(len(time), np.bool_)
        good[100 : 100 + missing] = False
        return bool(bridged(good, time).all())

    brief = round(0.045 * rate)
    assert held(3)
    assert held(max(brief - 1, 3))
    assert not held(max(round(0.06 * rate), 4))


def test_a_gap_at_an_end_is_none() -> None:
    good = np.arange(50) >= 2
    np.testing.assert_array_equal(bridged(good, np.arange(50) / 100), good)


def test_a_robot_that_loses_four_in_ten_rows_costs_little() -> None:
    """Rows of all must be there at once: lost rows of one had left the wrench of none."""
    made = trial(motion_samples=3000)
    rng = np.random.default_rng(0)
    lossy = made.log.with_recordings(
        *(
            replace(
                r,
                tracks={n: t.rows(rng.uniform(size=len(t)) > 0.4) if n == "robot1" else t for n, t in r.tracks.items()},
            )
            for r in made.log.recordings
        )
    )
    whole, found = JointTeam().identify(made.log), JointTeam().identify(lossy)
    assert found.identified.all()
    assert (found.std < 3 * whole.std).all()
    apart = np.append(found.mass - whole.mass, found.com - whole.com) / whole.std[:4]
    assert np.abs(apart).max() < 3


def test_a_robot_that_loses_rows_in_many_bursts_is_weighed_all_the_same() -> None:
    """Stretches between holes of 150 ms are one to two seconds long; all had to be three, and the log was refused."""
    noise = TeamNoise(force_white_N=0.3, torque_white_Nm=0.02, pose_rad=2e-4, pose_m=1e-4)
    scene = TeamScene(noise, 3, "poses", frozenset({0, 1, 2}), kinds=("motion",), motion_samples=1500)
    made = simulate_team(scene, 41)
    (motion,) = made.log.recordings
    since = motion.tracks["robot1"].time - motion.tracks["robot1"].time[0]
    lossy = {**motion.tracks, "robot1": motion.tracks["robot1"].rows((since + 0.4) % 1.8 > 0.15)}
    found = JointTeam().identify(made.log.with_recordings(replace(motion, tracks=lossy)))
    off = np.abs(found.parameters.vector - made.truth.body.vector) / np.sqrt(np.diag(found.covariance))
    assert found.identified.all()
    assert found.mass == pytest.approx(made.truth.body.mass, rel=2e-3)
    assert off.max() < 3.5
