"""Rows that miss a number are left out of their stream and told; where they are many, the log is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from steelyard.errors import BadValue, CannotAnswer
from steelyard.io import read_recording
from steelyard.logs.recording import Recording
from steelyard.sanity.before import examine

NAMES = ["t", "fx", "fy", "fz", "tx", "ty", "tz", "qw", "qx", "qy", "qz"]
WRENCH = 'force = { columns = ["fx", "fy", "fz"] }\ntorque = { columns = ["tx", "ty", "tz"] }\n'
TURN = 'rotation = { columns = ["qw", "qx", "qy", "qz"], form = "quaternion-wxyz" }\n'
TIME = 'time = { columns = ["t"] }\n'
WHERE = 'log.toml, [[stream]] {} ("{}")'


def rows(count: int) -> list[list[str]]:
    rng = np.random.default_rng(0)
    turn = rng.normal(size=(count, 4))
    turn /= np.linalg.norm(turn, axis=1, keepdims=True)
    table = np.column_stack([np.arange(count) / 100, rng.normal(size=(count, 6)), turn])
    return [[f"{value:.9g}" for value in row] for row in table]


def with_gaps(table: list[list[str]], *gaps: tuple[int, str, str]) -> list[list[str]]:
    """Return the table with what stands in row (from 1) and column replaced."""
    out = [list(row) for row in table]
    for row, name, text in gaps:
        out[row - 1][NAMES.index(name)] = text
    return out


def read(folder: Path, toml: str, **tables: list[list[str]]) -> Recording:
    for name, table in tables.items():
        lines = [",".join(NAMES), *(",".join(row) for row in table)]
        (folder / f"{name}.csv").write_text("\n".join(lines) + "\n")
    (folder / "log.toml").write_text(toml)
    return read_recording(folder / "log.toml")


def stream(path: str, text: str) -> str:
    return f'[[stream]]\npath = "{path}.csv"\n{text}'


def said(recording: Recording) -> list[str]:
    assert all(finding.code == "rows-missing" for finding in recording.findings)
    return [finding.message for finding in recording.findings]


@pytest.mark.parametrize("count", [10, 11])
def test_up_to_a_tenth_may_be_missing(tmp_path: Path, count: int) -> None:
    table = with_gaps(rows(100), *((9 * k + 1, "fy", "nan") for k in range(count)))
    if count == 10:
        assert len(read(tmp_path, stream("a", TIME + WRENCH + TURN), a=table).streams[0]) == 90
    else:
        with pytest.raises(BadValue, match="force: 11 of 100 rows are NaN, infinite or empty"):
            read(tmp_path, stream("a", TIME + WRENCH + TURN), a=table)


@pytest.mark.parametrize("hole", ["nan", "NaN", "inf", "-inf"])
def test_rows_are_left_out_and_told(tmp_path: Path, hole: str) -> None:
    table = with_gaps(rows(60), (3, "fy", hole), (17, "ty", hole), (17, "fx", hole), (50, "qw", hole))
    recording = read(tmp_path, stream("a", TIME + WRENCH + TURN), a=table)
    assert said(recording) == [
        "3 of 60 rows of 'a.csv' miss a number in force, torque, rotation: rows 3, 17, 50. They were left out."
    ]
    kept = np.delete(np.arange(60), [2, 16, 49])
    (only,) = recording.streams
    assert only.time is not None
    np.testing.assert_allclose(only.time, kept / 100)
    np.testing.assert_allclose(only.channels["force"], np.array(table)[kept, 1:4].astype(float))
    assert not any(values.flags.writeable for values in (*only.channels.values(), only.time))


def test_nothing_missing_is_nothing_said(tmp_path: Path) -> None:
    assert said(read(tmp_path, stream("a", TIME + WRENCH + TURN), a=rows(60))) == []


def test_a_column_that_is_not_used_may_hold_anything(tmp_path: Path) -> None:
    table = with_gaps(rows(20), *((row, "qz", "nan") for row in range(1, 21)))
    gravity = 'gravity = { columns = ["qw", "qx", "qy"] }\n'
    assert said(read(tmp_path, stream("a", TIME + WRENCH + gravity), a=table)) == []


def test_streams_with_clocks_lose_their_own_rows(tmp_path: Path) -> None:
    toml = stream("a", TIME + WRENCH) + stream("b", TIME + TURN)
    recording = read(tmp_path, toml, a=with_gaps(rows(40), (5, "fx", "nan")), b=with_gaps(rows(60), (60, "qz", "nan")))
    assert [len(each) for each in recording.streams] == [39, 59]
    assert said(recording) == [
        "1 of 40 rows of 'a.csv' miss a number in force: row 5. It was left out.",
        "1 of 60 rows of 'b.csv' miss a number in rotation: row 60 (the last). It was left out.",
    ]


def test_streams_matched_by_row_lose_the_same_rows(tmp_path: Path) -> None:
    poses = 'kind = "poses"\n'
    toml = stream("a", poses + WRENCH) + stream("b", poses + TURN)
    first, second = rows(40), rows(40)
    recording = read(
        tmp_path, toml, a=with_gaps(first, (5, "fx", "nan")), b=with_gaps(second, (9, "qz", "nan"), (5, "qz", "nan"))
    )
    assert [len(each) for each in recording.streams] == [38, 38]
    kept = np.delete(np.arange(40), [4, 8])
    np.testing.assert_allclose(recording.streams[0].channels["force"], np.array(first)[kept, 1:4].astype(float))
    assert said(recording) == [
        "1 of 40 rows of 'a.csv' miss a number in force: row 5. It was left out, with the same rows of the other "
        "streams.",
        "2 of 40 rows of 'b.csv' miss a number in rotation: rows 5, 9. They were left out, with the same rows of the "
        "other streams.",
    ]


def test_tables_that_cannot_be_matched_are_not_made_to_match(tmp_path: Path) -> None:
    poses = 'kind = "poses"\n'
    toml = stream("a", poses + WRENCH) + stream("b", poses + TURN)
    with pytest.raises(BadValue, match=r'"a\.csv" 40, "b\.csv" 39 rows'):
        read(tmp_path, toml, a=with_gaps(rows(40), (5, "fx", "nan")), b=rows(39))


def test_a_rate_keeps_its_count(tmp_path: Path) -> None:
    recording = read(
        tmp_path,
        stream("a", 'time = { rate = 100, unit = "Hz" }\n' + WRENCH + TURN),
        a=with_gaps(rows(60), (11, "fx", "nan")),
    )
    (only,) = recording.streams
    assert only.time is not None
    np.testing.assert_allclose(only.time, np.delete(np.arange(60), 10) / 100)


@pytest.mark.parametrize("row", [1, 2, 60])
def test_a_missing_stamp_costs_its_row(tmp_path: Path, row: int) -> None:
    recording = read(tmp_path, stream("a", TIME + WRENCH + TURN), a=with_gaps(rows(60), (row, "t", "nan")))
    (only,) = recording.streams
    assert only.time is not None
    np.testing.assert_allclose(only.time, np.delete(np.arange(60), row - 1) / 100)
    assert "miss a number in time" in said(recording)[0]


def test_more_than_a_tenth_is_refused(tmp_path: Path) -> None:
    toml = stream("a", TIME + WRENCH + TURN)
    at = [(row, "fx", "nan") for row in range(1, 60, 10)]
    assert len(said(read(tmp_path, toml, a=with_gaps(rows(60), *at)))) == 1
    with pytest.raises(BadValue) as caught:
        read(tmp_path, toml, a=with_gaps(rows(60), *at, (60, "fz", "nan")))
    where = WHERE.format(1, "a.csv")
    assert str(caught.value) == (
        f"{where}, force: 7 of 60 rows are NaN, infinite or empty: rows 1, 11, 21, 31, 41, ... "
        "Record again, or delete those rows if they are missing by chance."
    )
    with pytest.raises(BadValue) as caught:
        read(tmp_path, toml, a=with_gaps(rows(60), *at, (60, "qw", "nan")))
    assert str(caught.value).startswith(f"{where}: 7 of 60 rows are NaN, infinite or empty")


def test_rows_that_are_counted_are_those_of_the_file(tmp_path: Path) -> None:
    table = with_gaps(rows(60), (3, "fx", "nan"), (20, "qw", "7"))
    with pytest.raises(BadValue, match=r"the worst is row 20 with norm 7"):
        read(tmp_path, stream("a", TIME + WRENCH + TURN), a=table)
    table = with_gaps(rows(60), (3, "t", "nan"), (20, "t", "0"))
    with pytest.raises(BadValue, match=r"from 0\.18 in row 19 to 0\.0 in row 20"):
        read(tmp_path, stream("a", TIME + WRENCH + TURN), a=table)


def test_too_few_that_remain_cannot_answer(tmp_path: Path) -> None:
    recording = read(tmp_path, stream("a", TIME + WRENCH + TURN), a=with_gaps(rows(12), (4, "fx", "nan")))
    with pytest.raises(CannotAnswer, match=r"'a\.csv' has 11 rows; a log with a clock needs at least 12"):
        examine(recording)


def test_what_reading_found_is_told_once(tmp_path: Path) -> None:
    recording = read(tmp_path, stream("a", TIME + WRENCH + TURN), a=with_gaps(rows(60), (4, "fx", "nan")))
    again, found = examine(recording)
    assert [finding.code for finding in found].count("rows-missing") == 1
    assert "rows-missing" not in [finding.code for finding in examine(again)[1]]


def test_a_bare_table_may_miss_rows_too(tmp_path: Path) -> None:
    names = ["t", "fx", "fy", "fz", "tx", "ty", "tz", "ax", "ay", "az"]
    table = [[row[0], *row[1:7], "0.1", "nan" if i == 3 else "0.2", "0.98"] for i, row in enumerate(rows(60))]
    (tmp_path / "a.csv").write_text("\n".join(",".join(row) for row in [names, *table]))
    recording = read_recording(tmp_path / "a.csv")
    np.testing.assert_allclose(recording.streams[0].channels["specific_force"][:, 2], 0.98 * 9.80665)
    assert len(recording.streams[0]) == 59
    assert said(recording) == ["1 of 60 rows of 'a.csv' miss a number in specific_force: row 4. It was left out."]
