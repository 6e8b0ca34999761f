"""Stamps of a team that jitter are evened where robots' motion says so; stamps that all but meet bend no curve."""

from __future__ import annotations

import numpy as np
from made_teams import trial

from steelyard.logs.curve import Curve
from steelyard.logs.team_log import TeamLog
from steelyard.logs.team_steady import with_steady_tracks
from steelyard.pipelines.shared_payload import identify_team


def jittering(log: TeamLog, seconds: float) -> TeamLog:
    """Return the log with rows of all robots stamped when they came, late by up to some `seconds`."""
    rng = np.random.default_rng(7)
    recordings = []
    for recording in log.recordings:
        late = {name: np.abs(rng.normal(0, seconds, len(track))) for name, track in recording.tracks.items()}
        recordings.append(recording.changed(lambda t, off: t.stamped(np.sort(t.time + off)), late))
    return log.with_recordings(*recordings)


def test_a_team_whose_stamps_jitter_answers_as_well() -> None:
    for seed in range(3):
        made = trial(seed=seed)
        found = identify_team(jittering(made.log, 0.004))
        assert not {"grasp-slipped", "contact", "grasp-direction-lost"} & found.codes()
        assert any("jitter" in note for note in found.notes)
        off = np.append(found.mass, found.com) - np.append(made.truth.body.mass, made.truth.body.com)
        assert np.abs(off / found.std[:4]).max() < 4


def test_stamps_that_are_right_stay() -> None:
    log = trial().log
    assert with_steady_tracks(log) == (log, ())


def test_the_published_method_takes_stamps_as_they_are() -> None:
    found = identify_team(jittering(trial().log, 0.004), "paper")
    assert not any("jitter" in note for note in found.notes)


def test_samples_that_all_but_meet_bend_no_curve() -> None:
    time = np.arange(40) * 0.01
    time[21] = time[20] + 1e-7
    values = np.sin(20 * time)[:, None] + 1e-3 * (-1.0) ** np.arange(40)[:, None]
    seen = Curve.through(time, values).at(np.linspace(0, time[-1], 2001))
    assert np.abs(seen[:, 0] - np.sin(20 * np.linspace(0, time[-1], 2001))).max() < 0.03
