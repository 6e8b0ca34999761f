"""One table of several streams, joined by time: each stream has the rows that hold something of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from steelyard.errors import BadValue
from steelyard.io import read_recording
from steelyard.logs.recording import Recording

NAMES = ["t", "fx", "fy", "fz", "tx", "ty", "tz", "qw", "qx", "qy", "qz"]
WRENCH = 'force = { columns = ["fx", "fy", "fz"] }\ntorque = { columns = ["tx", "ty", "tz"] }\n'
TURN = 'rotation = { columns = ["qw", "qx", "qy", "qz"], form = "quaternion-wxyz" }\n'
TIME = 'time = { columns = ["t"], unit = "us" }\n'
START = 1_700_000_000_000_000


def joined(count: int) -> tuple[list[list[str]], np.ndarray]:
    """Return rows at 1 kHz, every tenth with a pose alone, the others with a wrench alone, and the wrenches."""
    rng = np.random.default_rng(0)
    wrench = rng.normal(size=(count, 6))
    rows = []
    for i in range(count):
        pose = i % 10 == 0
        cells = [""] * 6 + ["1", "0", "0", "0"] if pose else [f"{v:.9g}" for v in wrench[i]] + [""] * 4
        rows.append([str(START + 1000 * i + 1), *cells])
    return rows, wrench


def read(folder: Path, rows: list[list[str]], *streams: str) -> Recording:
    (folder / "a.csv").write_text("\n".join(",".join(row) for row in [NAMES, *rows]) + "\n")
    (folder / "log.toml").write_text("".join(f'[[stream]]\npath = "a.csv"\n{text}' for text in streams))
    return read_recording(folder / "log.toml")


def test_each_stream_has_its_own_rows(tmp_path: Path) -> None:
    rows, wrench = joined(400)
    recording = read(tmp_path, rows, TIME + WRENCH, TIME + TURN)
    first, second = recording.streams
    pose = np.arange(400) % 10 == 0
    assert recording.findings == ()
    np.testing.assert_allclose(first.channels["force"], wrench[~pose, :3], rtol=1e-8)
    assert first.time is not None
    assert second.time is not None
    origin = second.time[0]
    np.testing.assert_array_equal(np.round((first.time - origin) * 1e6), 1000 * np.flatnonzero(~pose))
    np.testing.assert_array_equal(np.round((second.time - origin) * 1e6), 1000 * np.flatnonzero(pose))


def test_a_number_that_is_missing_is_still_told(tmp_path: Path) -> None:
    rows, _ = joined(400)
    rows[1][NAMES.index("fy")] = ""
    (finding,) = read(tmp_path, rows, TIME + WRENCH, TIME + TURN).findings
    assert finding.message == "1 of 360 rows of 'a.csv' miss a number in force: row 1. It was left out."


def test_one_stream_of_a_file_is_judged_as_it_stands(tmp_path: Path) -> None:
    rows, _ = joined(400)
    with pytest.raises(BadValue, match="of 400 rows are NaN, infinite or empty"):
        read(tmp_path, rows, TIME + WRENCH + TURN)


def test_rows_that_belong_together_by_number_stay(tmp_path: Path) -> None:
    rows, _ = joined(400)
    with pytest.raises(BadValue, match="360 of 400 rows are NaN"):
        read(tmp_path, rows, 'kind = "poses"\n' + WRENCH, 'kind = "poses"\n' + TURN)


def test_a_stream_that_is_empty_throughout_is_refused(tmp_path: Path) -> None:
    rows, _ = joined(400)
    rows = [[*row[:7], "", "", "", ""] for row in rows if row[1]]
    with pytest.raises(BadValue, match="rotation: all 360 rows are NaN, infinite or empty"):
        read(tmp_path, rows, TIME + WRENCH, TIME + TURN)
