"""Conditioning: twists of exact motion, gaps, ends, clocks that differ."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from steelyard.logs.team_conditioning import condition
from steelyard.logs.team_log import TeamLog, TeamRecording
from steelyard.logs.team_track import Track
from steelyard.simulate.team import simulate_team
from steelyard.simulate.team_cases import TeamScene

SCENE = TeamScene(sensing="poses", kinds=("grasp",))


def recorded(scene: TeamScene = SCENE, seed: int = 1) -> tuple[TeamLog, TeamRecording]:
    log = simulate_team(scene, seed).log
    return log, log.recordings[0]


def exact_twists(seed: int = 1) -> np.ndarray:
    log, recording = recorded(replace(SCENE, sensing="twists", bases_move=True), seed)
    return condition(log, recording, None).twist


@pytest.mark.parametrize(("cutoff", "largest"), [(None, 2e-4), (3.0, 5e-3)])
def test_twists_are_those_of_the_motion(cutoff: float | None, largest: float) -> None:
    rows = condition(*recorded(), cutoff)
    gap = np.abs(rows.twist - exact_twists())[rows.has_twist]
    assert gap.max() < largest  # rad/s and m/s; the motion reaches 0.3
    assert rows.has_twist.mean() > 0.95


def test_without_a_filter_only_the_outermost_rows_are_lost() -> None:
    rows = condition(*recorded(), None)
    assert np.flatnonzero(~rows.has_twist[0]).tolist() == [0, 999]
    assert np.flatnonzero(~rows.has_rate[0]).tolist() == [0, 1, 998, 999]


def test_the_ends_of_a_filter_are_not_measured() -> None:
    rows = condition(*recorded(), 3.0)
    lost = np.flatnonzero(~rows.has_twist[0])
    assert set(lost) == set(range(17)) | set(range(983, 1000))


def test_a_long_gap_spreads_and_a_short_one_does_not() -> None:
    log, recording = recorded()
    track = recording.tracks["robot1"]
    for missing, spread in (((400, 500), 16), ((400, 404), 0)):
        rotation = track.channels["rotation"].copy()
        rotation[slice(*missing)] = np.nan
        holed = Track.of(track.time, **{**track.channels, "rotation": rotation})
        made = replace(recording, tracks={**recording.tracks, "robot1": holed})
        lost = np.flatnonzero(~condition(log, made, 3.0).has_gravity[1])
        assert lost.min() == missing[0] - spread
        assert lost.max() == missing[1] - 1 + spread


def test_lost_rows_take_the_wrench_from_the_whole_team_and_twists_from_one() -> None:
    log, recording = recorded()
    track = recording.tracks["robot2"]
    force = track.channels["force"].copy()
    force[300:310] = np.nan
    holed = Track.of(track.time, **{**track.channels, "force": force})
    rows = condition(log, replace(recording, tracks={**recording.tracks, "robot2": holed}), None)
    assert np.flatnonzero(~rows.complete_wrench()).tolist() == list(range(300, 310))
    assert rows.has_twist[:, 300:310].all()


def test_clocks_that_differ_are_brought_onto_one() -> None:
    log, recording = recorded()
    track = recording.tracks["robot1"]
    sparse = replace(recording, tracks={**recording.tracks, "robot1": track.rows(np.arange(0, 1000, 2))})
    rows, whole = condition(log, sparse, None), condition(log, recording, None)
    both = rows.has_twist[1, : len(rows.time)] & whole.has_twist[1, : len(rows.time)]
    assert len(rows.time) == 999
    assert both.sum() > 900
    assert np.abs(rows.twist[1] - whole.twist[1, : len(rows.time)])[both].max() < 2e-3


def test_a_robot_without_a_track_is_missing_unless_it_is_away() -> None:
    log, recording = recorded(replace(SCENE, robots=4))
    three = {name: track for name, track in recording.tracks.items() if name != "robot3"}
    assert not condition(log, replace(recording, tracks=three), None).complete_wrench().any()
    away = replace(recording, tracks=three, away=frozenset({"robot3"}))
    assert condition(log, away, None).complete_wrench().all()
