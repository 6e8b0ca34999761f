"""The team bench's events: one of each, and that what is told to the oracle is true."""

from __future__ import annotations

import numpy as np

from steelyard.bench.teams import events, troubles
from steelyard.bench.teams.table import _events, _troubles
from steelyard.simulate.team import simulate_team
from steelyard.simulate.team_cases import Presence, TeamNoise, TeamScene


def test_one_of_each_event_and_its_lines() -> None:
    found = events.run(1, 1, 1)
    late = found["late_clock"]
    assert late["offset_error_ms"]["worst"] < 0.5
    assert late["ratio_without"] > 2 * late["ratio_clocks"]
    hits = {name: (s["found"], s["false"]) for name, s in found["slips"].items()}
    assert hits == {"B": (1, 0), "C": (1, 0), "twists": (1, 0)}
    assert found["leaving"]["named"] == found["leaving_twists"]["named"] == 1
    lines = "\n".join(_events(found))
    assert "1 of 1 found within 0.3 s, 0 false alarms" in lines
    assert "one of 4 leaves at half: named in 1 of 1" in lines


def test_one_of_each_trouble_and_its_line() -> None:
    found = troubles.run(1, 1)
    for name in troubles.TROUBLES:
        told = found[name]
        assert (told["named"], told["false"]) == (1, 0), name
        assert told["position_mm"]["spoilt"] < 3 * told["position_mm"]["sound"], name
        assert told["mass_pct"]["spoilt"] < 0.1, name
    lines = _troubles(found)
    assert len(lines) == len(troubles.TROUBLES)
    assert lines[0].startswith("clock set anew: named in 1 of 1, falsely in 0; with it (without): position_mm ")


def test_the_told_log_has_no_poses_of_the_robot_that_left() -> None:
    scene = TeamScene(TeamNoise(), 4, "poses", motion_samples=600, presence=(Presence(events.LEAVER, leaves=3.0),))
    made = simulate_team(scene, 1)
    track = events.told(made).recordings[-1].tracks["robot2"]
    holds = made.truth.holds[:, 2]
    assert 250 < holds.sum() < 350
    np.testing.assert_array_equal(track.carrying, holds)
    np.testing.assert_array_equal(track.valid["position"], holds)
    assert track.valid["force"].all()
