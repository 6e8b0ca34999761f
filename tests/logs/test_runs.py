from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from steelyard.logs.runs import distinct_rows, lasting, runs


@pytest.mark.parametrize(
    ("mask", "found"),
    [
        ([], []),
        ([0, 0], []),
        ([1], [[0, 1]]),
        ([1, 1, 0, 1], [[0, 2], [3, 4]]),
        ([0, 1, 1, 0, 0, 1, 0], [[1, 3], [5, 6]]),
    ],
)
def test_runs_are_told_by_first_row_and_the_row_after_the_last(mask: list[int], found: list[list[int]]) -> None:
    assert runs(np.array(mask, bool)).tolist() == found
    assert runs(np.array(mask, bool)).shape == (len(found), 2)


@given(st.lists(st.booleans(), max_size=40))
def test_runs_are_the_mask_and_do_not_touch(mask: list[bool]) -> None:
    found = runs(np.array(mask, bool))
    rows = [k for start, stop in found for k in range(start, stop)]
    assert rows == [k for k, held in enumerate(mask) if held]
    assert (found[1:, 0] > found[:-1, 1]).all()


@given(st.lists(st.booleans(), max_size=40), st.integers(0, 5))
def test_what_lasts_are_the_runs_of_so_many_rows(mask: list[bool], least: int) -> None:
    given_ = np.array(mask, bool)
    kept = lasting(given_, least)
    assert runs(kept).tolist() == [run for run in runs(given_).tolist() if run[1] - run[0] >= least]


@pytest.mark.parametrize("mask", [
    np.ones((7, 3), np.bool_), np.zeros((1, 4), np.bool_), np.random.default_rng(3).random((200, 5)) < 0.5,
    np.repeat(np.random.default_rng(4).random((9, 3)) < 0.5, 20, axis=0),
])  # fmt: skip
def test_distinct_rows_are_those_of_numpy(mask):
    found, which = distinct_rows(mask)
    expected, place = np.unique(mask, axis=0, return_inverse=True)
    np.testing.assert_array_equal(found, expected)
    np.testing.assert_array_equal(which, place.ravel())
