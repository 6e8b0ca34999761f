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


def test_a_long_log_is_no_leap(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("steelyard.io.streams.clocks._MOST_STEPS", 1000)
    assert len(Clock.of(EVEN, "s", "t").stamps) == 4000


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


@pytest.mark.parametrize(
    ("bits", "counts", "unit", "per_stamp"),
    [(32, 1e6, "us", 1), (32, 1e9, "ns", 1), (16, 1e3, "ms", 1), (32, 1e6, "ns", 1000), (32, 1e6, "s", 1e-6)],
)
def test_a_counter_that_begins_anew_is_counted_on(bits: int, counts: float, unit: str, per_stamp: float) -> None:
    count = np.round(counts * (EVEN[:1500] + 1.0)).astype(np.int64)
    begun = 2**bits - count[700]
    stamps = (count + begun) % 2**bits * (int(per_stamp) if per_stamp >= 1 else per_stamp)
    assert (np.diff(stamps) < 0).sum() > 0
    seconds = Clock.of(stamps, unit, "log.toml, time").seconds_after(0)
    assert np.abs(np.diff(seconds) - 0.005).max() < 1.1 / counts


@pytest.mark.parametrize("fall", [2**32, 2**31, 1e6])
def test_a_clock_that_falls_elsewhere_is_refused(fall: float) -> None:
    stamps = np.round(1e6 * EVEN).astype(np.int64) + 2**33 + 123_456_789
    stamps[2000:] -= int(fall)
    with pytest.raises(BadValue, match="time must not go back; it does once"):
        Clock.of(stamps, "us", "log.toml, time")
