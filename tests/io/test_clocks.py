"""Clocks that leap: refused where the rest of the reading would put the rows on more even stamps than memory holds."""

from __future__ import annotations

import numpy as np
import pytest

from steelyard.errors import BadValue
from steelyard.io.streams.clocks import Clock

EVEN = 0.005 * np.arange(4000)


@pytest.mark.parametrize(
    ("stamps", "said"),
    [
        (
            np.r_[EVEN[:3000], 1.7e9 + EVEN[3000:]],
            r"jumps by 1\.7e\+09 s from row 3000 to row 3001, where",
        ),
        (np.r_[EVEN[:-1], 1e6], "from row 3999 to row 4000"),
        (np.r_[-1e6, EVEN[1:]], "from row 1 to row 2"),
        (np.cumsum(np.where(np.arange(4000) % 100, 1e-6, 100.0)), r"jumps by 100 s"),
    ],
)
def test_a_clock_that_was_set_in_the_middle_is_named(stamps: np.ndarray, said: str) -> None:
    with pytest.raises(BadValue, match=said) as caught:
        Clock.of(stamps, "s", "log.toml, time")
    assert str(caught.value).endswith("the clock was set, or two logs were joined. Cut the log there.")
    with pytest.raises(BadValue, match=said):
        Clock.of((1e9 * stamps).astype(np.int64), "ns", "log.toml, time")


@pytest.mark.parametrize("hole", [0.0, 10.0, 3600.0, 80_000.0])
def test_pauses_of_hours_are_no_leaps(hole: float) -> None:
    assert len(Clock.of(np.r_[EVEN, EVEN[-1] + 0.005 + hole + EVEN], "s", "t").stamps) == 8000


def test_a_table_of_few_poses_may_take_days() -> None:
    assert len(Clock.of(86400.0 * np.arange(8), "s", "t").stamps) == 8


@pytest.mark.parametrize("tick", [0.0156, 0.02, 1.0])
def test_many_rows_of_one_stamp_are_a_coarse_clock(tick: float) -> None:
    stamps = np.floor(np.arange(0, 60, 0.002) / tick) * tick
    assert len(Clock.of(stamps, "s", "log.toml, time").stamps) == 30_000


def test_a_coarse_clock_that_was_set_is_named_by_the_distance_of_its_rows() -> None:
    stamps = np.floor(EVEN / 0.02) * 0.02
    with pytest.raises(
        BadValue, match=r"jumps by 1\.7e\+09 s from row 3000 to row 3001, where rows are 0\.005 s apart"
    ):
        Clock.of(np.r_[stamps[:3000], 1.7e9 + stamps[3000:]], "s", "log.toml, time")
