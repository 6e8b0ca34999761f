"""Rotation: the laws of SO(3) in every regime and batch shape, and SciPy as a second implementation."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.spatial.transform as scipy_transform
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from steelyard.errors import BadValue
from steelyard.spatial import Rotation
from strategies import BATCHES, angles, numbers, rotation_vectors, rotations

TIGHT = 1e-13


def same(a: Rotation, b: Rotation, tolerance: float = TIGHT) -> None:
    assert_allclose(a.matrix, b.matrix, atol=tolerance, rtol=0)


@pytest.mark.parametrize("batch", BATCHES)
@given(data=st.data())
def test_group_laws(batch: tuple[int, ...], data: st.DataObject) -> None:
    a, b, c = (data.draw(rotations(batch)) for _ in range(3))
    same((a @ b) @ c, a @ (b @ c))
    same(a @ a.inverse(), Rotation.identity(*batch))
    same(Rotation.identity(*batch) @ a, a)
    same((a @ b).inverse(), b.inverse() @ a.inverse())
    assert (a @ b).batch == batch


@pytest.mark.parametrize("batch", BATCHES)
@given(data=st.data())
def test_apply_is_an_action_that_keeps_dot_and_cross_products(batch: tuple[int, ...], data: st.DataObject) -> None:
    a, b = data.draw(rotations(batch)), data.draw(rotations(batch))
    u, v = data.draw(numbers((*batch, 3))), data.draw(numbers((*batch, 3)))
    assert_allclose((a @ b).apply(u), a.apply(b.apply(u)), atol=TIGHT)
    assert_allclose((a.apply(u) * a.apply(v)).sum(-1), (u * v).sum(-1), atol=TIGHT)
    assert_allclose(np.cross(a.apply(u), a.apply(v)), a.apply(np.cross(u, v)), atol=TIGHT)


@pytest.mark.parametrize("batch", BATCHES)
@given(data=st.data())
def test_exp_of_log_is_the_rotation(batch: tuple[int, ...], data: st.DataObject) -> None:
    rotation = data.draw(rotations(batch))
    vector = rotation.log()
    same(Rotation.exp(vector), rotation)
    assert (np.linalg.norm(vector, axis=-1) <= np.pi * (1 + 1e-15)).all()
    assert_allclose(rotation.angle(), np.linalg.norm(vector, axis=-1))


@given(rotation_vectors())
def test_log_of_exp_is_the_vector(vector: np.ndarray) -> None:
    back = Rotation.exp(vector).log()
    if np.linalg.norm(vector) > np.pi - 1e-6:  # +v and -v are then one rotation, to rounding
        back = back * np.sign(back @ vector)
    assert_allclose(back, vector, atol=1e-12)


@given(numbers((3,), 1e-7))
def test_log_of_exp_keeps_its_relative_precision_near_the_identity(vector: np.ndarray) -> None:
    assert_allclose(Rotation.exp(vector).log(), vector, rtol=1e-9, atol=1e-22)


@given(rotation_vectors(), angles(), angles())
def test_turns_about_one_axis_add(vector: np.ndarray, first: float, second: float) -> None:
    axis = vector / max(np.linalg.norm(vector), 1e-300)
    same(Rotation.exp(axis * first) @ Rotation.exp(axis * second), Rotation.exp(axis * (first + second)))


@pytest.mark.parametrize("batch", BATCHES)
@given(data=st.data())
def test_exp_agrees_with_scipy(batch: tuple[int, ...], data: st.DataObject) -> None:
    vector = data.draw(rotation_vectors(batch))
    expected = scipy_transform.Rotation.from_rotvec(vector.reshape(-1, 3)).as_matrix()
    assert_allclose(Rotation.exp(vector).matrix.reshape(-1, 3, 3), expected, atol=TIGHT)


@pytest.mark.parametrize("batch", BATCHES)
@given(data=st.data())
def test_both_quaternion_orders_agree_with_scipy(batch: tuple[int, ...], data: st.DataObject) -> None:
    rotation = data.draw(rotations(batch))
    wxyz = rotation.quaternion_wxyz()
    xyzw = np.roll(wxyz, -1, axis=-1)
    same(Rotation.from_quaternion_wxyz(wxyz), rotation)
    same(Rotation.from_quaternion_xyzw(xyzw), rotation)
    same(Rotation.from_quaternion_wxyz(-3.7 * wxyz), rotation)
    assert (wxyz[..., 0] >= 0).all()
    flat = xyzw.reshape(-1, 4)
    expected = scipy_transform.Rotation.from_matrix(rotation.matrix.reshape(-1, 3, 3).copy()).as_quat()
    assert_allclose(np.abs((flat * expected).sum(-1)), 1, atol=TIGHT)
    turned = scipy_transform.Rotation.from_quat(flat).as_matrix()
    assert_allclose(turned, rotation.matrix.reshape(-1, 3, 3), atol=TIGHT)


def test_scalar_first_and_scalar_last_differ() -> None:
    quarter_about_z = [np.sqrt(0.5), 0, 0, np.sqrt(0.5)]
    expected = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    assert_allclose(Rotation.from_quaternion_wxyz(quarter_about_z).matrix, expected, atol=1e-15)
    quarter_about_x = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
    assert_allclose(Rotation.from_quaternion_xyzw(quarter_about_z).matrix, quarter_about_x, atol=1e-15)


@pytest.mark.parametrize("batch", BATCHES)
@given(data=st.data())
def test_rpy_is_extrinsic_xyz(batch: tuple[int, ...], data: st.DataObject) -> None:
    rpy = data.draw(numbers((*batch, 3), 3.2))
    expected = scipy_transform.Rotation.from_euler("xyz", rpy.reshape(-1, 3)).as_matrix()
    assert_allclose(Rotation.from_rpy(rpy).matrix.reshape(-1, 3, 3), expected, atol=TIGHT)
    assert_allclose(Rotation.from_rpy(Rotation.from_rpy(rpy).rpy()).matrix.reshape(-1, 3, 3), expected, atol=1e-12)


@pytest.mark.parametrize("batch", BATCHES)
@given(data=st.data())
def test_nearest_is_a_rotation_and_no_other_is_nearer(batch: tuple[int, ...], data: st.DataObject) -> None:
    rotation, other = data.draw(rotations(batch)), data.draw(rotations(batch))
    matrix = rotation.matrix + data.draw(numbers((*batch, 3, 3), 0.1))
    nearest = Rotation.nearest(matrix)
    same(Rotation(nearest.matrix), nearest)
    same(Rotation.nearest(rotation.matrix), rotation)
    distance = np.linalg.norm(matrix - nearest.matrix, axis=(-1, -2))
    assert (distance <= np.linalg.norm(matrix - other.matrix, axis=(-1, -2)) + TIGHT).all()


def test_nearest_to_a_mirror_image_is_right_handed() -> None:
    assert np.linalg.det(Rotation.nearest(np.diag([1.0, 1.0, -0.9])).matrix) == pytest.approx(1)


@pytest.mark.parametrize("batch", BATCHES)
@given(data=st.data())
def test_aligning_finds_the_turn_between_vectors_of_a_plane_or_of_space(
    batch: tuple[int, ...], data: st.DataObject
) -> None:
    turn, place = data.draw(rotations(batch)), data.draw(rotations(batch))
    sizes = np.array([[1.0, 0, 0], [0, 2, 0], [0, 0, data.draw(st.sampled_from([0.0, 3.0]))]])
    seen = np.swapaxes(place.matrix, -1, -2) @ sizes  # the vectors are its columns
    match = turn.matrix @ seen @ np.swapaxes(seen, -1, -2)
    same(Rotation.aligning(match), turn)
    same(Rotation.aligning(1e9 * match), turn)


def test_aligning_is_right_handed_and_least_squares_where_the_vectors_are_mirrored() -> None:
    a, b = np.random.default_rng(0).normal(size=(2, 20, 3))
    mirrored = b * [1, 1, -1]
    found = Rotation.aligning(mirrored.T @ b)
    assert np.linalg.det(found.matrix) == pytest.approx(1)
    others = Rotation.exp(a)
    left = ((mirrored - found.apply(b)) ** 2).sum()
    assert (((mirrored - others[:, None].apply(b)) ** 2).sum((1, 2)) >= left).all()
    np.testing.assert_array_equal(Rotation.aligning(a.T @ b).matrix, Rotation.nearest(a.T @ b).matrix)


def test_aligning_about_one_axis_still_gives_a_rotation_that_fits() -> None:
    a, b = np.array([0.0, 0.6, 0.8]), np.array([1.0, 0, 0])
    found = Rotation.aligning(np.outer(a, b))
    np.testing.assert_allclose(found.apply(b), a, atol=1e-12)
    Rotation(found.matrix)
    Rotation(Rotation.aligning(np.zeros((3, 3))).matrix)


def test_a_product_of_accepted_rotations_is_accepted() -> None:
    rounded = Rotation(np.eye(3) * (1 + 4.5e-7))
    product = Rotation.identity()
    for _ in range(50):
        product = product @ rounded
    assert_allclose(product.matrix, np.eye(3), atol=1e-4)


def test_values_are_frozen_copies() -> None:
    matrix = np.eye(3)
    rotation = Rotation(matrix)
    matrix[0, 0] = 7
    assert rotation.matrix[0, 0] == 1
    for value in (
        rotation,
        rotation @ rotation,
        rotation.inverse(),
        Rotation.exp([0, 0, 1]),
        Rotation.identity(4),
    ):
        assert not value.matrix.flags.writeable


def test_indexing_selects_from_the_batch() -> None:
    turns = Rotation.exp(np.arange(12.0).reshape(4, 3) / 10)
    assert turns[1:3].batch == (2,)
    same(turns[2], Rotation.exp([0.6, 0.7, 0.8]))


def test_a_rotation_times_an_array_is_refused() -> None:
    with pytest.raises(TypeError):
        Rotation.identity() @ "R"  # type: ignore[operator]


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (
            lambda: Rotation(np.eye(4)),
            "rotation matrix must have shape (..., 3, 3); got (4, 4).",
        ),
        (
            lambda: Rotation(np.diag([1, 1, 1.01])),
            "rotation matrix must be orthonormal; it is off by 0.02 in R^T R (tolerance 1e-06).",
        ),
        (
            lambda: Rotation(np.stack([np.eye(3), 2 * np.eye(3), np.eye(3)])),
            "rotation matrix must be orthonormal; entry (1,) is off by 3 in R^T R (tolerance 1e-06).",
        ),
        (
            lambda: Rotation(np.diag([1, 1, -1])),
            "rotation matrix must be right-handed; at least one has determinant -1 (a mirror image).",
        ),
        (
            lambda: Rotation(np.full((3, 3), np.nan)),
            "rotation matrix must be finite; 9 entries are not, the first at index (0, 0).",
        ),
        (
            lambda: Rotation.from_quaternion_wxyz([[1, 0, 0, 0], [0, 0, 0, 0]]),
            "quaternion must not be zero; 1 of 2 have norm zero.",
        ),
        (
            lambda: Rotation.from_quaternion_xyzw([1, 0, 0]),
            "quaternion must have shape (..., 4); got (3,).",
        ),
        (
            lambda: Rotation.nearest(np.zeros((2, 3, 3))),
            "matrix must have one nearest rotation; 2 of 2 do not.",
        ),
        (lambda: Rotation.from_rpy([0, 0]), "rpy must have shape (..., 3); got (2,)."),
    ],
)
def test_bad_input_is_named(make, text: str) -> None:
    with pytest.raises(BadValue) as error:
        make()
    assert str(error.value) == text


def test_the_rotation_nearest_to_a_rotation_is_itself_and_none_is_a_reflection() -> None:
    turns = Rotation.exp(np.random.default_rng(3).normal(size=(50, 3)))
    assert np.array_equal(Rotation.nearest(turns.matrix).matrix, turns.matrix)
    mirrored = turns.matrix * [1.0, 1.0, -0.5]
    assert np.allclose(np.linalg.det(Rotation.nearest(mirrored).matrix), 1.0)
