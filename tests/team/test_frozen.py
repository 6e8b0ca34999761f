"""A driver that repeats a robot's last wrench for a while: named, and left out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_teams import NOISY

from steelyard.logs.team_log import TeamLog
from steelyard.pipelines.shared_payload import identify_team
from steelyard.simulate.team import simulate_team
from steelyard.simulate.team_cases import TeamScene


def held(log: TeamLog, name: str, first: int, last: int) -> TeamLog:
    """The log with one robot's wrench in its only recording held from a row to another."""
    (recording,) = log.recordings
    track = recording.tracks[name]
    rows = np.arange(len(track))
    rows[first:last] = first
    channels = {c: v[rows] if c in ("force", "torque") else v for c, v in track.channels.items()}
    return log.with_recordings(replace(recording, tracks={**recording.tracks, name: replace(track, channels=channels)}))


@pytest.mark.parametrize(("first", "last"), [(700, 1000), (2400, 3000), (900, 2100)])
def test_a_wrench_that_stands_still_for_a_while_is_left_out(first: int, last: int) -> None:
    scene = TeamScene(NOISY, 3, kinds=("motion",), motion_samples=3000, sensing="poses", six_axis=frozenset({0}))
    for seed in range(2):
        made = simulate_team(scene, seed)
        found = identify_team(held(made.log, "robot1", first, last))
        assert found.codes() <= {"channel-stuck", "rows-missing"}
        said = next(f.message for f in found.findings if f.code == "channel-stuck")
        assert f"of 'robot1' stands still in {last - first} of 3000 rows" in said
        assert np.abs((found.parameters.people - made.truth.body.people) / found.std).max() < 4.5


def test_coarse_forces_at_rest_are_not_frozen() -> None:
    made = simulate_team(TeamScene(NOISY, 3, kinds=("motion",), motion_samples=2000, sensing="poses"), 1)
    (recording,) = made.log.recordings
    tracks = {
        n: replace(t, channels={**t.channels, "force": np.round(t.channels["force"])})
        for n, t in recording.tracks.items()
    }
    assert "channel-stuck" not in identify_team(made.log.with_recordings(replace(recording, tracks=tracks))).codes()
