"""The pipeline of a team: two methods through one door, rows that miss numbers said."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import steelyard as sy
from steelyard.errors import BadValue, CannotAnswer
from steelyard.logs.team_log import TeamLog, TeamRecording
from steelyard.logs.team_track import Track
from steelyard.pipelines.lacking import missing_rows, missing_wrenches
from steelyard.pipelines.shared_payload import METHODS, Method, _weighing, identify_team
from steelyard.simulate.team import TeamTrial, simulate_team
from steelyard.simulate.team_cases import CASES, TeamScene
from steelyard.team.estimate import TeamEstimate


@cache
def trial() -> TeamTrial:
    return simulate_team(TeamScene(CASES["A"], motion_samples=1500), 5)


@pytest.mark.parametrize("method", METHODS)
def test_both_methods_find_the_payload(method: str) -> None:
    found = sy.identify_team(trial().log, method)  # type: ignore[arg-type]
    assert isinstance(found, TeamEstimate)
    assert found.method == method
    assert found.mass == pytest.approx(12, abs=0.02)
    assert np.linalg.norm(found.com - trial().truth.body.com) < 0.004
    assert found.findings == ()


def test_a_method_that_is_none_is_refused() -> None:
    with pytest.raises(BadValue, match=r"method must be one of joint, paper; got 'best'."):
        identify_team(trial().log, "best")  # type: ignore[arg-type]


def with_gap(log: TeamLog, begin: int, end: int) -> TeamLog:
    """Return the log without the force of robot1 in these rows of the last recording."""
    *others, motion = log.recordings
    track = motion.tracks["robot1"]
    force = np.array(track.channels["force"])
    force[begin:end] = np.nan
    cut = Track.of(track.time, rotation=track.channels["rotation"], position=track.channels["position"], force=force)
    return log.with_recordings(*others, TeamRecording("motion", {**motion.tracks, "robot1": cut}, motion.name))


@pytest.mark.parametrize("method", METHODS)
def test_missing_rows_are_said_and_cost_only_their_data(method: str) -> None:
    whole, cut = (identify_team(log, method) for log in (trial().log, with_gap(trial().log, 400, 700)))  # type: ignore[arg-type]
    (said,) = [f for f in cut.findings if f.code == "rows-missing"]
    assert said.message == "'robot1' lacks numbers in 300 of 1500 rows of 'motion-5' (force)."
    # Poses are whole, so the grasps are what they were; the payload is as well known as the other rows allow.
    for name, grasp in whole.grasps.items():
        np.testing.assert_allclose(cut.grasps[name].pose.position, grasp.pose.position, atol=2e-5)
    moments = trial().truth.moments
    assert cut.principal_moments is not None
    np.testing.assert_allclose(cut.principal_moments, moments, rtol=0.03)


@pytest.mark.parametrize(("begin", "end"), [(0, 2), (1498, 1500)])
def test_streams_need_not_begin_and_end_together(begin: int, end: int) -> None:
    assert "rows-missing" not in identify_team(with_gap(trial().log, begin, end)).codes()


def of_rows(log: TeamLog, names: tuple[str, ...], rows: slice) -> TeamLog:
    """Return the log with some rows only of some robots in the last recording."""
    *others, motion = log.recordings
    tracks = {name: track.rows(rows) if name in names else track for name, track in motion.tracks.items()}
    return log.with_recordings(*others, replace(motion, tracks=tracks))


@pytest.mark.parametrize("method", METHODS)
def test_a_robot_that_ends_early_is_said(method: Method) -> None:
    found = identify_team(of_rows(trial().log, ("robot1",), slice(0, 600)), method)
    (said,) = [f for f in found.findings if f.code == "rows-missing"]
    others = "of 'motion-5' that the others have, and nothing was used of them"
    assert said.message == f"'robot1' lacks 9 of the 15 s {others}."


def test_a_recording_of_one_robot_in_a_few_rows_is_said() -> None:
    (said,) = missing_rows(of_rows(trial().log, ("robot2",), slice(700, 708)))
    assert said.message.startswith("'robot2' lacks 14.9 of the 15 s of 'motion-5' that")


@pytest.mark.parametrize(
    ("names", "rows"),
    [(("robot1",), slice(0, 1300)), (("robot1",), slice(100, None)), (("robot0", "robot1"), slice(0, 600))],
)
def test_loggers_need_not_start_and_end_together(names: tuple[str, ...], rows: slice) -> None:
    assert not list(missing_rows(of_rows(trial().log, names, rows)))


@pytest.mark.parametrize(("rows", "said"), [(130, 0), (80, 1)])
def test_what_is_lost_of_a_short_recording_is_said_from_a_second_on(rows: int, said: int) -> None:
    brief = of_rows(trial().log, trial().log.names, slice(0, 200))
    assert len(list(missing_rows(of_rows(brief, ("robot1",), slice(0, rows))))) == said


def without(log: TeamLog, number: int, name: str, *channels: str) -> TeamLog:
    """Return the log without one robot's channels in one recording, or without its track where none are named."""
    recordings = list(log.recordings)
    tracks = dict(recordings[number].tracks)
    track = tracks.pop(name)
    if channels:
        tracks[name] = track.without(*channels)
    recordings[number] = replace(recordings[number], tracks=tracks)
    return log.with_recordings(*recordings)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("channels", "lacks"), [((), "recording"), (("force",), "force")])
def test_a_recording_that_a_robot_lacks_is_said(method: Method, channels: tuple[str, ...], lacks: str) -> None:
    log = without(trial().log, 2, "robot1", *channels)
    rows = len(trial().log.recordings[2].tracks["robot1"])
    found = identify_team(log, method)
    (said,) = [f for f in found.findings if f.code == "rows-missing"]
    assert said.message.startswith(f"'robot1' has no {lacks} of 'still-2': {rows} rows tell nothing of mass, centre")
    assert found.evidence.samples <= identify_team(trial().log, method).evidence.samples - rows


@pytest.mark.parametrize("method", METHODS)
def test_who_was_away_or_held_nothing_lacks_nothing(method: Method) -> None:
    log = without(trial().log, 2, "robot1")
    away = replace(log.recordings[2], away=frozenset({"robot1"}))
    recordings = (*log.recordings[:2], away, *log.recordings[3:])
    found = identify_team(log.with_recordings(*recordings), method)
    assert "rows-missing" not in found.codes()
    log = without(trial().log, 2, "robot1", "force")
    track = log.recordings[2].tracks["robot1"]
    idle = replace(track, carrying=np.zeros(len(track), np.bool_))
    free = replace(log.recordings[2], tracks={**log.recordings[2].tracks, "robot1": idle})
    alone = log.with_recordings(free)
    assert "rows-missing" not in {f.code for f in missing_wrenches(alone, _weighing(alone, method))}
    # Nobody's force is missing where nobody's was to be measured.
    for name in log.names:
        log = without(log, 0, name, "force") if log.recordings[0].tracks[name].has("force") else log
    assert {f.message.split("'")[3] for f in missing_wrenches(log, _weighing(log, method))} == {"still-2"}


@pytest.mark.parametrize("method", METHODS)
def test_no_forces_no_payload(method: str) -> None:
    log = trial().log
    bare = [TeamRecording(r.kind, {n: t.without("force") for n, t in r.tracks.items()}, r.name) for r in log.recordings]
    with pytest.raises(CannotAnswer, match="no robot of the team measured a force"):
        identify_team(log.with_recordings(*bare), method)  # type: ignore[arg-type]


def test_rows_that_are_not_there_are_said_once_for_each_robot() -> None:
    rng = np.random.default_rng(0)
    log = trial().log
    lossy = [
        replace(
            r, tracks={**r.tracks, "robot1": r.tracks["robot1"].rows(rng.uniform(size=len(r.tracks["robot1"])) > 0.25)}
        )
        for r in log.recordings
    ]
    found = identify_team(log.with_recordings(*lossy))
    (said,) = [f for f in found.findings if f.code == "rows-missing"]
    assert said.message.startswith("'robot1' lacks about 2")
    assert said.message.count("% of the rows of") == len(log.recordings)
    assert "rows-missing" not in identify_team(log).codes()


def test_rows_that_repeat_the_one_before_are_not_missing_as_well() -> None:
    *others, motion = trial().log.recordings
    track = motion.tracks["robot1"]
    for repeated, said in ((300, 0), (0, 1)):
        kept = replace(track.rows(np.arange(len(track)) % 5 > 0), repeated=repeated)
        log = trial().log.with_recordings(*others, replace(motion, tracks={**motion.tracks, "robot1": kept}))
        assert len(list(missing_rows(log))) == said


def test_where_nobody_else_has_rows_none_are_short() -> None:
    alone = without(without(trial().log, 4, "robot1"), 4, "robot2")
    assert len(alone.recordings[4].tracks) == 1
    assert not list(missing_rows(alone))


def test_a_channel_of_which_nothing_was_logged_is_said() -> None:
    (said,) = missing_rows(with_gap(trial().log, 0, 1500))
    assert said.message == "'robot1' lacks numbers in 1500 of 1500 rows of 'motion-5' (force)."


def test_stamps_in_pairs_lack_nothing() -> None:
    log = trial().log
    uneven = [
        replace(r, tracks={n: replace(t, time=t.time + 4e-3 * (np.arange(len(t)) % 2)) for n, t in r.tracks.items()})
        for r in log.recordings
    ]
    assert not list(missing_rows(log.with_recordings(*uneven)))
