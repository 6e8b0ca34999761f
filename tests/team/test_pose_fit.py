"""Laws of the joint fit of grasps from poses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.spatial import Pose, Rotation
from steelyard.team.adjoint import adjoint, adjoint_inverse, exp, log
from steelyard.team.poses.fit import ROUGHLY, PoseFit, Rows, fit_poses
from steelyard.team.poses.measured import TeamMotion, first_team

NAMES = ("a", "b", "c", "d")


def sines(rng: np.random.Generator, rows: int, largest: float) -> Array:
    """A sum of five sines of 0.1 to 0.7 Hz at 100 Hz."""
    f, phase = rng.uniform(0.1, 0.7, 5), rng.uniform(0, 2 * np.pi, 5)
    s = (rng.uniform(0.5, 1, 5) / np.sqrt(f) * np.sin(2 * np.pi * np.outer(np.arange(rows) * 0.01, f) + phase)).sum(1)
    return np.asarray(s * largest / np.abs(s).max())


def trial(
    seed: int, count: int = 3, rows: int = 600, noise: float = 3e-4, turn: Array | None = None, go: Array | None = None
) -> tuple[TeamMotion, Pose]:
    """Poses of a team with white noise [rad, m], and the true grasps in that of robot 0."""
    rng = np.random.default_rng(seed)
    axes = np.eye(3) if turn is None else turn
    ways = np.eye(3) if go is None else go
    rotation = sum((np.outer(sines(rng, rows, 0.14), a) for a in axes), np.zeros((rows, 3)))
    position = sum((np.outer(sines(rng, rows, 0.03), a) for a in ways), np.zeros((rows, 3)))
    X = Pose(Rotation.exp(rotation), position)
    a = 2 * np.pi * np.arange(count) / count + 0.3
    place = np.stack([0.8 * np.cos(a), 0.64 * np.sin(a), rng.normal(-0.1, 0.05, count)], axis=1)
    grasps = Pose(Rotation.exp(rng.normal(0, 0.3, (count, 3))), place)
    homes = Pose(Rotation.exp(rng.normal(0, 1.0, (count, 3))), place + rng.normal(0, 0.1, (count, 3)))
    poses = homes[None, :].inverse() @ X[:, None] @ grasps[None, :]
    measured = poses @ exp(rng.normal(0, noise, (rows, count, 6))) if noise else poses
    return TeamMotion(measured, np.ones((rows, count), np.bool_)), grasps[0].inverse() @ grasps


def found(data: TeamMotion) -> PoseFit:
    return fit_poses(data, first_team(data, 0, NAMES), 0)


def test_adjoints_move_twists() -> None:
    rng = np.random.default_rng(0)
    X = Pose(Rotation.exp(rng.normal(size=(4, 3))), rng.normal(size=(4, 3)))
    np.testing.assert_allclose(adjoint(X) @ adjoint_inverse(X), np.broadcast_to(np.eye(6), (4, 6, 6)), atol=1e-14)
    np.testing.assert_allclose(adjoint(X.inverse()), adjoint_inverse(X), atol=1e-14)
    step = rng.normal(0, 1e-6, (4, 6))
    np.testing.assert_allclose(
        log(X @ exp(step) @ X.inverse()), np.einsum("nij,nj->ni", adjoint(X), step), rtol=1e-4, atol=1e-11
    )


@pytest.mark.parametrize("count", [2, 3, 5])
def test_exact_poses_give_exact_grasps(count: int) -> None:
    data, truth = trial(1, count, noise=0.0)
    names = tuple("abcde")[:count]
    fit = fit_poses(data, first_team(data, 0, names), 0)
    np.testing.assert_allclose(log(truth.inverse() @ fit.team.grasps), 0, atol=1e-9)
    assert not fit.solved.lost.size


def test_errors_are_of_the_size_that_the_covariance_says() -> None:
    scores = []
    for seed in range(30):
        data, truth = trial(seed)
        fit = found(data)
        std = np.sqrt(np.diag(fit.solved.inverse)).reshape(2, -1)[:, :6]
        scores.append(log(truth.inverse() @ fit.team.grasps)[1:] / std)
        np.testing.assert_allclose(fit.noise, 3e-4, rtol=0.1)
    assert 0.85 < np.sqrt(np.mean(np.square(scores))) < 1.15


# Axes of rotation, directions of translation, and how many directions per grasp the motion does not show.
X, Y, Z = np.eye(3)
RANKS = {
    "general": ([X, Y, Z], [X, Y, Z], 0),
    "two axes": ([X, Y], [X, Y, Z], 0),
    "ball joint": ([X, Y, Z], [], 0),
    "one axis": ([Z], [X, Y, Z], 1),
    "planar": ([Z], [X, Y], 1),
    "pivot": ([Z], [], 2),
    "translation": ([], [X, Y, Z], 3),
    "one direction": ([], [X], 4),
}


@pytest.mark.parametrize("motion", RANKS)
def test_what_a_motion_does_not_show_is_counted_and_the_rest_is_right(motion: str) -> None:
    turn, go, lost = RANKS[motion]
    data, truth = trial(3, turn=np.array(turn).reshape(-1, 3), go=np.array(go).reshape(-1, 3), noise=1e-5)
    fit = found(data)
    assert fit.solved.lost.shape[1] == 2 * lost
    error = log(truth.inverse() @ fit.team.grasps)[1:].ravel()
    blind = fit.solved.lost.reshape(2, -1, 2 * lost)[:, :6].reshape(12, -1) if lost else np.zeros((12, 0))
    if motion in ("one axis", "planar"):  # the position along the axis only, the same line for every error
        basis = np.linalg.qr(blind)[0]
        error = error - basis @ (basis.T @ error)
    if motion in ("general", "two axes", "ball joint", "one axis", "planar"):
        assert np.abs(error).max() < 2e-3


def test_rows_without_a_robot_cost_no_more_than_their_data() -> None:
    data, truth = trial(5, count=4, rows=800)
    valid = data.valid.copy()
    valid[400:, 3] = False
    valid[np.random.default_rng(0).random(800) < 0.2, 1] = False
    spoilt = data.poses.position.copy()
    spoilt[~valid] = 7.0
    fit = found(TeamMotion(Pose(data.poses.rotation, spoilt), valid))
    error = log(truth.inverse() @ fit.team.grasps)[1:]
    std = np.sqrt(np.diag(fit.solved.inverse)).reshape(3, -1)[:, :6]
    assert np.abs(error / std).max() < 4.5
    assert np.abs(error[:, 3:]).max() < 2e-3


def test_relabelling_robots_relabels_the_answer() -> None:
    data, _ = trial(6, count=4)
    order = np.array([0, 3, 1, 2])
    first = found(data)
    second = found(TeamMotion(data.poses[:, order], data.valid[:, order]))
    np.testing.assert_allclose(log(first.team.grasps[order].inverse() @ second.team.grasps), 0, atol=1e-7)


def test_robots_that_never_met_are_named() -> None:
    data, _ = trial(7, rows=100)
    valid = data.valid.copy()
    valid[:50, 1] = False
    valid[50:, 0] = False
    with pytest.raises(CannotAnswer, match="robots 'a' and 'b' have 0 rows in common"):
        first_team(TeamMotion(data.poses, valid), 0, NAMES)


@pytest.mark.parametrize("axes", [3, 1])
def test_every_robot_starts_as_it_would_alone_with_the_reference(axes: int) -> None:
    data, _ = trial(8, 4, turn=np.eye(3)[:axes])
    valid = data.valid.copy()
    valid[::3, 2] = False
    together = first_team(TeamMotion(data.poses, valid), 0, NAMES)
    for i in (1, 2, 3):
        pair = first_team(TeamMotion(data.poses[:, [0, i]], valid[:, [0, i]]), 0, NAMES)
        for one, two in ((together.grasps, pair.grasps), (together.homes, pair.homes)):
            np.testing.assert_allclose(log(one[i].inverse() @ two[1]), 0, atol=1e-9)


def test_where_the_fit_starts_does_not_move_the_optimum() -> None:
    data, _ = trial(9, 4)
    few = data.rows(slice(None, None, 4))
    rough = fit_poses(few, first_team(few, 0, NAMES), 0, close=ROUGHLY)
    seen = replace(rough.team, motion=data.motion_seen(rough.team.grasps, rough.team.homes))
    start = Rows.settled(data, seen, rough.noise, 2).team
    first, second = found(data), fit_poses(data, start, 0, rough.noise)
    deviation = np.sqrt(np.diag(first.solved.inverse)[first.unknown % 13 < 6]).reshape(-1, 6)
    np.testing.assert_array_less(np.abs(log(first.team.grasps.inverse() @ second.team.grasps)[1:]), 1e-6 * deviation)
