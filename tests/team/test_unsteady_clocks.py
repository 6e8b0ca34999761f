"""Clocks that are set anew between recordings, or run fast: told, put right, and never where clocks are steady."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import made_teams
import numpy as np
import pytest
from made_teams import ALL_KINDS, NOISY_TWISTS

from steelyard.check import Array
from steelyard.logs.team_log import TeamLog
from steelyard.simulate.team import TeamTrial, simulate_team
from steelyard.simulate.team_cases import CASES, Slip, TeamScene
from steelyard.team.clocks.errors import NOTHING, ClockError, ClockErrors
from steelyard.team.estimate import TeamEstimate
from steelyard.team.joint import JointTeam

LATE = 0.005


def trial(sensing: str, seed: int = 100, **changes: Any) -> TeamTrial:
    noise = CASES["B"] if sensing == "joints" else NOISY_TWISTS
    scene: dict[str, Any] = {"bases_move": sensing == "twists", "kinds": ALL_KINDS, "motion_samples": 2500} | changes
    return made_teams.trial(noise, seed, sensing=sensing, **scene)


def restamped(log: TeamLog, kind: str, of: Callable[[Array], Array], *names: str) -> TeamLog:
    """Return the log with the stamps of robots in recordings of one kind made anew."""
    return log.with_recordings(
        *(
            replace(r, tracks={n: t.stamped(of(t.time)) if n in names else t for n, t in r.tracks.items()})
            if r.kind == kind
            else r
            for r in log.recordings
        )
    )


def bars_off(found: TeamEstimate, made: TeamTrial) -> float:
    """Return by how many of their bars the grasps are off (rms)."""
    off = [
        (found.grasps[name].pose.position - made.truth.grasps.position[i]) / found.grasps[name].std_m
        for i, name in enumerate(made.log.names)
        if i
    ]
    return float(np.sqrt(np.mean(np.square(off))))


@pytest.mark.parametrize("sensing", ["joints", "poses", "twists"])
def test_a_clock_that_is_set_anew_is_named_and_put_right(sensing: str) -> None:
    off, plain = [], []
    for seed in (100, 101):
        made = trial(sensing, seed)
        log = restamped(made.log, "motion", lambda t: t + LATE, "robot1")
        found = JointTeam().identify(log)
        plain.append(bars_off(JointTeam().identify(made.log), made))
        off.append(bars_off(found, made))
        (said,) = (f for f in found.findings if f.code == "clock-unsteady")
        assert "'robot1' are " in said.message
        assert "later in 'motion-5' than in 'grasp-0'" in said.message
        # The offset that is told is that of the first recording in motion.
        assert abs(found.clock_offsets_s["robot1"]) < 4 * found.clock_offset_std_s["robot1"]
        assert "grasp-slipped" not in found.codes()
    assert max(off) < 1.5 * max(plain)


@pytest.mark.parametrize("sensing", ["joints", "twists"])
def test_a_clock_that_runs_fast_is_named_and_put_right(sensing: str) -> None:
    made = trial(sensing)
    log = restamped(made.log, "motion", lambda t: t + 2e-4 * (t - t[0]), "robot2")
    found = JointTeam().identify(log)
    (said,) = (f for f in found.findings if f.code == "clock-unsteady")
    assert "'robot2'" in said.message
    assert "ppm fast in 'motion-5'" in said.message
    assert bars_off(found, made) < 1.5 * bars_off(JointTeam().identify(made.log), made)


@pytest.mark.parametrize("sensing", ["poses", "twists"])
def test_a_clock_that_runs_fast_about_the_middle_of_the_only_recording_is_named(sensing: str) -> None:
    """On average it is as late as the fit says, so that its rate alone tells."""
    made = trial(sensing, 101, kinds=("motion",), motion_samples=2500)
    found = JointTeam().identify(restamped(made.log, "motion", lambda t: t + 3e-4 * (t - t.mean()), "robot1"))
    (said,) = (finding.message for finding in found.findings if finding.code == "clock-unsteady")
    assert "'robot1' run " in said
    assert float(said.split(" run ")[1].split(" ")[0]) == pytest.approx(300, abs=15)


def test_a_reference_that_is_set_anew_shows_in_all_others() -> None:
    made = trial("joints")
    found = JointTeam().identify(restamped(made.log, "motion", lambda t: t + LATE, "robot0"))
    said = [f.message for f in found.findings if f.code == "clock-unsteady"]
    assert [("'robot1'" in one, "'robot2'" in one) for one in said] == [(True, False), (False, True)]
    assert all("earlier in 'motion-5'" in one for one in said)


@pytest.mark.parametrize("sensing", ["poses", "twists"])
def test_a_clock_that_is_set_anew_by_most_of_a_second(sensing: str) -> None:
    made = trial(sensing)
    found = JointTeam().identify(restamped(made.log, "motion", lambda t: t - 0.7, "robot1"))
    (said,) = (f for f in found.findings if f.code == "clock-unsteady")
    assert "'robot1' are 700" in said.message
    assert "earlier in 'motion-5'" in said.message
    assert bars_off(found, made) < 1.5 * bars_off(JointTeam().identify(made.log), made)


@pytest.mark.parametrize("case", CASES)
def test_steady_clocks_are_left_alone(case: str) -> None:
    for seed in (7, 8):
        scene = TeamScene(CASES[case], motion_samples=1500, late_s={1: 0.013})
        assert "clock-unsteady" not in JointTeam().identify(simulate_team(scene, seed).log).codes()


def test_a_slip_is_no_clock() -> None:
    for seed in (100, 101):
        slip = Slip(1, np.array([0.0, 0.004, 0.003]), 8.0)
        found = JointTeam().identify(trial("joints", seed, slip=slip).log)
        assert "grasp-slipped" in found.codes()
        assert "clock-unsteady" not in found.codes()


def test_clocks_that_are_taken_as_they_are() -> None:
    log = restamped(trial("poses").log, "motion", lambda t: t + LATE, "robot1")
    found = JointTeam(clocks=False).identify(log)
    assert "clock-unsteady" not in found.codes()
    assert not found.clock_offset_std_s


def test_errors_add_up_and_are_taken_out() -> None:
    log = trial("poses").log
    one = ClockErrors(tuple({"robot1": ClockError(0.01, 1e-5, float(r.span[0]))} for r in log.recordings))
    late = ClockErrors(tuple({"robot1": ClockError(-0.01, -1e-5, float(r.span[0]))} for r in log.recordings)).corrected(
        log
    )
    for before, after in zip(log.recordings, one.corrected(late).recordings, strict=True):
        assert after.tracks["robot1"].time == pytest.approx(before.tracks["robot1"].time, abs=2e-7)
        assert after.tracks["robot0"] is before.tracks["robot0"]
    assert not NOTHING
    assert NOTHING.corrected(log) is log
    assert (NOTHING + one) is one
    assert (one + NOTHING) is one
    assert (one + one).first(log)["robot1"].late == pytest.approx(0.02)


@pytest.mark.parametrize("sensing", ["poses", "twists"])
@pytest.mark.parametrize(("name", "rate"), [("robot1", 0.005), ("robot2", -0.01), ("robot0", 0.01)])
def test_a_clock_that_runs_half_a_percent_fast_is_put_right_and_the_reference_told(
    sensing: str, name: str, rate: float
) -> None:
    made = trial(sensing, motion_samples=4000, kinds=("still", "motion"))
    found = JointTeam().identify(restamped(made.log, "motion", lambda t: t + rate * (t - t[0]), name))
    (said,) = (f.message for f in found.findings if f.code == "clock-unsteady")
    assert found.codes() <= {"clock-unsteady", "clock-offset"}
    assert f"The stamps of '{name}' run " in said
    ppm = float(said.split(" run ")[1].split()[0])
    assert ppm == pytest.approx(1e6 * abs(rate / (1 + rate)), rel=2e-3)
    assert ("the others'" if name == "robot0" else "the reference's") in said
    assert bars_off(found, made) < 2
    assert np.abs((found.parameters.people - made.truth.body.people) / found.std).max() < 4.5


def test_of_two_robots_no_one_knows_whose_clock_is_right() -> None:
    made = trial("poses", robots=2, kinds=("still", "motion"))
    found = JointTeam().identify(restamped(made.log, "motion", lambda t: 1.005 * t, "robot1"))
    (said,) = (f.message for f in found.findings if f.code == "clock-unsteady")
    assert said.endswith("Which of the two clocks is right no log tells.")


@pytest.mark.parametrize("name", ["robot0", "robot1"])
@pytest.mark.parametrize("by", [0.008, -0.02, 0.035])
def test_a_small_leap_is_told_from_a_clock_that_runs_fast(name: str, by: float) -> None:
    made = trial("poses", motion_samples=4000, kinds=("still", "motion"))
    log = restamped(made.log, "motion", lambda t: t + by * (t > t[1700]), name)
    found = JointTeam().identify(log)
    said = [f.message for f in found.findings if f.code == "clock-unsteady"]
    assert found.codes() <= {"clock-unsteady", "clock-offset"}
    assert len(said) == (2 if name == "robot0" else 1)
    for text in said:
        sizes = float(text.split(" are ")[1].split()[0])
        assert sizes == pytest.approx(1e3 * abs(by), abs=0.5)
        assert " ppm " not in text
    assert bars_off(found, made) < 2


def test_errors_add_up_like_stamps() -> None:
    first, second = ClockError(0.3, 0.01, 5.0), ClockError(-0.1, -0.004, 20.0, 1e-3, 1e-5)
    time = np.linspace(0.0, 40.0, 5)
    both = first + second
    assert np.allclose(both.right(time), second.right(first.right(time)), atol=2e-3)
    assert both.at(20.0) == pytest.approx(0.35)
