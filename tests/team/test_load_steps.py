"""A payload on which something is laid in mid-recording, or from which something is taken, is told and weighed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_teams import NOISY_TWISTS, trial

from steelyard.logs.team_log import TeamLog
from steelyard.simulate.team import TeamTrial, simulate_team
from steelyard.simulate.team_cases import GRAVITY, case
from steelyard.team.estimate import TeamEstimate
from steelyard.team.joint import JointTeam

MOTION = {"motion_samples": 3000}
LOADED = {"load-changed", "contact"}
TWISTS = {"sensing": "twists", "bases_move": True, "noise": NOISY_TWISTS, **MOTION}


def loaded(made: TeamTrial, kg: float, since: float, until: float = np.inf) -> TeamLog:
    """The log with a weight at the middle of the grasps between two times of the motion; all bear it alike."""
    recording, tracks = made.log.recordings[-1], {}
    for name, track in made.log.recordings[-1].tracks.items():
        time = track.time - track.time[0]
        down = track.channels.get("gravity")
        if down is None:
            down = track.rotation.inverse().apply(np.array([0.0, 0.0, -GRAVITY]))
        share = np.where((time >= since) & (time < until), kg / len(made.log.names), 0.0)
        felt = track.channels["force"] - share[:, None] * down
        tracks[name] = replace(track, channels={**track.channels, "force": felt})
    return made.log.with_recordings(*made.log.recordings[:-1], replace(recording, tracks=tracks))


def said(found: TeamEstimate) -> str:
    (text,) = [finding.message for finding in found.findings if finding.code in LOADED]
    return text


def off(found: TeamEstimate, made: TeamTrial) -> float:
    error = np.append(found.mass, found.com) - np.append(made.truth.body.mass, made.truth.body.com)
    return float(np.abs(error / found.std[:4]).max())


@pytest.mark.parametrize("kg", [1.3, -2.0])
@pytest.mark.parametrize("scene", [MOTION, {"robots": 2, **MOTION}, TWISTS], ids=["poses", "two", "twists"])
def test_a_load_that_changes_in_a_motion_is_told_and_left_out(scene: dict[str, object], kg: float) -> None:
    made = trial(**scene)  # type: ignore[arg-type]
    found = JointTeam().identify(loaded(made, kg, since=17.0))
    text = said(found)
    assert float(text.split("From ")[1].split(" s of")[0]) == pytest.approx(17.0, abs=0.6)
    newtons, which = text.split("robots bear ")[1].split(" than")[0].split(" N ")
    assert float(newtons) == pytest.approx(GRAVITY * abs(kg), rel=0.1)
    assert which == ("more" if kg > 0 else "less")
    assert found.codes() & LOADED == {"load-changed" if kg > 0 else "contact"}
    assert "wrench-unexplained" not in found.codes()
    assert off(found, made) < 4


@pytest.mark.parametrize("share", [0.37, -0.2])
def test_a_load_that_makes_a_sign_look_flipped_is_a_load(share: float) -> None:
    made = trial(robots=2, kinds=("motion",), **TWISTS)  # type: ignore[arg-type]
    found = JointTeam().identify(loaded(made, share * made.truth.body.mass, since=18.0))
    assert found.codes() & LOADED
    assert "wrench-sign-flipped" not in found.codes()
    assert off(found, made) < 4


def test_what_the_other_recordings_weigh_is_the_payload_though_it_is_the_shorter_part() -> None:
    made = trial(kinds=("still", "motion"), **MOTION)
    found = JointTeam().identify(loaded(made, 1.3, since=0.0, until=17.0))
    assert said(found).startswith("Up to ")
    assert off(found, made) < 4


def test_without_other_recordings_the_longer_part_is_the_payload() -> None:
    made = trial(kinds=("motion",), **MOTION)
    found = JointTeam().identify(loaded(made, 1.3, since=17.0))
    assert said(found).startswith("From ")
    assert off(found, made) < 4


# Along the weight a jump is told from a load by its moment alone: it does not turn with gravity.
@pytest.mark.parametrize("jump", [(0.0, 8.0, -9.0), (0.0, 0.0, 15.0)])
def test_a_sensor_whose_bias_jumps_is_no_load(jump: tuple[float, float, float]) -> None:
    made = trial(**MOTION)
    recording, name = made.log.recordings[-1], "robot1"
    track = recording.tracks[name]
    later = (track.time - track.time[0] > 14.0)[:, None]
    felt = track.channels["force"] + later * np.array(jump)
    moved = replace(track, channels={**track.channels, "force": felt})
    log = made.log.with_recordings(
        *made.log.recordings[:-1], replace(recording, tracks={**recording.tracks, name: moved})
    )
    assert not LOADED & JointTeam().identify(log).codes()


@pytest.mark.parametrize("name", ["A", "C", "D"])
def test_sound_logs_carry_one_load(name: str) -> None:
    for seed in range(3):
        assert not LOADED & JointTeam().identify(simulate_team(case(name), seed).log).codes()
