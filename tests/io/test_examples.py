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
    (stream,) = read_recording(data_dir / "kuka-lbr-med14-ati-gamma-imu" / "0-calibration_fts-accel.csv").streams
    assert stream.poses
    assert set(stream.channels) == {"force", "torque", "specific_force", "gravity", "rotation"}


FORMATS = """
[log]
gravity = [0, 0, -9.82]          # in W, m/s^2
wrench  = "on-sensor"

[noise]
force = 0.05

[object]
pose_in_sensor = { position = [0, 0, 0.12], unit = "m", rotation = [1,0,0, 0,1,0, 0,0,1], form = "matrix", std_mm = 2, std_deg = 1 }

[[stream]]                       # one file or topic = one clock
path   = "kuka-lbr-med14-ati-gamma-imu/1-baseline_wrench.csv"
time   = { columns = ["t"], unit = "us" }
force  = { columns = ["fx", "fy", "fz"], unit = "N" }
torque = { columns = ["tx", "ty", "tz"], unit = "N*m" }

[[stream]]
path     = "kuka-lbr-med14-ati-gamma-imu/1-baseline_orientations.csv"
time     = { columns = ["t"], unit = "us" }
rotation = { columns = ["r11","r12","r13","r21","r22","r23","r31","r32","r33"], form = "matrix" }   # S to W

[[stream]]
path  = "kuka-lbr-med14-ati-gamma-imu/1-baseline_accel.csv"
time  = { columns = ["t"], unit = "us" }
delay = { value = 7.5, unit = "ms" }
mount = { rotation = [0,-1,0, 0,0,1, -1,0,0], form = "matrix", position = [0, 0, 0], unit = "m" }
specific_force = { columns = ["ax", "ay", "az"], unit = "g" }
"""  # noqa: E501


def test_the_description_that_the_format_shows(data_dir: Path, tmp_path: Path) -> None:
    (tmp_path / "log.toml").write_text(FORMATS)
    recording = read_recording(tmp_path / "log.toml", data_dir)
    assert recording.object_pose is not None
    assert recording.noise == {"force": 0.05}
    assert [stream.delay for stream in recording.streams] == [None, None, 0.0075]
    turned = recording.streams[2].channels["specific_force"] @ np.array([[0, -1, 0], [0, 0, 1], [-1, 0, 0]]).T
    down = Rotation(recording.streams[1].channels["rotation"][:50]).inverse().apply(-recording.gravity).mean(0)
    assert float(np.abs(turned[:50].mean(0) - down).max()) < 1.0
