"""Clocks that jump within a recording: named, put right, and told from clocks that run fast and from lost rows."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from steelyard.check import Array
from steelyard.logs.team_log import TeamLog
from steelyard.logs.team_track import Track
from steelyard.simulate.team import TeamTrial, simulate_team
from steelyard.simulate.team_cases import CASES, Presence, TeamNoise, TeamScene
from steelyard.team.clocks.jumps import cut_at_jumps
from steelyard.team.joint import JointTeam


@cache
def trial(case: str = "B", seed: int = 40, robots: int = 3) -> TeamTrial:
    six_axis = frozenset({0} if robots == 2 else ())
    return simulate_team(TeamScene(CASES[case], robots, six_axis=six_axis, motion_samples=2500), seed)


def with_track(log: TeamLog, name: str, kind: str, changed: Track) -> TeamLog:
    """Return the log with another track of one robot in its recording of a kind."""
    return log.with_recordings(
        *(replace(r, tracks={**r.tracks, name: changed}) if r.kind == kind else r for r in log.recordings)
    )


def track_of(log: TeamLog, name: str, kind: str) -> Track:
    return next(r.tracks[name] for r in log.recordings if r.kind == kind)


def jumped(log: TeamLog, name: str, kind: str, by: float) -> TeamLog:
    """Return the log with a clock that leaps ahead in the middle of a recording."""
    track = track_of(log, name, kind)
    later = np.arange(len(track)) >= len(track) // 2
    return with_track(log, name, kind, track.stamped(track.time + by * later))


def off(trial: TeamTrial, log: TeamLog) -> tuple[Array, set[str], str]:
    """Return how far (10,) the answer is from the truth [standard deviations], its codes, and what clocks are said."""
    found = JointTeam().identify(log)
    said = " ".join(f.message for f in found.findings if f.code == "clock-unsteady")
    return (found.parameters.people - trial.truth.body.people) / found.std, found.codes(), said


@pytest.mark.parametrize("case", ["B", "D"])
@pytest.mark.parametrize("by", [0.05, 0.2, 0.5])
def test_a_clock_that_leaps_is_named_and_put_right(case: str, by: float) -> None:
    made = trial(case)
    away, codes, said = off(made, jumped(made.log, "robot1", "motion", by))
    assert np.abs(away).max() < 4
    assert codes <= {"clock-unsteady", "common-gain-unseen"}
    assert f"stamps of 'robot1' are {1e3 * by:.1f}" in said
    assert "ms later in 'motion-5 from 12.5 s on'" in said


def test_a_clock_that_leaps_in_a_short_recording_is_put_right() -> None:
    away, codes, _ = off(trial(), jumped(trial().log, "robot2", "grasp", 0.2))
    assert np.abs(away).max() < 4
    assert codes == {"clock-unsteady"}


def test_stamps_counted_over_rows_that_were_lost_are_put_right() -> None:
    """A `rate` in place of stamps: every row after 15 that were lost counts as too early."""
    track = track_of(trial().log, "robot1", "motion")
    kept = np.delete(np.arange(len(track)), np.arange(1200, 1215))
    counted = track.rows(kept).stamped(track.time[: len(kept)])
    away, codes, said = off(trial(), with_track(trial().log, "robot1", "motion", counted))
    assert np.abs(away).max() < 4
    assert codes == {"clock-unsteady"}
    assert "'robot1' are 150.0 ms earlier" in said or "'robot1' are 150." in said


def test_a_leap_of_the_reference_is_one_of_all_others() -> None:
    away, codes, said = off(trial(), jumped(trial().log, "robot0", "motion", 0.2))
    assert np.abs(away).max() < 4
    assert codes == {"clock-unsteady"}
    assert "'robot1' are 200.0 ms earlier" in said
    assert "'robot2' are 200.0 ms earlier" in said


def test_a_leap_of_one_of_two_is_put_right() -> None:
    made = trial(robots=2)
    _, codes, said = off(made, jumped(made.log, "robot1", "motion", 0.1))
    assert "clock-unsteady" in codes
    assert "'robot1' are 100." in said


def test_a_leap_is_put_right_where_the_caller_says_whose_grasp_slipped() -> None:
    made = trial(robots=2)
    log = jumped(made.log, "robot1", "motion", 0.2)
    by_wrenches, said = (JointTeam(slipped=slipped).identify(log) for slipped in (None, ()))
    assert "clock-unsteady" in said.codes()
    assert said.findings == by_wrenches.findings


@pytest.mark.parametrize("case", ["A", "B", "C", "D"])
def test_sound_clocks_fast_ones_and_lost_rows_are_no_leap(case: str) -> None:
    for seed in range(50, 56):
        log = trial(case, seed).log
        assert cut_at_jumps(log)[0] is log
        track = track_of(log, "robot1", "motion")
        for rate in (1e-3, -3e-3):
            fast = with_track(log, "robot1", "motion", track.stamped(track.time + rate * (track.time - track.time[0])))
            assert cut_at_jumps(fast)[0] is fast
        lost = with_track(log, "robot1", "motion", track.rows(np.r_[:1000, 1040 : len(track)]))
        assert cut_at_jumps(lost)[0] is lost


@pytest.mark.parametrize("reads_n", [0.0, 3.0], ids=["tared", "biased"])
def test_a_robot_that_follows_late_before_it_takes_hold_has_no_leaping_clock(reads_n: float) -> None:
    """It then holds nothing, so that how it turns is nobody else's turning, though it looks like it."""
    joins, late, name = 9.0, 50, "robot2"
    noise = TeamNoise(pose_rad=3e-4, pose_m=2e-4, force_white_N=1.0)
    scene = TeamScene(noise, 4, sensing="poses", six_axis=frozenset({0}), motion_samples=2500)
    holding = track_of(simulate_team(scene, 3).log, name, "motion")
    made = simulate_team(replace(scene, presence=(Presence(2, joins=joins),)), 3)
    track = track_of(made.log, name, "motion")
    # Where it would be if it held the payload, half a second ago; it catches up before it takes hold.
    before = track.time - track.time[0] < joins - 0.8
    rows = np.maximum(np.arange(len(track)) - late * before, 0)
    poses = {channel: holding.channels[channel][rows] for channel in ("rotation", "position")}
    force = track.channels["force"] + reads_n * np.array([0.6, 0.0, 0.8])
    came = replace(track, channels={**track.channels, **poses, "force": force})
    found = JointTeam().identify(with_track(made.log, name, "motion", came))
    assert not {"clock-unsteady", "clock-offset", "robot-left", "grasp-slipped"} & found.codes()
    (said,) = [finding.message for finding in found.findings if finding.code == "robot-joined"]
    assert said.startswith(f"'{name}' took hold of the payload at ")
    away = np.append(found.mass, found.com) - np.append(made.truth.body.mass, made.truth.body.com)
    assert np.abs(away / found.std[:4]).max() < 4
