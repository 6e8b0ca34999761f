"""Gravity that nobody states is in the bars of what it weighs, and only there."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import steelyard as sy
from steelyard.errors import BadValue
from steelyard.io import read_pendant, read_recording
from steelyard.io.recordings.description import default_gravity
from steelyard.io.recordings.recording_files import write_recording
from steelyard.io.teams.team_description import parse_team_description
from steelyard.logs.recording import ASSUMED_GRAVITY_STD, Recording
from steelyard.simulate import hammer
from steelyard.simulate.team import simulate_team
from steelyard.simulate.team_cases import CASES, TeamScene


def stated() -> Recording:
    return replace(hammer.recording().recording, gravity=default_gravity())


def test_bars_of_mass_hold_it_and_those_of_the_centre_do_not() -> None:
    known, assumed = (sy.identify(replace(stated(), gravity_std=std)) for std in (0.0, ASSUMED_GRAVITY_STD))
    np.testing.assert_array_equal(assumed.parameters.vector, known.parameters.vector)
    np.testing.assert_allclose(assumed.std[0], np.hypot(known.std[0], ASSUMED_GRAVITY_STD * known.mass), rtol=1e-9)
    np.testing.assert_allclose(assumed.std[1:4], known.std[1:4], rtol=1e-6)


def test_a_shape_lends_it_to_parts_and_second_moments() -> None:
    made = stated()
    known, assumed = (
        sy.identify(replace(made, gravity_std=std), parts=hammer.tool().parts) for std in (0.0, ASSUMED_GRAVITY_STD)
    )
    share = ASSUMED_GRAVITY_STD * known.parameters.vector
    np.testing.assert_allclose(assumed.covariance, known.covariance + np.outer(share, share), rtol=1e-9, atol=1e-18)
    masses = np.array([part.mass for part in known.parts])
    grown = [np.hypot(part.std, ASSUMED_GRAVITY_STD * part.mass) for part in known.parts]
    np.testing.assert_allclose([part.std for part in assumed.parts], grown, rtol=1e-9)
    assert known.part_covariance is not None
    assert assumed.part_covariance is not None
    more = ASSUMED_GRAVITY_STD**2 * np.outer(masses, masses)
    np.testing.assert_allclose(assumed.part_covariance - known.part_covariance, more, rtol=1e-6, atol=1e-15)


@pytest.mark.parametrize("gravity", [9.780, 9.832])
def test_the_bar_holds_gravity_from_the_equator_to_the_pole(gravity: float) -> None:
    lines = []
    for turn in ("0 0 0", "90 0 0", "180 0 0", "-90 0 0", "0 90 0", "0 -90 0"):
        down = sy.Rotation.from_rpy(np.radians(np.array(turn.split(), float))).inverse().apply([0.0, 0.0, -gravity])
        lines.append(f"{turn} {' '.join(f'{v:.9f}' for v in (*down, *np.cross([0.01, 0.02, 0.05], down)))}")
    found = sy.identify(read_pendant(lines))
    assert 0.5 < abs(found.mass - 1) / found.std[0] < 2
    assert any("9.80665 ± 0.015 m/s² along -z of the world was assumed" in note for note in found.notes)


def test_what_is_read_without_gravity_is_written_without(tmp_path: Path) -> None:
    said = write_recording(stated(), tmp_path / "said")
    assumed = replace(stated(), gravity_std=ASSUMED_GRAVITY_STD)
    path = write_recording(assumed, tmp_path / "unsaid")
    assert "gravity" not in path.read_text()
    assert read_recording(path).gravity_std == ASSUMED_GRAVITY_STD
    assert read_recording(said).gravity_std == 0
    with pytest.raises(BadValue, match="no words for how well gravity is known"):
        write_recording(replace(stated(), gravity_std=0.1), tmp_path / "odd")


@pytest.mark.parametrize("sign", [1, -1])
def test_a_sign_that_nothing_says_is_not_written_as_said_unless_it_was_found(tmp_path: Path, sign: int) -> None:
    path = write_recording(replace(stated(), wrench_sign=sign, sign_said=False), tmp_path / "unsaid")
    assert ("wrench " in path.read_text()) == (sign < 0)
    assert read_recording(path).wrench_sign == sign
    assert "wrench " in write_recording(stated(), tmp_path / "said").read_text()


def test_of_a_team_one_who_states_it_is_enough() -> None:
    turn = {"columns": ["qw", "qx", "qy", "qz"], "form": "quaternion-wxyz"}
    stream = {"path": "a.csv", "time": {"columns": ["t"]}, "rotation": turn}

    def std(*gravity: object) -> float:
        robots = [
            {"name": f"r{k}", "recording": [{"kind": "motion", "stream": [stream]}]}
            | ({} if value is None else {"gravity": value})
            for k, value in enumerate(gravity)
        ]
        return parse_team_description({"team": {}, "robot": robots}, "team.toml").gravity_std

    assert std(None, None) == ASSUMED_GRAVITY_STD
    assert std(None, "unknown") == ASSUMED_GRAVITY_STD
    assert std(None, [0, 0, -9.8]) == 0


def test_a_team_has_it_in_its_bars_and_says_so() -> None:
    log = simulate_team(TeamScene(CASES["A"], motion_samples=1500), 5).log
    known, assumed = (sy.identify_team(replace(log, gravity_std=std)) for std in (0.0, ASSUMED_GRAVITY_STD))
    np.testing.assert_allclose(assumed.std[0], np.hypot(known.std[0], ASSUMED_GRAVITY_STD * known.mass), rtol=1e-9)
    assert assumed.grasps.keys() == known.grasps.keys()
    (note,) = set(assumed.notes) - set(known.notes)
    assert note == "no robot gives gravity: 9.80665 m/s² along -z of level bases was assumed, ± 0.15%"
