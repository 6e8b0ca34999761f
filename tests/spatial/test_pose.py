"""Pose: the laws of SE(3), wrenches and twists moved, and accelerations against finite differences."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from steelyard.errors import BadValue
from steelyard.spatial import Acceleration, Pose, Rotation, Twist, Wrench
from strategies import BATCHES, accelerations, numbers, poses, twists, wrenches

TIGHT = 1e-12


def same(a: Pose, b: Pose) -> None:
    assert_allclose(a.matrix(), b.matrix(), atol=TIGHT)


@pytest.mark.parametrize("batch", BATCHES)
@given(data=st.data())
def test_group_laws(batch: tuple[int, ...], data: st.DataObject) -> None:
    a, b, c = (data.draw(poses(batch)) for _ in range(3))
    same((a @ b) @ c, a @ (b @ c))
    same(a @ a.inverse(), Pose.identity(*batch))
    same(Pose.identity(*batch) @ a, a)
    same(Pose.from_matrix(a.matrix() @ b.matrix()), a @ b)
    assert (a @ b).batch == batch


@pytest.mark.parametrize("batch", BATCHES)
@given(data=st.data())
def test_apply_is_an_action(batch: tuple[int, ...], data: st.DataObject) -> None:
    a, b, point = data.draw(poses(batch)), data.draw(poses(batch)), data.draw(numbers((*batch, 3)))
    assert_allclose((a @ b).apply(point), a.apply(b.apply(point)), atol=TIGHT)
    assert_allclose(a.inverse().apply(a.apply(point)), point, atol=TIGHT)


@pytest.mark.parametrize("batch", BATCHES)
@given(data=st.data())
def test_power_does_not_depend_on_the_frame(batch: tuple[int, ...], data: st.DataObject) -> None:
    pose, twist, wrench = data.draw(poses(batch)), data.draw(twists(batch)), data.draw(wrenches(batch))
    here = (wrench.array() * twist.array()).sum(-1)
    there = ((pose @ wrench).array() * (pose @ twist).array()).sum(-1)
    assert_allclose(there, here, atol=1e-10)


@pytest.mark.parametrize("batch", BATCHES)
@given(data=st.data())
def test_moving_twice_is_moving_by_the_product(batch: tuple[int, ...], data: st.DataObject) -> None:
    a, b = data.draw(poses(batch)), data.draw(poses(batch))
    twist, wrench = data.draw(twists(batch)), data.draw(wrenches(batch))
    acceleration = data.draw(accelerations(batch))
    assert_allclose((a @ (b @ twist)).array(), ((a @ b) @ twist).array(), atol=1e-10)
    assert_allclose((a @ (b @ wrench)).array(), ((a @ b) @ wrench).array(), atol=1e-10)
    step = b.move_acceleration(acceleration, twist.angular)
    twice = a.move_acceleration(step, (b @ twist).angular)
    assert_allclose(twice.array(), (a @ b).move_acceleration(acceleration, twist.angular).array(), atol=1e-9)


@given(poses(), numbers((3,), 20.0))
def test_a_pure_force_gets_the_moment_of_its_arm(X_AB: Pose, force: np.ndarray) -> None:
    moved = X_AB @ Wrench(np.zeros(3), force)
    assert_allclose(moved.force, X_AB.rotation.apply(force))
    assert_allclose(moved.torque, np.cross(X_AB.position, moved.force), atol=TIGHT)


class Tumble:
    """A rigid body with R_WB(t) = R0 exp(a t) exp(b t) and p_WB(t) = p0 + v0 t + c t^2/2, so at t = 0, in B,

    omega = a + b, alpha = a x b, and p'' = c in W.
    """

    def __init__(self, start: Pose, a: np.ndarray, b: np.ndarray, v0: np.ndarray, c: np.ndarray) -> None:
        self.start, self.a, self.b, self.v0, self.c = start, a, b, v0, c
        self.omega, self.alpha = a + b, np.cross(a, b)

    def pose(self, t: float) -> Pose:
        R = self.start.rotation @ Rotation.exp(self.a * t) @ Rotation.exp(self.b * t)
        return Pose(R, self.start.position + self.v0 * t + 0.5 * self.c * t * t)

    def acceleration(self) -> Acceleration:
        return Acceleration(self.alpha, self.start.rotation.inverse().apply(self.c))


@st.composite
def tumbles(draw: st.DrawFn) -> Tumble:
    return Tumble(draw(poses()), *(draw(numbers((3,), 2.0)) for _ in range(4)))


@given(tumbles(), poses())
def test_moved_acceleration_is_that_of_the_moved_point(body: Tumble, X_AB: Pose) -> None:
    h = 2e-3
    p = [(body.pose(k * h) @ X_AB.inverse()).position for k in (-2, -1, 0, 1, 2)]
    second = (-p[0] + 16 * p[1] - 30 * p[2] + 16 * p[3] - p[4]) / (12 * h * h)
    R_WA = (body.pose(0) @ X_AB.inverse()).rotation
    moved = X_AB.move_acceleration(body.acceleration(), body.omega)
    assert_allclose(moved.linear, R_WA.inverse().apply(second), atol=1e-7)
    assert_allclose(moved.angular, X_AB.rotation.apply(body.alpha), atol=TIGHT)


@given(tumbles())
def test_component_wise_twist_derivative_becomes_classical(body: Tumble) -> None:
    def twist(t: float) -> np.ndarray:
        pose, h = body.pose(t), 1e-4
        turn = (pose.rotation.inverse() @ body.pose(t + h).rotation).log()
        back = (pose.rotation.inverse() @ body.pose(t - h).rotation).log()
        linear = pose.rotation.inverse().apply(body.v0 + body.c * t)
        return np.concatenate([(turn - back) / (2 * h), linear])

    h = 1e-3
    derivative = (twist(h) - twist(-h)) / (2 * h)
    found = Acceleration.from_twist_derivative(derivative, Twist.from_array(twist(0)))
    assert_allclose(found.array(), body.acceleration().array(), atol=1e-4)


@given(poses((4,)))
def test_stacked_poses_are_those_that_went_in(X: Pose) -> None:
    stacked = Pose.stacked([X[k] for k in range(4)])
    assert stacked.batch == (4,)
    assert_allclose(stacked.matrix(), X.matrix(), rtol=0, atol=0)


def test_batch_shapes_broadcast() -> None:
    many, one = Pose(Rotation.exp(np.eye(3)), np.eye(3)), Pose(Rotation.exp([0, 0, 1]), [1, 2, 3])
    assert (many @ one).batch == (3,) == (one @ many).batch
    assert (one @ Wrench(np.ones((3, 3)), np.ones((3, 3)))).batch == (3,)
    assert (many @ Twist([1, 0, 0], [0, 1, 0])).batch == (3,)
    assert many[1:].batch == (2,)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (
            lambda: Pose(Rotation.identity(2), np.zeros(3)),
            "rotation and position must have one batch shape; got (2,) and ().",
        ),
        (
            lambda: Pose(Rotation.identity(), [0, np.inf, 0]),
            "position must be finite; 1 entry is not, the first at index (1,).",
        ),
        (lambda: Pose.from_matrix(np.eye(3)), "pose matrix must have shape (..., 4, 4); got (3, 3)."),
        (
            lambda: Pose.from_matrix(np.eye(4) + np.outer([0, 0, 0, 1], [0.5, 0, 0, 0])),
            "pose matrix must end in the row 0 0 0 1; it is off by 0.5.",
        ),
        (
            lambda: Pose.identity() @ Acceleration(np.zeros(3), np.zeros(3)),
            "An acceleration moves with the angular velocity of its body: use move_acceleration.",
        ),
    ],
)
def test_bad_input_is_named(make, text: str) -> None:
    with pytest.raises(BadValue) as error:
        make()
    assert str(error.value) == text


def test_a_pose_times_an_array_is_refused() -> None:
    with pytest.raises(TypeError):
        Pose.identity() @ "X"  # type: ignore[operator]
