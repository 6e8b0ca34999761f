"""InertialParameters: the laws of rigid bodies, every form of the ten numbers, both sides of consistency."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from steelyard.errors import BadValue
from steelyard.inertia import InertialParameters, forms
from steelyard.spatial import Pose, Rotation, Twist, cross_matrix
from strategies import BATCHES, bodies, log_choleskys, numbers, poses, twists


def same(a: InertialParameters, b: InertialParameters, tolerance: float = 1e-12) -> None:
    assert_allclose(a.vector, b.vector, rtol=tolerance, atol=tolerance)


def kinetic_energy(body: InertialParameters, twist: Twist) -> np.ndarray:
    """1/2 V^T M V about the frame origin."""
    v, w = twist.linear, twist.angular
    turning = np.einsum("...i,...ij,...j->...", w, body.inertia, w)
    mixed = (v * np.cross(w, body.first_moment)).sum(-1)
    return 0.5 * body.mass * (v * v).sum(-1) + mixed + 0.5 * turning


@pytest.mark.parametrize("batch", BATCHES)
@given(data=st.data())
def test_the_wrench_is_that_of_newton_and_euler(batch: tuple[int, ...], data: st.DataObject) -> None:
    """About the centre of mass both laws are short; the wrench is moved from there. Motions batch like bodies."""
    body = data.draw(bodies(batch))
    g, a, omega, alpha = (data.draw(numbers((*batch, 3))) for _ in range(4))
    found = body.wrench(g, a, omega, alpha)
    arm, turned = body.com, np.einsum("...ij,...j->...i", body.inertia_com, omega)
    force = body.mass[..., None] * (a - g + np.cross(alpha, arm) + np.cross(omega, np.cross(omega, arm)))
    torque = np.einsum("...ij,...j->...i", body.inertia_com, alpha) + np.cross(omega, turned) + np.cross(arm, force)
    assert_allclose(found.force, force, rtol=1e-9, atol=1e-9)
    assert_allclose(found.torque, torque, rtol=1e-9, atol=1e-9)


def test_one_body_at_rest_in_many_poses() -> None:
    body = InertialParameters.from_com(2.0, [0.1, 0, 0], 0.01 * np.eye(3))
    found = body.wrench([[0, 0, -10], [0, 10, 0]])
    assert_allclose(found.force, [[0, 0, 20], [0, -20, 0]])
    assert_allclose(found.torque, [[0, -2, 0], [0, 0, -2]])
    assert repr(body.wrench([0, 0, -10])) == "Wrench(array([ 0., -2.,  0.]), array([ 0.,  0., 20.]))"
    for wrong in ([0, -10], [0, 0, np.nan]):
        with pytest.raises(BadValue, match="gravity must"):
            body.wrench(wrong)
    with pytest.raises(BadValue, match="batch shapes that broadcast"):
        body.wrench(np.zeros((4, 3)), np.zeros((5, 3)))


@pytest.mark.parametrize("batch", BATCHES)
@given(data=st.data())
def test_parallel_axis_out_and_back(batch: tuple[int, ...], data: st.DataObject) -> None:
    body, shift = data.draw(bodies(batch)), data.draw(numbers((*batch, 3)))
    moved = body.in_frame(Pose(Rotation.identity(*batch), shift))
    arm = cross_matrix(body.com + shift)
    steiner = body.inertia_com - body.mass[..., None, None] * (arm @ arm)
    assert_allclose(moved.inertia, steiner, rtol=1e-10, atol=1e-12)
    assert_allclose(moved.com, body.com + shift, atol=1e-12)
    assert_allclose(moved.inertia_com, body.inertia_com, atol=1e-12 * float(body.mass.max() + 1))
    same(moved.in_frame(Pose(Rotation.identity(*batch), -shift)), body)


@pytest.mark.parametrize("batch", BATCHES)
@given(data=st.data())
def test_bodies_add_and_come_apart(batch: tuple[int, ...], data: st.DataObject) -> None:
    a, b = data.draw(bodies(batch)), data.draw(bodies(batch))
    both = a + b
    assert_allclose(both.mass, a.mass + b.mass)
    weighted = a.mass[..., None] * a.com + b.mass[..., None] * b.com
    assert_allclose(both.com, weighted / both.mass[..., None], atol=1e-12)
    assert_allclose(both.pseudo_inertia, a.pseudo_inertia + b.pseudo_inertia)
    assert both.validity().consistent
    same(both - b, a)


@pytest.mark.parametrize("batch", BATCHES)
@given(data=st.data())
def test_change_of_frame_commutes_with_addition_and_composes(batch: tuple[int, ...], data: st.DataObject) -> None:
    a, b = data.draw(bodies(batch)), data.draw(bodies(batch))
    X, Y = data.draw(poses(batch)), data.draw(poses(batch))
    same((a + b).in_frame(X), a.in_frame(X) + b.in_frame(X))
    same(a.in_frame(Y).in_frame(X), a.in_frame(X @ Y))
    same(a.in_frame(X).in_frame(X.inverse()), a)
    assert a.in_frame(X).validity().consistent


@pytest.mark.parametrize("batch", BATCHES)
@given(data=st.data())
def test_kinetic_energy_does_not_depend_on_the_frame(batch: tuple[int, ...], data: st.DataObject) -> None:
    body, pose, twist = data.draw(bodies(batch)), data.draw(poses(batch)), data.draw(twists(batch))
    here, there = kinetic_energy(body, twist), kinetic_energy(body.in_frame(pose), pose @ twist)
    assert_allclose(there, here, rtol=1e-9, atol=1e-9)
    assert (here >= 0).all()


@given(numbers((5,)), numbers((5, 3)), poses())
def test_point_masses_by_their_definitions(unit: np.ndarray, points: np.ndarray, pose: Pose) -> None:
    masses = 2 + unit
    body = InertialParameters.from_point_masses(masses, points)
    assert_allclose(body.mass, masses.sum())
    assert_allclose(body.com, masses @ points / masses.sum(), atol=1e-12)
    arms = cross_matrix(points)
    assert_allclose(body.inertia, -np.einsum("n,nij->ij", masses, arms @ arms), atol=1e-12)
    same(body.in_frame(pose), InertialParameters.from_point_masses(masses, pose.apply(points)))


@pytest.mark.parametrize("batch", BATCHES)
@given(data=st.data())
def test_every_form_goes_there_and_back(batch: tuple[int, ...], data: st.DataObject) -> None:
    body, theta = data.draw(bodies(batch)), data.draw(log_choleskys(batch))
    same(InertialParameters.from_com(body.mass, body.com, body.inertia_com), body)
    same(InertialParameters.from_pseudo_inertia(body.pseudo_inertia), body)
    same(InertialParameters.from_log_cholesky(body.log_cholesky()), body)
    assert_allclose(InertialParameters.from_log_cholesky(theta).log_cholesky(), theta, atol=1e-9)
    assert_allclose(forms.upper(forms.inertia_matrix(body.vector)), body.vector[..., 4:])


@given(numbers((10,), 3.0))
def test_every_log_cholesky_vector_is_a_consistent_body(theta: np.ndarray) -> None:
    assert np.linalg.eigvalsh(InertialParameters.from_log_cholesky(theta).pseudo_inertia)[0] > -1e-12


def test_pseudo_inertia_blocks_and_tensor_off_diagonals() -> None:
    body = InertialParameters.from_point_masses([2.0], [[1.0, 3.0, 5.0]])
    assert_allclose(body.vector, [2, 2, 6, 10, 68, -6, -10, 52, -30, 20])
    point = np.array([1.0, 3.0, 5.0, 1.0])
    assert_allclose(body.pseudo_inertia, 2 * np.outer(point, point))


def test_log_cholesky_order_is_that_of_the_paper() -> None:
    a, d1, d2, d3, s12, s23, s13, t1, t2, t3 = theta = 0.1 * np.arange(1, 11)
    U = np.array([
        [np.exp(d1), s12, s13, t1],
        [0, np.exp(d2), s23, t2],
        [0, 0, np.exp(d3), t3],
        [0, 0, 0, 1],
    ])  # fmt: skip
    body = InertialParameters.from_log_cholesky(theta)
    assert_allclose(body.pseudo_inertia, np.exp(2 * a) * U @ U.T)
    assert_allclose(body.com, [t1, t2, t3])


def differences(function, at: np.ndarray, step: float = 1e-6) -> np.ndarray:
    """Central differences of `function` (..., k) -> (..., n) as (..., n, k)."""
    columns = []
    for unit in np.eye(at.shape[-1]):
        columns.append((function(at + step * unit) - function(at - step * unit)) / (2 * step))
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize("batch", BATCHES)
@given(data=st.data())
def test_log_cholesky_jacobian(batch: tuple[int, ...], data: st.DataObject) -> None:
    theta = data.draw(log_choleskys(batch))
    expected = differences(forms.from_log_cholesky, theta)
    assert_allclose(forms.log_cholesky_jacobian(theta), expected, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("batch", BATCHES)
@given(data=st.data())
def test_principal_frame(batch: tuple[int, ...], data: st.DataObject) -> None:
    body = data.draw(bodies(batch))
    moments, X_SP = body.principal()
    assert (np.diff(moments, axis=-1) >= 0).all()
    inside = body.in_frame(X_SP.inverse())
    scale = float(np.abs(body.vector).max())
    assert_allclose(inside.com, np.zeros((*batch, 3)), atol=1e-12)
    assert_allclose(inside.inertia, moments[..., None] * np.eye(3), atol=1e-12 * scale)
    axes = X_SP.rotation.matrix[..., :, :2]  # the third axis follows by handedness
    assert (np.take_along_axis(axes, np.abs(axes).argmax(-2)[..., None, :], -2) > 0).all()


@given(bodies(), poses())
def test_principal_moments_do_not_depend_on_the_frame(body: InertialParameters, pose: Pose) -> None:
    assert_allclose(body.in_frame(pose).principal()[0], body.principal()[0], rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize("batch", BATCHES)
@given(data=st.data())
def test_consistent_means_positive_definite_pseudo_inertia(batch: tuple[int, ...], data: st.DataObject) -> None:
    body = InertialParameters(np.array([1, 0, 0, 0, 1, 0, 0, 1, 0, 1]) + data.draw(numbers((*batch, 10))))
    margin = np.linalg.eigvalsh(body.pseudo_inertia)[..., 0].min()
    if abs(margin) > 1e-9:
        assert body.validity().consistent == (margin > 0)
    assert body.validity().consistent == (str(body.validity()) == "physically consistent")


BOX = np.array([2.0, 0, 0, 0, 0.02, 0, 0, 0.03, 0, 0.04])
FLIPPED = np.array([2.0, 0, 0, 0, -0.01, 0, 0, 0.03, 0, 0.03])
SPLIT = np.array([2.0, 0, 0, 0, 0.01, 0, 0, 0.02, 0, 0.05])
FAR = np.array([2.0, 0, 0, 4.0, 0.02, 0, 0, 0.03, 0, 0.04])  # a centre of mass 2 m away with no room for it

REPORTS = [
    (BOX, "physically consistent"),
    (-BOX, "mass must be above zero, it is -2 kg"),
    (0 * BOX, "mass must be above zero, it is 0 kg"),
    (FLIPPED, "principal moments must be above zero, they are -0.01, 0.03, 0.03 kg m^2"),
    (
        SPLIT,
        "the triangle inequality is broken: the largest principal moment must be below the sum of the other "
        "two, they are 0.01, 0.02, 0.05 kg m^2 (0.05 >= 0.03)",
    ),
    (FAR, "principal moments must be above zero, they are -7.98, -7.97, 0.04 kg m^2"),
    (np.stack([BOX, BOX]), "physically consistent"),
    (np.zeros((0, 10)), "physically consistent"),
    (
        np.stack([BOX, FLIPPED, SPLIT, -BOX])[:, None],
        "3 of 4 bodies break a law, the worst at index (3, 0): mass must be above zero, it is -2 kg",
    ),
]


@pytest.mark.parametrize(("vector", "text"), REPORTS)
def test_the_report_names_the_broken_law_with_its_numbers(vector: np.ndarray, text: str) -> None:
    body = InertialParameters(vector)
    assert str(body.validity()) == text
    assert body.validity().consistent == (text == "physically consistent")


@pytest.mark.parametrize(("vector", "text"), REPORTS)
def test_the_error_is_the_report(vector: np.ndarray, text: str) -> None:
    body = InertialParameters(vector)
    if text == "physically consistent":
        assert body.require_consistent() is body
        return
    for refused in (body.require_consistent, body.log_cholesky):
        with pytest.raises(BadValue) as error:
            refused()
        assert str(error.value) == f"These inertial parameters are not those of a rigid body: {text}."


def test_a_body_that_weighs_nothing_has_no_centre_of_mass_and_no_warning() -> None:
    nothing = InertialParameters(np.eye(10)[4])
    assert np.isnan(nothing.com).all()
    assert np.isnan(nothing.inertia_com).all()


def test_scalars_and_batches_keep_their_shapes() -> None:
    one = InertialParameters.from_com(2, [0, 0, 0.1], np.eye(3))
    assert one.vector.shape == (10,)
    assert one.mass.shape == ()
    many = InertialParameters.from_com([1.0, 2.0], [0, 0, 0.1], np.eye(3))
    assert many.vector.shape == (2, 10)
    same(many[1], one)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: InertialParameters(np.zeros(9)), "inertial parameters must have shape (..., 10); got (9,)."),
        (
            lambda: InertialParameters.from_com(1, [0, 0, 0], [[1, 0.5, 0], [0, 1, 0], [0, 0, 1]]),
            "inertia about the centre of mass must be symmetric; it differs from its transpose by 0.5.",
        ),
        (
            lambda: InertialParameters.from_pseudo_inertia(np.arange(16.0).reshape(4, 4)),
            "pseudo-inertia must be symmetric; it differs from its transpose by 9.",
        ),
        (
            lambda: InertialParameters.from_com(np.ones(2), np.zeros((3, 3)), np.eye(3)),
            "mass, centre of mass and inertia must have batch shapes that broadcast; got (2,), (3,) and ().",
        ),
        (
            lambda: InertialParameters.from_point_masses([1, 2], np.zeros((3, 3))),
            "masses and points must have shapes (n,) and (n, 3); got (2,) and (3, 3).",
        ),
        (
            lambda: InertialParameters.from_com("heavy", [0, 0, 0], np.eye(3)),
            "mass must be numbers; got str (could not convert string to float: 'heavy').",
        ),
        (
            lambda: InertialParameters(np.zeros(10)).principal(),
            "A body of mass zero has no centre of mass and so no principal frame.",
        ),
    ],
)
def test_bad_input_is_named(make, text: str) -> None:
    with pytest.raises(BadValue) as error:
        make()
    assert str(error.value) == text
