"""Biases of forces that are measured below a gimbal keep their direction in the room and look like weight."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from steelyard.check import Array
from steelyard.logs.team_log import TeamLog
from steelyard.logs.team_track import Track
from steelyard.simulate.team import TeamTrial, simulate_team
from steelyard.simulate.team_cases import TeamNoise, TeamScene, case
from steelyard.team.estimate import TeamEstimate
from steelyard.team.joint import JointTeam
from steelyard.team.payload.room_forces import room_levers

NOTE = "in the axes of the robots' homes"
TWISTS = TeamNoise(force_white_N=0.3, rate_rad_s=1e-3, velocity_m_s=5e-4)


def biased(trial: TeamTrial, size: float, seed: int) -> TeamLog:
    """The log with a bias of `size` [N] on every axis of every robot's home, up alone where bases move."""
    rng = np.random.default_rng(seed + 1000)
    bias = {name: size * rng.standard_normal(3) for name in trial.log.names}
    recordings = []
    for recording in trial.log.recordings:
        tracks = {}
        for name, track in recording.tracks.items():
            if "gravity" in track.channels:
                up = -track.channels["gravity"] / 9.81
                pull = bias[name][2] * up
            else:
                pull = np.einsum("tji,j->ti", track.channels["rotation"], bias[name])
            tracks[name] = replace(track, channels={**track.channels, "force": track.channels["force"] + pull})
        recordings.append(replace(recording, tracks=tracks))
    return trial.log.with_recordings(*recordings)


def off(found: TeamEstimate, trial: TeamTrial) -> Array:
    """Errors of mass and centre of mass (4,) in standard deviations."""
    error = np.append(found.mass, found.com) - np.append(trial.truth.body.mass, trial.truth.body.com)
    return np.asarray(error / found.std[:4])


def said(found: TeamEstimate) -> bool:
    """Whether the answer tells of such a force."""
    return any(NOTE in text for text in (*found.notes, *(one.message for one in found.findings)))


@pytest.mark.parametrize("name", ["A", "C"])
@pytest.mark.parametrize(("size", "least"), [(0.1, 6), (0.5, 8)])
def test_it_is_in_the_bars_and_said(name: str, size: float, least: int) -> None:
    errors, told = [], 0
    for seed in range(8):
        trial = simulate_team(case(name), seed)
        found = JointTeam().identify(biased(trial, size, seed))
        told += said(found)
        errors.append(off(found, trial))
    assert told >= least
    assert np.sqrt(np.mean(np.square(errors))) < 1.6
    assert np.abs(errors).max() < 4


def test_without_it_the_answer_is_as_before(monkeypatch: pytest.MonkeyPatch) -> None:
    trial = simulate_team(case("A"), 1)
    found = JointTeam().identify(trial.log)
    assert not said(found)
    monkeypatch.setattr("steelyard.team.weighed.with_room_forces", lambda fit, *_: (fit, 0.0))
    assert np.array_equal(JointTeam().identify(trial.log).covariance, found.covariance)


ARMS = TeamNoise(pose_rad=3e-4, pose_m=2e-4, force_white_N=0.5, torque_white_Nm=0.02)


def pulled(trial: TeamTrial, pull: Array) -> TeamLog:
    """The log in which robot1 measures a force [N] beside, in the axes of its home."""

    def beside(track: Track, force: Array) -> Track:
        turned = track.channels["force"] + force @ track.channels["rotation"]
        return replace(track, channels={**track.channels, "force": turned})

    return trial.log.with_recordings(*(r.changed(beside, {"robot1": pull}) for r in trial.log.recordings))


@pytest.mark.parametrize("pull", [[6.0, -4.0, 8.0], [0.0, 0.0, -25.0]], ids=["cable", "compensation"])
@pytest.mark.parametrize("six_axis", [True, False])
def test_what_pulls_one_robot_is_named_and_taken_out(pull: list[float], six_axis: bool) -> None:
    who = frozenset(range(4)) if six_axis else frozenset()
    scene = TeamScene(ARMS, 4, sensing="poses", six_axis=who, kinds=("still", "motion"), motion_samples=2000)
    for seed in (3, 4):
        trial = simulate_team(scene, seed)
        found = JointTeam().identify(pulled(trial, np.array(pull)))
        assert found.codes() & {"cable-force", "motion-mismatch"} == {"cable-force"}
        assert np.abs(off(found, trial)).max() < 2.5
        assert found.std[0] < 0.5
    assert not said(JointTeam().identify(trial.log))


def test_where_bases_move_up_alone_is_known() -> None:
    errors = []
    for seed in range(4):
        trial = simulate_team(TeamScene(TWISTS, sensing="twists", bases_move=True), seed)
        found = JointTeam().identify(biased(trial, 1.0, seed))
        assert said(found)
        errors.append(off(found, trial)[0])
    assert np.abs(errors).max() < 3


def test_levers_make_the_wrench_of_biases_at_the_grasps() -> None:
    rng = np.random.default_rng(0)
    for count, spanned in ((2, 2), (3, 3), (6, 4)):
        places, bias = rng.normal(size=(2, count, 3))
        levers = room_levers(places, 3)
        assert levers.shape == (3 * spanned, 6, 9)
        # Room and B have the same axes: c_k = e_k.
        columns = levers @ np.eye(3).reshape(9)
        wrench = np.concatenate([np.cross(places, bias).sum(0), bias.sum(0)])
        u = np.linalg.lstsq(columns.T, wrench, rcond=None)[0]
        assert columns.T @ u == pytest.approx(wrench, abs=1e-12)
        # Unit biases have the covariance of unit u.
        each = np.concatenate([np.cross(places[:, None], np.eye(3)), np.tile(np.eye(3), (count, 1, 1))], axis=2)
        flat = each.reshape(-1, 6)
        assert columns.T @ columns == pytest.approx(flat.T @ flat, abs=1e-12)
