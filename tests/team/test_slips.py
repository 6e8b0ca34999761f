"""Laws of finding a slip: noise is never one, whatever its directions share, and a slip is found where it is."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array
from steelyard.simulate.team_sensing import autoregressive
from steelyard.spatial import Pose, Rotation
from steelyard.team.adjoint import adjoint_inverse
from steelyard.team.changes.slips import Slip, alone, find_slip, noise_alone
from steelyard.team.stacked import Stretch

ROWS, RATE = 1500, 100.0
NOISE = np.array([1e-3, 1e-3, 1e-3, 3e-4, 3e-4, 3e-4])


def team(seed: int) -> tuple[Array, Array, Array]:
    """Return J, W of three grasps far apart, and what the joint fit of noise alone leaves (T, 3, 6)."""
    rng = np.random.default_rng(seed)
    grasps = Pose(Rotation.exp(rng.normal(size=(3, 3))), rng.normal(size=(3, 3)) * [0.8, 0.6, 0.1])
    J, W = adjoint_inverse(grasps), np.tile(NOISE**-2.0, (3, 1))
    noise = NOISE * autoregressive(rng, ROWS, 18).reshape(ROWS, 3, 6)
    A = np.einsum("nia,ni,nib->ab", J, W, J)
    path = np.einsum("ab,nib,ni,tni->ta", np.linalg.inv(A), J, W, noise)
    return J, W, noise - np.einsum("nia,ta->tni", J, path)


def held(name: str) -> Stretch:
    """Return a recording of three robots whose clock starts at zero."""
    all_of = np.ones((ROWS, 3), np.bool_)
    poses = Pose(Rotation.identity(ROWS, 3), np.zeros((ROWS, 3, 3)))
    return Stretch(name, "motion", np.arange(ROWS) / RATE, poses, all_of, np.zeros((ROWS, 3, 6)), all_of, all_of)


def test_noise_alone_is_what_residuals_show() -> None:
    rows = []
    for seed in range(20):
        J, W, left = team(seed)
        apart = alone(left, J, W)
        factor = np.linalg.cholesky(noise_alone(J, W)[1])
        rows.append(np.linalg.solve(factor, apart[:, 1].T).T)
    seen = np.cov(np.concatenate(rows).T)
    np.testing.assert_allclose(seen, np.eye(6), atol=0.15)


def test_noise_that_directions_share_is_no_slip() -> None:
    for seed in range(200):
        J, W, left = team(seed)
        # A hundred times the noise: sizes alone would all pass.
        assert find_slip(0, held("one"), 100 * alone(left, J, W), noise_alone(J, W)) is None


def test_a_slip_is_found_where_it_is() -> None:
    for seed in range(20):
        J, W, left = team(seed)
        apart = alone(left, J, W)
        apart[700:, 1, 3:] += np.array([0.003, 0.0, 0.004])
        slip = find_slip(4, held("one"), apart, noise_alone(J, W))
        assert slip is not None
        assert (slip.recording, slip.robot) == (4, 1)
        assert abs(slip.time - 7.0) < 0.3


def test_wrenches_near_the_time_of_a_slip_are_left_out_of_its_own_recording_alone() -> None:
    slip = Slip(2, 1, 7.0, np.array([0.0, 0.0, 0.0, 0.003, 0.0, 0.004]), 1.0)
    before, during, after = slip.applied((held("one"), held("two"), held("three")))
    assert before.seen.all()
    assert before.felt.all()
    np.testing.assert_array_equal(during.felt[:, 2], np.abs(during.time - 7.0) >= 0.2)
    np.testing.assert_array_equal(during.seen[:, 2], during.time <= 6.8)
    assert after.felt.all()
    assert not after.seen[:, 2].any()
