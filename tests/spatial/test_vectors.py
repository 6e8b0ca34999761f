"""Six-vectors: one kind adds to its own kind, angular part first; cross products."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from steelyard.errors import BadValue
from steelyard.spatial import Acceleration, Twist, Wrench, cross, cross_matrix
from strategies import BATCHES, numbers


@pytest.mark.parametrize("batch", BATCHES)
@given(data=st.data())
def test_cross_agrees_with_numpy(batch: tuple[int, ...], data: st.DataObject) -> None:
    a, b = data.draw(numbers((*batch, 3))), data.draw(numbers((*batch, 3)))
    assert_allclose(cross(a, b), np.cross(a, b), atol=1e-15)
    assert_allclose((cross_matrix(a) @ b[..., None])[..., 0], np.cross(a, b), atol=1e-15)
    assert_array_equal(cross_matrix(a), -np.swapaxes(cross_matrix(a), -1, -2))


@pytest.mark.parametrize("kind", [Twist, Acceleration, Wrench])
@pytest.mark.parametrize("batch", BATCHES)
@given(data=st.data())
def test_six_vectors_are_a_vector_space(kind, batch: tuple[int, ...], data: st.DataObject) -> None:
    a, b = data.draw(numbers((*batch, 6))), data.draw(numbers((*batch, 6)))
    assert_array_equal(kind.from_array(a).array(), a)
    assert_array_equal((kind.from_array(a) + kind.from_array(b)).array(), a + b)
    assert_array_equal((-kind.from_array(a)).array(), -a)
    assert kind.from_array(a).batch == batch


def test_the_angular_part_comes_first() -> None:
    six = np.arange(6.0)
    assert_array_equal(Twist.from_array(six).angular, [0, 1, 2])
    assert_array_equal(Acceleration.from_array(six).linear, [3, 4, 5])
    assert_array_equal(Wrench.from_array(six).torque, [0, 1, 2])
    assert_array_equal(Wrench.from_array(six).force, [3, 4, 5])
    assert_array_equal(Wrench.from_array(np.tile(six, (4, 1)))[2].force, [3, 4, 5])


def test_different_kinds_do_not_add() -> None:
    with pytest.raises(TypeError):
        Twist(np.zeros(3), np.zeros(3)) + Wrench(np.zeros(3), np.zeros(3))  # type: ignore[operator]


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (
            lambda: Wrench(np.zeros(3), np.zeros((2, 3))),
            "wrench: both parts must have one shape; got (3,) and (2, 3).",
        ),
        (lambda: Twist.from_array(np.zeros(3)), "twist must have shape (..., 6); got (3,)."),
        (lambda: Twist(np.zeros(2), np.zeros(2)), "twist (first part) must have shape (..., 3); got (2,)."),
    ],
)
def test_bad_input_is_named(make, text: str) -> None:
    with pytest.raises(BadValue) as error:
        make()
    assert str(error.value) == text
