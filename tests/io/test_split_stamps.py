"""Stamps in two columns, as ROS writes them, keep every nanosecond."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from steelyard.check import Array
from steelyard.errors import BadDescription, BadValue
from steelyard.io import read_recording

SECONDS = 1_700_000_000
STAMPS = [(SECONDS, 999_999_998), (SECONDS, 999_999_999), (SECONDS + 1, 0), (SECONDS + 1, 1_000_003)]
AFTER = [0.999999998, 0.999999999, 1.0, 1.001000003]
WHERE = 'log.toml, [[stream]] 1 ("a.csv"), time: '
COLUMNS = '"columns" must be one with one unit, or two with two units, such as unit = ["s", "ns"]; '
UNITS = 'two columns of time take two units, the larger first, such as unit = ["s", "ns"]; '
ROS = 'columns = ["sec", "nanosec"], unit = ["s", "ns"]'


def write(path: Path, stamps: list[tuple[object, object]], names: str = "sec,nanosec") -> Path:
    rows = [f"{a},{b},1,2,3,4,5,6,1,0,0,0" for a, b in stamps]
    path.write_text("\n".join([f"{names},fx,fy,fz,tx,ty,tz,qw,qx,qy,qz", *rows]) + "\n")
    return path


def seconds(folder: Path, time: str = ROS, stamps: list[tuple[object, object]] = STAMPS) -> Array:
    write(folder / "a.csv", stamps)
    (folder / "log.toml").write_text(
        f'[[stream]]\npath = "a.csv"\ntime = {{ {time} }}\nforce = {{ columns = ["fx", "fy", "fz"] }}\n'
        'torque = { columns = ["tx", "ty", "tz"] }\n'
        'rotation = { columns = ["qw", "qx", "qy", "qz"], form = "quaternion-wxyz" }\n'
    )
    return read(folder / "log.toml")


def read(path: Path) -> Array:
    (stream,) = read_recording(path).streams
    assert stream.time is not None
    return stream.time


def test_both_columns_are_added_as_integers(tmp_path: Path) -> None:
    assert seconds(tmp_path).tolist() == AFTER


def test_other_units(tmp_path: Path) -> None:
    stamps: list[tuple[object, object]] = [(SECONDS, 999), (SECONDS + 1, 1)]
    np.testing.assert_allclose(
        np.diff(seconds(tmp_path, 'columns = [0, 1], unit = ["s", "ms"]', stamps)), 0.002, rtol=1e-12
    )


def test_a_stamp_that_is_missing_in_part_costs_its_row(tmp_path: Path) -> None:
    many: list[tuple[object, object]] = [(SECONDS, k * 10_000_000) for k in range(30)]
    many[3] = (SECONDS, "")
    assert seconds(tmp_path, stamps=many).tolist() == [k / 100 for k in range(30) if k != 3]


@pytest.mark.parametrize(
    "names",
    ["sec,nanosec", "stamp_sec,stamp_nanosec", "header.stamp.sec,header.stamp.nanosec", "secs,nsecs",
     "/ft/header/stamp/secs,/ft/header/stamp/nsecs"],
)  # fmt: skip
def test_a_bare_table_of_ros(tmp_path: Path, names: str) -> None:
    assert read(write(tmp_path / "a.csv", [(s + 1, ns) for s, ns in STAMPS], names)).tolist() == AFTER


def test_seconds_alone_are_whole_stamps(tmp_path: Path) -> None:
    stamps: list[tuple[object, object]] = [(0, 7), (0.5, 7)]
    assert read(write(tmp_path / "a.csv", stamps, "secs,other")).tolist() == [0, 0.5]


@pytest.mark.parametrize(
    ("time", "message"),
    [
        ('columns = ["sec", "nanosec"], unit = "s"', COLUMNS + "got 2 with 1: ['sec', 'nanosec']."),
        ('columns = ["sec", "nanosec"]', "got 2 with 1"),
        ('columns = ["sec", "nanosec", "fx"], unit = ["s", "ns"]', "got 3 with 2"),
        ('columns = ["sec"], unit = ["s", "ns"]', "2 columns are needed; ['sec'] gives 1."),
        ('columns = ["sec", "nanosec"], unit = ["ns", "s"]', UNITS + "got ['ns', 's']. Possible here: s, ms, us, ns."),
        ('columns = ["sec", "nanosec"], unit = ["s", "s"]', UNITS),
        ('columns = ["sec", "nanosec"], unit = ["s", "min"]', UNITS),
        ('columns = ["sec", "nanosec"], unit = ["s", "us", "ns"]', UNITS),
    ],
)
def test_what_is_no_pair_is_refused(tmp_path: Path, time: str, message: str) -> None:
    with pytest.raises(BadDescription) as caught:
        seconds(tmp_path, time)
    assert str(caught.value).startswith(WHERE)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("first", "message"),
    [
        ((SECONDS, 1_500_000_000), "row 1 holds 1700000000 and 1500000000"),
        ((SECONDS, -5), "row 1 holds 1700000000 and -5"),
        ((SECONDS + 0.5, 5), "row 1 holds 1700000000.5 and 5"),
        ((SECONDS * 10**9, 5), "row 1 holds 1700000000000000000 and 5"),
        (("2024-05-01T12:00:00", 5), "a date with its time of day is a whole stamp"),
    ],
)
def test_numbers_that_are_no_pair_are_refused(tmp_path: Path, first: tuple[object, object], message: str) -> None:
    with pytest.raises(BadValue) as caught:
        seconds(tmp_path, stamps=[first, first])
    assert str(caught.value).startswith(WHERE)
    assert message in str(caught.value)
