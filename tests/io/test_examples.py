"""The example descriptions read the real recordings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from steelyard.io import read_recording
from steelyard.spatial import Rotation


def test_static(data_dir: Path, examples_dir: Path) -> None:
    recording = read_recording(examples_dir / "kuka_static.toml", data_dir)
    (stream,) = recording.streams
    assert len(stream) == 24
    assert stream.poses
    assert recording.wrench_sign == -1
    gravity = Rotation(stream.channels["rotation"]).inverse().apply(recording.gravity)
    written = np.loadtxt(data_dir / stream.name, delimiter=",", skiprows=1, usecols=(9, 10, 11))
    assert float(np.abs(gravity - written).max()) < 0.01


@pytest.mark.parametrize(("number", "rows"), [(1, [4376, 627, 1593]), (2, [4377, 627, 1593])])
def test_runs(data_dir: Path, examples_dir: Path, number: int, rows: list[int]) -> None:
    recording = read_recording(examples_dir / f"kuka_run{number}.toml", data_dir)
    assert [len(stream) for stream in recording.streams] == [pytest.approx(n, abs=1) for n in rows]
    for stream in recording.streams:
        assert stream.time is not None
        assert stream.delay is None
        assert stream.mount is None
        assert 0 < stream.time[0] < 1
        assert 6 < stream.time[-1] - stream.time[0] < 6.5
    size = np.linalg.norm(recording.streams[2].channels["specific_force"], axis=-1)
    assert 9 < float(np.median(size)) < 10.5


def test_bare_file(data_dir: Path) -> None:
    (stream,) = read_recording(
        data_dir / "kuka-lbr-med14-ati-gamma-imu" / "0-calibration_fts-accel.csv"
    ).streams
    assert stream.poses
    assert set(stream.channels) == {"force", "torque", "specific_force", "gravity", "rotation"}
