"""Edges of what a team may log: idle robots that read something, no motion, no twists, a rest at home, tilted bases."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import made_teams
import numpy as np
import pytest

from steelyard.errors import BadValue, CannotAnswer
from steelyard.logs.team_log import TeamLog
from steelyard.pipelines.shared_payload import identify_team
from steelyard.simulate.team import simulate_team
from steelyard.simulate.team_cases import CASES, TeamScene
from steelyard.spatial import Pose, Rotation
from steelyard.team.joint import UNLEVEL, JointTeam

NOISY = replace(made_teams.NOISY_TWISTS, force_white_N=0.5)
trial = partial(made_teams.trial, NOISY, kinds=made_teams.ALL_KINDS)


def pushing(log: TeamLog, name: str, force: float) -> TeamLog:
    """Return the log with a robot that is away and whose sensor still reads something."""

    def track(t: Any) -> Any:
        return replace(t, channels={**t.channels, "force": np.tile([0.0, 0.0, force], (len(t), 1))})

    return log.with_recordings(
        *(
            replace(r, away=frozenset({name}), tracks={n: track(t) if n == name else t for n, t in r.tracks.items()})
            for r in log.recordings
        )
    )


@pytest.mark.parametrize("method", ["paper", "joint"])
def test_what_an_idle_robot_reads_is_no_push(method: Any) -> None:
    log = trial(robots=4).log
    none, some = (identify_team(pushing(log, "robot3", force), method).mass for force in (0.0, 20.0))
    assert some == pytest.approx(none, abs=1e-9)


def test_the_published_method_needs_motion() -> None:
    log = trial(kinds=("still",)).log
    with pytest.raises(CannotAnswer, match="a recording in motion"):
        identify_team(log, "paper")


def test_nobody_else_has_twists() -> None:
    log = trial(sensing="twists", bases_move=True, robots=2, six_axis=frozenset({0})).log
    bare = log.with_recordings(
        *(
            replace(r, tracks={**r.tracks, "robot1": r.tracks["robot1"].without("linear_velocity")})
            for r in log.recordings
        )
    )
    with pytest.raises(CannotAnswer, match="'robot1' gives no twists while others move"):
        identify_team(bare)


def test_homes_at_the_grasps_and_a_rest_there() -> None:
    made = trial(still_turns=((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.0, 0.1, 0.0)), kinds=("grasp", "still", "motion"))
    found = identify_team(made.log)
    assert abs(found.mass - 12) < 4 * found.std[0]


def test_forces_that_are_all_zero_are_an_answer_in_words() -> None:
    log = trial().log

    def still(t: Any) -> Any:
        return replace(t, channels={**t.channels, "force": 0 * t.channels["force"]})

    dead = log.with_recordings(
        *(
            replace(
                r,
                tracks={
                    n: replace(t, channels={**t.channels, "force": 0 * t.channels["force"]})
                    for n, t in r.tracks.items()
                },
            )
            for r in log.recordings
        )
    )
    with pytest.raises(CannotAnswer):
        identify_team(dead)


@pytest.mark.parametrize("hz", [0.0, -1.0, np.nan])
def test_a_frequency_that_is_none(hz: float) -> None:
    with pytest.raises(BadValue, match="highest_hz"):
        JointTeam(highest_hz=hz)


def test_what_wrists_leave_is_a_body() -> None:
    log = trial().log
    found = JointTeam(wrists={"robot1": 2.5, "robot2": 2.5}).identify(log)
    assert found.parameters.validity().consistent
    assert found.mass == pytest.approx(JointTeam().identify(log).mass - 5.0, rel=0.05)


@pytest.mark.parametrize(
    ("robots", "said"), [(2, "of 'robot1' points 3.0 deg apart"), (3, "Gravity of 'robot1' points 3.0 deg")]
)
def test_bases_that_do_not_agree_on_gravity_are_named(robots: int, said: str) -> None:
    log = trial(robots=robots, six_axis=frozenset({0}) if robots == 2 else frozenset()).log
    turn = Rotation.exp(np.deg2rad([3.0, 0.0, 0.0]))
    bases = tuple(
        replace(r, gravity=turn.apply(r.gravity)) if r.name == "robot1" and r.gravity is not None else r
        for r in log.robots
    )
    (found,) = (f for f in identify_team(replace(log, robots=bases)).findings if f.code == "base-tilted")
    assert said in found.message


# Without, mass and centre were 10 to 27 standard deviations off.
@pytest.mark.parametrize(("robots", "degrees"), [(2, 1.0), (3, 1.0), (2, 3.0)])
def test_bars_hold_what_bases_leave_open_of_gravity(robots: int, degrees: float) -> None:
    made = trial(robots=robots, six_axis=frozenset({0}) if robots == 2 else frozenset())
    turn = Rotation.exp(np.deg2rad([degrees, 0.0, 0.0]))
    bases = tuple(
        replace(r, gravity=turn.apply(r.gravity)) if r.name == "robot1" and r.gravity is not None else r
        for r in made.log.robots
    )
    found, good = identify_team(replace(made.log, robots=bases)), identify_team(made.log)
    moved = np.abs(found.parameters.people - good.parameters.people)
    assert (moved[:4] > 5 * good.std[:4]).any()
    assert (moved < 1.5 * found.std).all()
    assert UNLEVEL in found.notes
    assert ("base-tilted" in found.codes()) == (degrees > 1.7)


@pytest.mark.parametrize("sensing", ["poses", "twists"])
def test_a_base_that_is_tilted_alone_is_left_out(sensing: str) -> None:
    made = trial(sensing=sensing)
    turn = Rotation.exp(np.deg2rad([0.0, 6.0, 0.0]))
    bases = tuple(
        replace(r, gravity=turn.apply(r.gravity)) if r.name == "robot1" and r.gravity is not None else r
        for r in made.log.robots
    )
    found, good = identify_team(replace(made.log, robots=bases)), identify_team(made.log)
    (said,) = (f.message for f in found.findings if f.code == "base-tilted")
    assert said.startswith("Gravity of 'robot1' points 6.0 deg")
    assert "It was left out" in said
    np.testing.assert_allclose(found.com, good.com, atol=1e-4)
    assert found.mass == pytest.approx(good.mass, rel=1e-4)


@pytest.mark.parametrize("case", CASES)
def test_level_bases_agree(case: str) -> None:
    made = simulate_team(TeamScene(CASES[case], motion_samples=1200), 8)
    moved = made.log.with_homes({"robot1": Pose(Rotation.exp(np.array([0.0, 0.0, 1.0])), np.array([1.0, 2.0, 3.0]))})
    found = identify_team(moved)
    assert "base-tilted" not in found.codes()
    assert UNLEVEL not in found.notes
