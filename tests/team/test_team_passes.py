"""Compiled passes of the joint fit against what they replace, written out."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline, PchipInterpolator

from steelyard.bench.tables import block
from steelyard.bench.teams.table import _SCALE
from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.logs.curve import Curve
from steelyard.logs.team_track import Track
from steelyard.spatial import Pose, Rotation, cross_matrix
from steelyard.spatial.screws import log_pose
from steelyard.team.adjoint import (
    adjoint_inverse,
    exp,
    moved,
    turned_by,
    turning_speed,
    turns_between,
    twists_between,
)
from steelyard.team.changes.slips import alone, find_slip
from steelyard.team.definite import definite, inverses, logarithms
from steelyard.team.poses.noise import _scores
from steelyard.team.poses.rows import first_seen, held
from steelyard.team.poses.solver import SHOWN, Solver, features, pattern_information, scatter, unit
from steelyard.team.scores import Scores
from steelyard.team.stacked import Stretch


@pytest.mark.parametrize("rows", [4, 5, 300])
def test_the_cubic_is_that_of_scipy(rows: int) -> None:
    rng = np.random.default_rng(rows)
    known, values = np.cumsum(rng.uniform(0.5, 1.5, rows)), rng.normal(size=(rows, 4))
    time = rng.permutation(np.concatenate([known, rng.uniform(known[0], known[-1], 200)]))
    curve = Curve.through(known, values)
    assert curve.whole
    np.testing.assert_allclose(curve.at(time), CubicSpline(known, values)(time), atol=2e-14)


@pytest.mark.parametrize("rows", [4, 30, 300])
def test_in_a_gap_a_curve_is_monotone_and_beyond_its_ends_it_is_held(rows: int) -> None:
    rng = np.random.default_rng(rows)
    known, values = np.cumsum(rng.uniform(0.5, 1.5, rows)), rng.normal(size=(rows, 4))
    known[rows // 2 :] += 20.0
    ends = known[rows // 2 - 1 : rows // 2 + 1]
    curve = Curve.through(known, values)
    assert not curve.whole
    time = np.append(rng.uniform(*ends, 200), [known[0] - 5, known[-1] + 5])
    expected = PchipInterpolator(known, values)(np.clip(time, known[0], known[-1]))
    np.testing.assert_allclose(curve.at(time), expected, atol=2e-14)


def test_away_from_a_gap_a_curve_stays_cubic() -> None:
    known = np.concatenate([np.arange(0, 5, 0.1), np.arange(7, 12, 0.1)])
    time = np.arange(1, 4, 0.013)
    found = Curve.through(known, np.sin(3 * known)[:, None]).at(time)[:, 0]
    np.testing.assert_allclose(found, np.sin(3 * time), atol=1e-4)


@pytest.mark.parametrize("rows", [2, 3])
def test_few_samples_are_joined_by_a_monotone_curve(rows: int) -> None:
    known, values = np.arange(rows) + 0.0, np.random.default_rng(rows).normal(size=(rows, 2))
    time = np.linspace(-1, rows, 50)
    expected = PchipInterpolator(known, values)(np.clip(time, known[0], known[-1]))
    np.testing.assert_allclose(Curve.through(known, values).at(time), expected, atol=2e-14)


@pytest.mark.parametrize("size", [0.0, 1e-12, 1e-8, 1e-3, 0.02, 1.0, 3.0])
def test_turns_and_twists_between_poses(size: float) -> None:
    rng = np.random.default_rng(1)
    axes = rng.normal(size=(300, 3))
    turn = Rotation.exp(size * axes / np.linalg.norm(axes, axis=1, keepdims=True))
    A = Pose(Rotation.exp(rng.normal(size=(300, 3))), rng.normal(size=(300, 3)))
    B = Pose(A.rotation @ turn, rng.normal(size=(300, 3)))
    np.testing.assert_allclose(
        turns_between(A.rotation, B.rotation), (A.rotation.inverse() @ B.rotation).log(), atol=5e-15
    )
    one = A.rotation[0]
    np.testing.assert_allclose(turns_between(one, B.rotation), (one.inverse() @ B.rotation).log(), atol=1e-13)
    np.testing.assert_allclose(twists_between(A, B), log_pose(A.inverse() @ B), atol=2e-14)


@pytest.mark.parametrize("size", [0.0, 1e-9, 1e-4, 0.3, 3.0])
def test_turns_lead_where_they_say(size: float) -> None:
    rng = np.random.default_rng(4)
    one, turns = Rotation.exp(rng.normal(size=3)), rng.normal(0, size, (20, 3))
    led = turned_by(one, turns)
    np.testing.assert_allclose(led.matrix, (one @ Rotation.exp(turns[:, None])).matrix, atol=2e-15)
    steps = np.concatenate([turns, rng.normal(size=(20, 3))], axis=1)
    poses = Pose(Rotation.exp(rng.normal(size=(20, 3))), rng.normal(size=(20, 3)))
    np.testing.assert_allclose(moved(poses, steps).matrix(), (poses @ exp(steps)).matrix(), atol=5e-15)


def test_a_step_that_is_no_number_is_refused() -> None:
    with pytest.raises(BadValue, match="step"):
        moved(Pose.identity(2), np.full((2, 6), np.nan))


@pytest.mark.parametrize("size", [1, 6, 17])
def test_inverses_and_determinants_of_a_stack(size: int) -> None:
    root = np.random.default_rng(size).normal(size=(2, 3, size, 2 * size))
    stack = root @ root.swapaxes(-1, -2)
    # One that is not positive definite, and has an inverse all the same.
    stack[1, 2] = np.diag(np.r_[-2.0, np.ones(size - 1)])
    inverse, logdet = inverses(stack)
    np.testing.assert_allclose(inverse @ stack, np.broadcast_to(np.eye(size), stack.shape), atol=1e-10)
    np.testing.assert_allclose(logdet, np.linalg.slogdet(stack)[1], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(logarithms(stack[1]), logdet[1], rtol=1e-12, atol=1e-12)
    assert definite(stack[1]).tolist() == [True, True, False]
    with pytest.raises(np.linalg.LinAlgError):
        inverses(np.zeros((1, size, size)))


def test_scores_of_noise_from_six_columns() -> None:
    rng = np.random.default_rng(2)
    count = 4
    stack, root, variance = (
        rng.normal(size=(6 * count, 6)),
        rng.normal(size=(6 * count, 50)),
        rng.uniform(1, 9, 2 * count),
    )
    scatter, W = root @ root.T, np.repeat(1 / variance, 3)
    pulled = stack * W[:, None]
    lever = pulled @ np.linalg.inv(pulled.T @ stack)
    M = np.diag(W) - lever @ pulled.T
    seen, size, squares = np.empty(2 * count), np.empty(2 * count), np.empty((2 * count, 2 * count))
    _scores(scatter, variance, pulled, lever, seen, size, squares)
    np.testing.assert_allclose(seen, np.diag(M @ scatter @ M).reshape(-1, 3).sum(1), rtol=1e-11)
    np.testing.assert_allclose(size, np.diag(M).reshape(-1, 3).sum(1), rtol=1e-12)
    np.testing.assert_allclose(squares, (M**2).reshape(2 * count, 3, 2 * count, 3).sum((1, 3)), rtol=1e-10, atol=1e-14)


def _grasps(rng: np.random.Generator, count: int) -> Pose:
    return exp(rng.normal(0, 0.4, (count, 6)))


@pytest.mark.parametrize("timed", [True, False])
def test_information_without_the_rows(timed: bool) -> None:
    """Against the sum over rows of K^T (W - W J A^-1 J^T W) K with everything written out."""
    rng = np.random.default_rng(3)
    count, rows = 3, 20
    G, poses = _grasps(rng, count), exp(rng.normal(0, 0.5, (rows, count, 6)))
    J, W = adjoint_inverse(G), rng.uniform(1, 4, (count, 2)).repeat(3, axis=1)
    W[1] = 0.0
    twist = rng.normal(size=(rows, count, 6)) if timed else np.zeros((0, count, 6))
    valid = np.tile(W[:, 0] > 0, (rows, 1))
    A = np.einsum("nia,ni,nib->ab", J, W, J)
    P = np.diag(W.ravel()) - (W[..., None] * J).reshape(-1, 6) @ np.linalg.inv(A) @ (W[..., None] * J).reshape(-1, 6).T
    expected = np.zeros((13 * count, 13 * count))
    for t in range(rows):
        K = np.zeros((6 * count, 13 * count))
        for i in range(count):
            own = np.concatenate([np.eye(6), -adjoint_inverse(poses[t, i]), np.zeros((6, 1))], axis=1)
            own[:, 12] = twist[t, i] if timed else 0.0
            K[6 * i : 6 * i + 6, 13 * i : 13 * i + 13] = own
        expected += K.T @ P @ K
    S = scatter(poses.rotation.matrix, poses.position, twist, valid)
    np.testing.assert_allclose(pattern_information(S, J, W), expected, rtol=1e-11, atol=1e-10)


def test_what_a_row_says_of_the_motion() -> None:
    rng = np.random.default_rng(4)
    G, W = _grasps(rng, 4), rng.uniform(1, 4, (4, 2))
    found = np.array([[True] * 4, [True, False, True, False], [False] * 4])
    J = adjoint_inverse(G)
    expected = np.einsum("cn,nia,ni,nib->cab", found.astype(float), J, W.repeat(3, axis=1), J)
    expected[2] = np.eye(6)
    np.testing.assert_allclose(held(G.position, W, found), expected, atol=1e-12)


@pytest.mark.parametrize("lost", [0, 1, 5])
def test_the_solver_leaves_lost_directions_alone(lost: int) -> None:
    """Against the covariance with homes eliminated by a pseudo-inverse and every eigenvector of the grasps."""
    rng = np.random.default_rng(5)
    count, rows = 3, 400
    unknown = np.concatenate([13 * i + np.arange(12 if i else 0) for i in range(count)] + [np.array([12, 25, 38])])
    noise = np.full((count, 2), 1e-3)
    grasp = unknown % 13 < 6
    scale = unit(unknown[grasp], noise, rows)
    axes = np.linalg.qr(rng.normal(size=(12, 12)))[0]
    left = (axes * np.concatenate([np.full(lost, 0.1), rng.uniform(2, 90, 12 - lost)]) * SHOWN**2) @ axes.T
    root = rng.normal(size=(int((~grasp).sum()), 40))
    homes, carried = root @ root.T, rng.normal(size=(12, int((~grasp).sum())))
    H = np.empty((len(unknown), len(unknown)))
    H[np.ix_(~grasp, ~grasp)] = homes
    H[np.ix_(grasp, ~grasp)], H[np.ix_(~grasp, grasp)] = carried, carried.T
    H[np.ix_(grasp, grasp)] = left / np.outer(scale, scale) + carried @ np.linalg.inv(homes) @ carried.T
    kept = scale[:, None] * axes[:, lost:]
    values = np.diag(axes[:, lost:].T @ left @ axes[:, lost:])
    full = np.zeros((len(unknown), len(values)))
    full[grasp], full[~grasp] = kept, -np.linalg.inv(homes) @ carried.T @ kept
    expected = (full / values) @ full.T
    expected[np.ix_(~grasp, ~grasp)] += np.linalg.inv(homes)
    solver = Solver.of(H, unknown, noise, rows)
    shown, pull = solver.all_shown(), rng.normal(size=len(unknown))
    assert shown.lost.shape == (len(unknown), lost)
    size = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(shown.inverse / np.outer(size, size), expected / np.outer(size, size), atol=1e-7)
    np.testing.assert_allclose(solver.step(pull) / size, expected @ pull / size, atol=1e-6 * np.abs(pull @ size))
    timed = unknown % 13 == 12
    np.testing.assert_allclose(solver.variance(timed), np.diag(expected)[timed], rtol=1e-7)


def test_homes_that_nothing_shows_stay() -> None:
    rng = np.random.default_rng(6)
    unknown = np.arange(13)
    H = np.diag(np.concatenate([np.full(6, 1e9), np.full(6, 1e9), [0.0]]))
    found = Solver.of(H, unknown, np.full((1, 2), 1e-3), 10)
    step = found.step(rng.normal(size=13))
    assert np.isfinite(step).all()
    assert step[12] == 0.0


def _stepped(rows: int, at: int) -> tuple[Array, Array]:
    rng = np.random.default_rng(7)
    apart = rng.normal(0, 1e-4, (rows, 3, 6))
    apart[at:, 1, 3:] += [0.004, 0.0, 0.003]
    return apart, np.ones((rows, 3), np.bool_)


def _held(seen: np.ndarray) -> Stretch:
    """Return a recording of three robots at 100 Hz."""
    rows = len(seen)
    poses = Pose(Rotation.identity(rows, 3), np.zeros((rows, 3, 3)))
    return Stretch("one", "motion", np.arange(rows) / 100.0, poses, seen, np.zeros((rows, 3, 6)), seen, seen)


def test_a_slip_is_found_where_it_is_and_missing_rows_do_not_matter() -> None:
    apart, seen = _stepped(1500, 700)
    noise = np.tile(1e-8 * np.eye(6), (3, 1, 1))
    slip = find_slip(0, _held(seen), apart, noise)
    assert slip is not None
    assert slip.robot == 1
    assert abs(slip.time - 7.0) <= 0.021
    assert slip.distance == pytest.approx(0.005, rel=0.02)
    seen[500:520, 1], apart[500:520, 1] = False, 0.0
    again = find_slip(0, _held(seen), apart, noise)
    assert again is not None
    assert abs(again.time - 7.0) <= 0.021
    assert find_slip(0, _held(np.ones((1500, 3), np.bool_)), _stepped(1500, 1500)[0], noise) is None


def test_residuals_against_the_others_alone() -> None:
    rng = np.random.default_rng(8)
    J, W, residual = adjoint_inverse(_grasps(rng, 4)), rng.uniform(1, 4, (4, 6)), rng.normal(size=(30, 4, 6))
    A = np.linalg.inv(np.einsum("nia,ni,nib->ab", J, W, J))
    out = alone(residual, J, W)
    for i in range(4):
        held_back = np.eye(6) - J[i] @ A @ J[i].T * W[i]
        np.testing.assert_allclose(out[:, i] @ held_back.T, residual[:, i], atol=1e-11)


def test_columns_of_the_scaling_table_stay_apart() -> None:
    row = {"rotation_deg": 12.3456, "position_mm": 12.376, "position_se": 10.238, "time_s": 10.5}
    line = block("grasps", {"joint": row}, _SCALE)[1]
    assert line.split() == ["joint", "12.3456", "12.376", "10.238", "10.5000"]


def test_rotation_helpers_agree_with_cross_matrices() -> None:
    """The feature of R^T [p]x is what an adjoint holds."""
    rng = np.random.default_rng(9)
    X = exp(rng.normal(size=(1, 1, 6)))
    F = features(X.rotation.matrix, X.position, np.zeros((0, 1, 6)), np.ones((1, 1), np.bool_))[0]
    turned = X.rotation.matrix[0, 0].T @ cross_matrix(X.position[0, 0])
    np.testing.assert_allclose(F[10:19].reshape(3, 3), turned, atol=1e-15)


def test_the_first_robot_that_is_there_sees_the_payload() -> None:
    rng = np.random.default_rng(5)
    poses, G, Z = (Pose(Rotation.exp(rng.normal(size=(*n, 3))), rng.normal(size=(*n, 3))) for n in ((4, 3), (3,), (3,)))
    valid = np.array([[1, 1, 1], [0, 1, 1], [0, 0, 1], [0, 0, 0]], np.bool_)
    turns, places = first_seen(
        poses.rotation.matrix, poses.position, valid, G.rotation.matrix, G.position, Z.rotation.matrix, Z.position
    )
    for t, i in enumerate([0, 1, 2, 0]):
        X = Z[i] @ poses[t, i] @ G[i].inverse()
        np.testing.assert_allclose(turns[t], X.rotation.matrix, atol=1e-14)
        np.testing.assert_allclose(places[t], X.position, atol=1e-14)


def test_how_fast_a_grasp_turns_is_open_across_gaps_and_beyond_the_ends() -> None:
    known = np.concatenate([np.arange(0, 1, 0.01), np.arange(2, 3, 0.01)])
    track = Track.of(known, rotation=Rotation.exp(known[:, None] * [0.0, 0.3, 0.4]))
    time = np.array([-0.1, 0.005, 0.5, 0.985, 1.5, 2.5, 2.97])
    speed = turning_speed(track, time, 0.05)
    assert np.isnan(speed).tolist() == [True, False, False, True, True, False, True]
    np.testing.assert_allclose(speed[[1, 2, 5]], 0.5, rtol=1e-12)


def test_columns_that_count_by_powers_are_as_many_columns() -> None:
    rng = np.random.default_rng(6)
    apart, columns, powers = rng.normal(size=(60, 3, 6)), rng.normal(size=(60, 2, 6)), rng.normal(size=(60, 2))
    J, W, robot = rng.normal(size=(3, 6, 6)), rng.uniform(1, 2, (3, 6)), np.array([2, 0])
    found = Scores.of(apart, columns, robot, J, W, 4, powers)
    every = np.concatenate([columns * powers[:, k, None, None] for k in range(2)], axis=1)
    expected = Scores.of(apart, every, np.tile(robot, 2), J, W, 4)
    np.testing.assert_allclose(found.pull, expected.pull, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(found.information, expected.information, rtol=1e-9, atol=1e-9)
