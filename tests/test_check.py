"""The checks at the public boundary: what passes is frozen and keeps its shape."""

from __future__ import annotations

import numpy as np
import pytest

from steelyard import check
from steelyard.errors import (
    BadDescription,
    BadFile,
    BadValue,
    CannotAnswer,
    MissingDependency,
    SteelyardError,
)


@pytest.mark.parametrize("shape", [(), (1,), (3,), (0, 3), (2, 1, 3)])
def test_shapes_are_kept(shape: tuple[int, ...]) -> None:
    assert check.finite("x", np.ones(shape)).shape == shape


def test_frozen_copies_what_others_could_change_and_nothing_else() -> None:
    mine = np.arange(6.0)
    frozen = check.frozen(mine)
    assert not np.shares_memory(frozen, mine)
    assert not np.shares_memory(check.frozen(mine[::2]), mine)
    assert mine.flags.writeable
    assert not frozen.flags.writeable
    assert check.frozen(frozen) is frozen


def test_whole_numbers_keep_their_values_and_shape() -> None:
    given = np.array([[1.0, -2.0, 3.0]])
    whole = check.whole("x", given)
    assert (whole.dtype, whole.tolist(), whole.flags.writeable) == (np.int64, [[1, -2, 3]], False)
    assert check.whole("x", []).shape == (0,)
    mine = np.arange(3)
    assert not np.shares_memory(check.whole("x", mine), mine)


@pytest.mark.parametrize("wrong", [0.5, np.nan, -np.inf, 1e300])
def test_what_is_no_whole_number_is_refused(wrong: float) -> None:
    with pytest.raises(BadValue, match=r"x must be (whole numbers; got|finite; 1 entry is not)"):
        check.whole("x", [0.0, wrong])


def test_no_rotations_at_all_are_fine() -> None:
    assert check.rotations("R", np.zeros((0, 3, 3))).shape == (0, 3, 3)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (
            lambda: check.finite("force", [[1, np.nan], [np.inf, 2]]),
            "force must be finite; 2 entries are not, the first at index (0, 1).",
        ),
        (lambda: check.positive("rate", [1, 2]), "rate must be a number; got [1, 2]."),
        (lambda: check.not_negative("mass", "heavy"), "mass must be a number; got 'heavy'."),
        (lambda: check.not_negative("mass", -3), "mass must be a finite number, zero or above; got -3."),
        (lambda: check.matrices("J", np.zeros((2, 3)), 4, 4), "J must have shape (..., 4, 4); got (2, 3)."),
    ],
)
def test_bad_input_is_named(make, text: str) -> None:
    with pytest.raises(BadValue) as error:
        make()
    assert str(error.value) == text


@pytest.mark.parametrize(
    ("kind", "status"),
    [(BadFile, 2), (BadDescription, 2), (BadValue, 2), (MissingDependency, 2), (CannotAnswer, 3)],
)
def test_exit_statuses(kind: type[SteelyardError], status: int) -> None:
    assert kind("text").exit_status == status


def test_a_missing_dependency_names_its_install_line() -> None:
    error = MissingDependency.of("pyarrow", "parquet", "Reading Parquet")
    assert str(error) == (
        "Reading Parquet needs the package 'pyarrow'. Install it with: pip install 'steelyard[parquet]'"
    )
