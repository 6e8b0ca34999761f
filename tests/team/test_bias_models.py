"""Biases that last and biases drawn anew, integrated out: against dense matrices, and on simulated sessions."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from steelyard.simulate.team import TeamTrial, simulate_team
from steelyard.simulate.team_cases import TeamNoise, TeamScene
from steelyard.team.joint import JointTeam
from steelyard.team.payload import bias_models
from steelyard.team.payload.bias_models import Models, ladder_of
from steelyard.team.payload.model import Normal

QUIET = TeamNoise(pose_rad=3e-4, pose_m=2e-4, force_white_N=0.2, torque_white_Nm=0.02)
P, B, R = 10, 6, 3


def session(noise: TeamNoise, seed: int, **changes: Any) -> TeamTrial:
    scene: dict[str, Any] = {"sensing": "poses", "kinds": ("still", "motion"), "motion_samples": 1500} | changes
    return simulate_team(TeamScene(noise, 3, **scene), seed)


@pytest.mark.parametrize("size", [(0.3, 0.1, 0.0, 0.02), (0.3, 0.1, 0.02, 0.0), (1e-6, 0.1, 0.0, 0.0)])
def test_a_common_bias_is_eliminated_as_dense_matrices_do_it(size: tuple[float, ...]) -> None:
    rng = np.random.default_rng(1)
    rows = rng.normal(size=(R, 60, P + B))
    pushed = rng.normal(size=(R, 60))
    pulls = rng.normal(size=(R, B, 9)) + 3
    C = np.diag(rng.uniform(1, 2, B))
    normals = [
        Normal(A.T @ A, A.T @ y, np.zeros((P, P)), float(y @ y), U) for A, y, U in zip(rows, pushed, pulls, strict=True)
    ]
    models = Models.of(normals, C, np.array([size]), np.ones(P))
    common, own, anew, lasting = np.square(size)
    mean = pulls.mean(0)
    prior = np.kron(np.ones((R, R)), common * C + lasting * mean @ mean.T)
    for r in range(R):
        at = slice(B * r, B * r + B)
        off = pulls[r] - mean
        prior[at, at] += own * C + anew * pulls[r] @ pulls[r].T + lasting * off @ off.T
    wide = np.zeros((R, 60, P + R * B))
    for r in range(R):
        wide[r, :, :P], wide[r, :, P + B * r : P + B * r + B] = rows[r, :, :P], rows[r, :, P:]
    A, y = wide.reshape(-1, P + R * B), pushed.reshape(-1)
    H = A.T @ A
    held = np.linalg.inv(H[P:, P:] + np.linalg.inv(prior))
    seen = H[:P, :P] - H[:P, P:] @ held @ H[P:, :P]
    noise = np.eye(len(y)) + A[:, P:] @ prior @ A[:, P:].T
    left = y - A[:, :P] @ models.phi[0]
    found = models.recordings(0)
    bias = np.array([found.solution(r)[P:] for r in range(R)]).reshape(-1)
    assert np.allclose(models.information[0], seen, rtol=1e-7)
    assert np.allclose(models.chi2[0], left @ np.linalg.solve(noise, left), rtol=1e-7)
    assert np.allclose(np.concatenate(found.blind, axis=1), H[:P, P:] @ held, atol=1e-8)
    assert np.allclose(bias, held @ A[:, P:].T @ left, atol=1e-7)
    assert np.allclose(found.inner[1], held[B : 2 * B, B : 2 * B], atol=1e-9)


def test_sizes_that_change_nothing_are_not_answered(monkeypatch: pytest.MonkeyPatch) -> None:
    log = session(replace(QUIET, force_bias_N=0.3), 100).log
    answered = []

    def counted(full: Any, noise: Any, right: Any) -> Any:
        answered.append(len(full))
        return answers(full, noise, right)

    answers = bias_models._answers
    monkeypatch.setattr(bias_models, "_answers", counted)
    some = JointTeam().identify(log)
    fewer = max(answered)
    monkeypatch.setattr(bias_models, "NOTHING", 0.0)
    every = JointTeam().identify(log)
    assert fewer < 0.3 * max(answered)
    assert np.allclose(some.parameters.vector, every.parameters.vector, rtol=1e-8, atol=1e-8)
    assert np.allclose(some.covariance, every.covariance, rtol=1e-4, atol=1e-12)


def test_one_recording_has_no_common_bias() -> None:
    alone, several = ladder_of(1, True), ladder_of(4, True)
    assert alone.shape == (91, 4)
    assert not alone[:, [0, 3]].any()
    assert not (several[:, 2:] > 0).all(1).any()


@pytest.mark.parametrize("kinds", [("still",), ("still", "motion")])
def test_a_bias_that_lasts_is_within_the_error_bars(kinds: tuple[str, ...]) -> None:
    noise = replace(QUIET, force_bias_N=0.5)
    z = []
    for seed in range(100, 106):
        found = JointTeam().identify(session(noise, seed, bias_per="session", kinds=kinds).log)
        z.append((found.mass - 12) / found.std[0])
        assert "common-gain-unseen" not in found.codes()
    assert np.sqrt(np.mean(np.square(z))) < 1.8


def test_a_bias_drawn_anew_is_no_gain() -> None:
    found = JointTeam().identify(session(replace(QUIET, force_bias_N=0.5), 100).log)
    assert "common-gain-unseen" not in found.codes()


@pytest.mark.parametrize("per", ["session", "recording"])
def test_gains_are_spoken_of_whether_they_last_or_not(per: str) -> None:
    found = JointTeam().identify(session(replace(QUIET, force_gain=0.03), 101, bias_per=per).log)
    assert "common-gain-unseen" in found.codes()
