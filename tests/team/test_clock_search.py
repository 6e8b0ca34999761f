"""Clocks that are late by more than a joint fit finds by itself, and logs in which nothing is late."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import made_teams
import numpy as np
import pytest
from made_teams import HINGE, NOISY_TWISTS

from steelyard.errors import BadValue
from steelyard.logs.team_log import TeamLog
from steelyard.pipelines.shared_payload import identify_team
from steelyard.simulate.team import simulate_team
from steelyard.simulate.team_cases import CASES, TeamNoise, TeamScene
from steelyard.team.clocks.errors import NOTHING
from steelyard.team.clocks.lags import far_lags, searched, together
from steelyard.team.joint import JointTeam
from steelyard.team.poses.team import PoseTeam
from steelyard.team.team_findings import late_clocks

trial = partial(made_teams.trial, NOISY_TWISTS, still_samples=300)


def late(log: TeamLog, **seconds: float) -> TeamLog:
    return log.with_recordings(
        *(replace(r, tracks={n: t.shifted(seconds.get(n, 0.0)) for n, t in r.tracks.items()}) for r in log.recordings)
    )


@pytest.mark.parametrize("sensing", ["poses", "twists"])
def test_a_clock_far_beyond_what_a_fit_finds_is_found_and_put_right(sensing: str) -> None:
    made = trial(sensing=sensing, bases_move=sensing == "twists")
    right = JointTeam().identify(made.log)
    for seconds in (0.5, -0.8, 1.7):
        found = JointTeam().identify(late(made.log, robot1=seconds))
        assert found.clock_offsets_s["robot1"] == pytest.approx(seconds, abs=2e-3)
        assert found.codes() == {"clock-offset"}
        (said,) = found.findings
        told = said.message.removeprefix("The stamps of 'robot1' are ").split(" ± ")[0]
        assert float(told) == pytest.approx(abs(1e3 * seconds), abs=2)
        assert found.mass == pytest.approx(right.mass, abs=0.05)


def test_a_late_reference_makes_all_others_early() -> None:
    found = JointTeam().identify(late(trial().log, robot0=0.7))
    assert found.clock_offsets_s["robot0"] == 0.0
    for name in ("robot1", "robot2"):
        assert found.clock_offsets_s[name] == pytest.approx(-0.7, abs=2e-3)


def test_several_late_clocks_and_missing_rows() -> None:
    made = trial(robots=4, gaps={2: ((5.0, 7.0),)}, dropout=0.02)
    found = JointTeam().identify(late(made.log, robot1=1.1, robot3=-0.6))
    for name, seconds in (("robot1", 1.1), ("robot2", 0.0), ("robot3", -0.6)):
        assert found.clock_offsets_s[name] == pytest.approx(seconds, abs=2e-3)


@pytest.mark.parametrize("sensing", ["poses", "twists"])
@pytest.mark.parametrize("seconds", [5.0, -700.0, 1.7e9])
def test_clocks_that_count_from_different_moments(sensing: str, seconds: float) -> None:
    made = trial(sensing=sensing, bases_move=sensing == "twists")
    right, found = identify_team(made.log), identify_team(late(made.log, robot1=seconds, robot2=-3.0))
    assert found.clock_offsets_s["robot1"] == pytest.approx(seconds, abs=2e-3)
    assert found.clock_offsets_s["robot2"] == pytest.approx(-3.0, abs=2e-3)
    assert found.codes() == {"clock-offset"}
    assert found.mass == pytest.approx(right.mass, abs=0.05)
    assert np.linalg.norm(found.com - right.com) < 1e-3


def test_clocks_that_nothing_tells_apart_are_refused() -> None:
    made, other = trial(), trial(seed=1)
    moved = late(made.log, robot1=500.0)
    mixed = moved.with_recordings(
        *(
            replace(r, tracks={**r.tracks, "robot1": o.tracks["robot1"].shifted(500.0)})
            for r, o in zip(moved.recordings, other.log.recordings, strict=True)
        )
    )
    with pytest.raises(BadValue, match=r"must overlap; they do not: robot0 0 to .* robot1 500 to"):
        identify_team(mixed)
    with pytest.raises(BadValue, match="must overlap; they do not"):
        identify_team(moved, method="paper")


@pytest.mark.parametrize("seed", range(3))
def test_clocks_that_a_fit_brings_together_are_left_to_it(seed: int) -> None:
    for log in (trial(seed=seed).log, late(trial(seed=seed).log, robot1=1.7), trial(robots=4, hinge=HINGE).log):
        assert together(log) == (log, NOTHING)


@pytest.mark.parametrize("case", CASES)
def test_good_logs_are_never_searched(case: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object) -> None:
        raise AssertionError

    monkeypatch.setattr("steelyard.team.joint.searched", refused)
    JointTeam().identify(simulate_team(TeamScene(CASES[case], motion_samples=1500), 7).log)


def test_clocks_that_were_said_to_agree_are_never_searched(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object) -> None:
        raise AssertionError

    monkeypatch.setattr("steelyard.team.joint.searched", refused)
    JointTeam(clocks=False).identify(late(trial().log, robot1=0.7))


def test_robots_in_step_have_no_far_lag_and_clocks_stay_where_that_would_not_help() -> None:
    made = trial()
    assert not far_lags(made.log)
    team = PoseTeam.of(made.log, True)
    assert searched(made.log, team, lambda _: team) == (made.log, team, NOTHING)
    moved = late(made.log, robot1=0.6)
    assert all(e["robot1"].late == pytest.approx(0.6, abs=0.05) for e in far_lags(moved).recordings)
    # What comes of it is no better: the log and its fit stay.
    assert searched(moved, team, lambda _: team)[0] is moved
    assert not far_lags(made.log.with_recordings(*made.log.recordings[:-1]))


def test_a_hinge_is_searched_and_stays_what_it_is() -> None:
    made = trial(robots=4, hinge=HINGE)
    assert not far_lags(made.log)
    assert "payload-jointed" in JointTeam().identify(made.log).codes()


# A difference of next rows of noise is noise: steps that were divided by it fell short, and stopped without a word.
LOUD = replace(NOISY_TWISTS, rate_rad_s=2e-2, velocity_m_s=5e-3)
SLOW = replace(NOISY_TWISTS, rate_rad_s=3e-3, velocity_m_s=2e-3, twist_spectrum="2hz")


@pytest.mark.parametrize(
    ("noise", "rows", "late_s", "most"),
    [
        (NOISY_TWISTS, 1500, (0.0476, -0.0217), 1.7),
        (LOUD, 1500, (0.0476, -0.0217), 1.7),
        (SLOW, 3000, (0.013, -0.02), 2.2),
    ],
    ids=["usual", "loud", "slow"],
)
def test_clocks_of_noisy_twists_are_found_to_within_their_bars(
    noise: TeamNoise, rows: int, late_s: tuple[float, float], most: float
) -> None:
    off = []
    for seed in range(100, 106):
        scene = TeamScene(noise, sensing="twists", bases_move=True, kinds=("still", "motion"), motion_samples=rows)
        found = JointTeam().identify(late(simulate_team(scene, seed).log, robot1=late_s[0], robot2=late_s[1]))
        for name, seconds in zip(("robot1", "robot2"), late_s, strict=True):
            off.append((found.clock_offsets_s[name] - seconds) / found.clock_offset_std_s[name])
    assert np.sqrt(np.mean(np.square(off))) < most


def test_a_small_bar_has_its_digits() -> None:
    (said,) = late_clocks({"a": 0.0, "b": -0.01998765}, {"b": 3.97e-5})
    assert "The stamps of 'b' are 19.988 ± 0.040 ms early" in said.message
