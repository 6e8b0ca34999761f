"""Grasps that yield to what they push: told with their stiffness, poses put right; stiff grasps are left alone."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import made_teams
import numpy as np
import pytest

from steelyard.errors import BadValue, CannotAnswer
from steelyard.logs.team_log import TeamLog
from steelyard.simulate.team import TeamTrial, simulate_team
from steelyard.simulate.team_cases import CASES, TeamScene
from steelyard.team.estimate import TeamEstimate
from steelyard.team.joint import JointTeam
from steelyard.team.poses.team import PoseTeam
from steelyard.team.poses.yielding import stiffened

NOISY = replace(made_teams.NOISY, torque_white_Nm=0.1)
ALL = frozenset({0, 1, 2})


def trial(stiffness: tuple[float, float] | None, seed: int = 700, **changes: Any) -> TeamTrial:
    usual: dict[str, Any] = {"noise": NOISY, "kinds": made_teams.ALL_KINDS, "six_axis": ALL, "motion_samples": 2500}
    return made_teams.trial(seed=seed, stiffness=stiffness, **(usual | changes))


def off(found: TeamEstimate, made: TeamTrial) -> tuple[float, float, float]:
    """Return how far off grasps are (rms) [m], and in bars, and the centre of mass in bars."""
    error = np.array(
        [found.grasps[n].pose.position - made.truth.grasps.position[i] for i, n in enumerate(made.log.names) if i]
    )
    bars = np.array([found.grasps[n].std_m for n in made.log.names[1:]])
    com = (found.com - made.truth.body.com) / found.std[1:4]
    return float(np.sqrt((error**2).mean())), float(np.sqrt(((error / bars) ** 2).mean())), float(np.abs(com).max())


@pytest.mark.parametrize("stiffness", [(3e5, 1e4), (1e5, 3e3), (3e4, 1e3)])
def test_a_grasp_that_yields_is_named_with_its_stiffness_and_put_right(stiffness: tuple[float, float]) -> None:
    made = trial(stiffness)
    found, rigid = JointTeam().identify(made.log), trial(None)
    said = [f for f in found.findings if f.code == "grasp-yields"]
    assert [f.message.split("'")[1] for f in said] == list(made.log.names)
    for finding in said:
        turn = float(finding.message.split(" N m/rad")[0].split(" by about ")[1].split(" and ")[-1].replace(" ", ""))
        assert turn == pytest.approx(stiffness[1], rel=0.1)
    right = off(JointTeam().identify(rigid.log), rigid)
    now = off(found, made)
    assert now[0] < 3 * right[0]
    assert now[1] < 2.5
    assert now[2] < 4


def test_what_it_costs_to_take_them_as_rigid(monkeypatch: pytest.MonkeyPatch) -> None:
    """So that the test above cannot pass for want of an effect."""
    made = trial((1e5, 3e3))
    now = off(JointTeam().identify(made.log), made)
    monkeypatch.setattr("steelyard.team.poses.yielding.SUSPECT", np.inf)
    before = off(JointTeam().identify(made.log), made)
    assert before[0] > 10 * now[0]
    assert before[1] > 3


def test_bars_hold_a_sensor_that_was_tared_under_load() -> None:
    """Its grasp is told as it is where the sensor reads nothing."""
    made = trial((6e4, 2e3), seed=703)
    first = made.log.recordings[0].tracks["robot1"].channels["force"][0]
    recordings = []
    for recording in made.log.recordings:
        track = recording.tracks["robot1"]
        tared = replace(track, channels={**track.channels, "force": track.channels["force"] - first})
        recordings.append(replace(recording, tracks={**recording.tracks, "robot1": tared}))
    found = JointTeam().identify(made.log.with_recordings(*recordings))
    assert found.mass == pytest.approx(made.truth.body.mass, abs=4 * found.std[0])
    assert off(found, made)[1] < 2.5
    assert "grasp-yields" in found.codes()


def test_passive_gimbals_yield_along_their_axes_only() -> None:
    made = trial((3e4, 1e3), noise=CASES["B"], sensing="joints", six_axis=frozenset())
    found = JointTeam().identify(made.log)
    said = [f.message for f in found.findings if f.code == "grasp-yields"]
    assert len(said) == 3
    assert not any("rad" in one for one in said)
    assert off(found, made)[1] < 2.5
    assert all(made.log.force_only(name) for name in made.log.names)


@pytest.mark.parametrize("case", CASES)
def test_stiff_grasps_are_left_alone(case: str) -> None:
    for seed in (11, 12):
        log = simulate_team(TeamScene(CASES[case], motion_samples=1500), seed).log
        assert "grasp-yields" not in JointTeam().identify(log).codes()


def test_a_fit_that_fails_once_it_is_put_right_stays_what_it_was() -> None:
    made = trial((1e5, 3e3))
    team = PoseTeam.of(made.log, True)

    def fails(_: TeamLog) -> PoseTeam:
        raise CannotAnswer

    log, kept, yields = stiffened(made.log, team, fails)
    assert log is made.log
    assert kept is team
    assert not yields.size.any()


def test_twists_of_soft_grasps_are_not_simulated() -> None:
    with pytest.raises(BadValue, match="with poses or joints"):
        trial((1e5, 3e3), sensing="twists")


def test_recordings_without_wrenches_do_not_bend_the_others() -> None:
    made = trial((3e4, 1e3))
    log = made.log
    first = log.recordings[0]
    assert first.kind == "grasp"
    bare = {n: t.without("force", "torque") for n, t in first.tracks.items()}
    found = JointTeam().identify(log.with_recordings(type(first)(first.kind, bare, first.name), *log.recordings[1:]))
    assert "grasp-slipped" not in found.codes()
    assert off(found, made)[1] < 2.5


def test_bars_of_turns_hold_a_tare_under_load() -> None:
    """A sensor that was tared under load says that a grasp yields from there, along its axes and about them."""
    for seed in (700, 701):
        made = trial((1e5, 1e3), seed)
        recordings = []
        for recording in made.log.recordings:
            track = recording.tracks["robot1"]
            zero = {c: track.channels[c] - made.log.recordings[0].tracks["robot1"].channels[c][:20].mean(0)
                    for c in ("force", "torque")}  # fmt: skip
            tracks = {**recording.tracks, "robot1": replace(track, channels={**track.channels, **zero})}
            recordings.append(replace(recording, tracks=tracks))
        found = JointTeam().identify(made.log.with_recordings(*recordings))
        grasp, true = found.grasps["robot1"], made.truth.grasps[1]
        turn = (true.rotation @ grasp.pose.rotation.inverse()).log()
        assert "grasp-yields" in found.codes()
        assert float(np.abs(turn / grasp.std[:3]).max()) < 4.5


@pytest.mark.parametrize("stiffness", [(1e5, 3e3), (2e4, 600.0)])
def test_poses_of_a_recording_without_wrenches_bend_no_grasps(stiffness: tuple[float, float]) -> None:
    """How far grasps yield there nobody knows: their mean load is another one."""
    made = trial(stiffness)
    bare = []
    for recording in made.log.recordings:
        tracks = dict(recording.tracks)
        if recording.kind == "grasp":
            for name, track in tracks.items():
                channels, valid = (
                    {key: each for key, each in both.items() if key not in ("force", "torque")}
                    for both in (track.channels, track.valid)
                )
                tracks[name] = replace(track, channels=channels, valid=valid)
        bare.append(replace(recording, tracks=tracks))
    found = JointTeam().identify(made.log.with_recordings(*bare))
    assert found.codes() == {"grasp-yields"}
    assert max(float(found.grasps[name].std_m.max()) for name in made.log.names) < 5e-4
    assert off(found, made)[1] < 2.5
