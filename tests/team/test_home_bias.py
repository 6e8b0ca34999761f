"""Biases of forces that are measured below a gimbal keep their direction in the room and look like weight."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from steelyard.check import Array
from steelyard.logs.team_log import TeamLog
from steelyard.simulate.team import TeamTrial, simulate_team
from steelyard.simulate.team_cases import CASES, TeamNoise, TeamScene, case
from steelyard.team.estimate import TeamEstimate
from steelyard.team.joint import JointTeam
from steelyard.team.payload.home_bias import home_levers

NOTE = "in the axes of their homes"
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


@pytest.mark.parametrize("name", ["A", "C"])
@pytest.mark.parametrize("size", [0.1, 0.5])
def test_it_is_in_the_bars_and_said(name: str, size: float) -> None:
    errors = []
    for seed in range(4):
        trial = simulate_team(case(name), seed)
        found = JointTeam().identify(biased(trial, size, seed))
        assert any(NOTE in note for note in found.notes)
        errors.append(off(found, trial))
    assert np.sqrt(np.mean(np.square(errors))) < 1.6
    assert np.abs(errors).max() < 4


def test_without_it_the_answer_is_as_before(monkeypatch: pytest.MonkeyPatch) -> None:
    trial = simulate_team(case("A"), 1)
    found = JointTeam().identify(trial.log)
    assert not any(NOTE in note for note in found.notes)
    monkeypatch.setattr("steelyard.team.weighed.with_home_bias", lambda fit, *_: (fit, 0.0))
    assert np.array_equal(JointTeam().identify(trial.log).covariance, found.covariance)


def test_six_axis_wrists_have_none() -> None:
    noise = replace(CASES["A"], pose_rad=1e-4, pose_m=1e-4, torque_white_Nm=0.02)
    scene = TeamScene(noise, 3, sensing="poses", six_axis=frozenset({0, 1, 2}), motion_samples=1500)
    trial = simulate_team(scene, 0)
    assert not any(NOTE in note for note in JointTeam().identify(biased(trial, 0.5, 0)).notes)


def test_where_bases_move_up_alone_is_known() -> None:
    errors = []
    for seed in range(4):
        trial = simulate_team(TeamScene(TWISTS, sensing="twists", bases_move=True), seed)
        found = JointTeam().identify(biased(trial, 1.0, seed))
        assert any(NOTE in note for note in found.notes)
        errors.append(off(found, trial)[0])
    assert np.abs(errors).max() < 3


def test_levers_make_the_wrench_of_biases_at_the_grasps() -> None:
    rng = np.random.default_rng(0)
    for count, spanned in ((2, 2), (3, 3), (6, 4)):
        places, bias = rng.normal(size=(2, count, 3))
        levers = home_levers(places, 3)
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
