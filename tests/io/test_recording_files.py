"""A recording that is written and read again is the same; what a description cannot say is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from steelyard.errors import BadValue
from steelyard.io import read_recording
from steelyard.io.recordings.recording_files import write_recording
from steelyard.logs.recording import Mount, Recording, Stream
from steelyard.spatial import Rotation

GRAVITY = np.array([0.0123456789, -0.2, -9.81234567])
TURN = Rotation.exp(np.array([0.3, -0.2, 0.9]))


def wrench(**more: Any) -> Stream:
    rng = np.random.default_rng(0)
    channels = {"force": rng.normal(size=(20, 3)), "torque": rng.normal(size=(20, 3))}
    return Stream("wrench.csv", channels, np.arange(20) / 100, **more)


def pose(**more: Any) -> Stream:
    rng = np.random.default_rng(1)
    channels = {"rotation": Rotation.exp(rng.normal(size=(20, 3))).matrix, "position": rng.normal(size=(20, 3))}
    return Stream("pose.csv", channels, np.arange(20) / 100, {"position": "W"}, **more)


def imu(**more: Any) -> Stream:
    return Stream(
        "imu.csv", {"specific_force": np.random.default_rng(2).normal(size=(20, 3))}, np.arange(20) / 100, **more
    )


def again(recording: Recording, folder: Path) -> Recording:
    return read_recording(write_recording(recording, folder))


def assert_same(a: Stream, b: Stream) -> None:
    assert (a.name, a.delay, a.poses, dict(a.frames)) == (b.name, b.delay, b.poses, dict(b.frames))
    assert (a.time is None, a.mount is None) == (b.time is None, b.mount is None)
    assert list(a.channels) == list(b.channels)
    for name, values in a.channels.items():
        np.testing.assert_allclose(b.channels[name], values, atol=1e-8)
    if a.time is not None and b.time is not None:
        np.testing.assert_allclose(b.time, a.time, atol=1e-11)
    for mine, other in ((a.arm, b.arm), (a.turn and a.turn.matrix, b.turn and b.turn.matrix)):
        np.testing.assert_allclose(np.float64(other), np.float64(mine), atol=1e-11)


def test_all_that_a_description_says_comes_back(tmp_path: Path) -> None:
    tool = tmp_path / "gripper.json"
    tool.write_text("{}")
    streams = (
        wrench(frames={"force": "W"}, mount=Mount(TURN, np.array([0.01, 0, -0.02]))),
        pose(delay=-0.0125),
        imu(delay=0.0, mount=Mount(position=np.array([0, 0.03, 0]))),
    )
    noise = {"force": 0.05, "angular_acceleration": 0.123456789}
    made = Recording(streams, GRAVITY, -1, noise, str(tool))
    found = again(made, tmp_path / "log")
    assert (found.wrench_sign, found.noise, found.tool) == (-1, noise, str(tool))
    np.testing.assert_allclose(found.gravity, GRAVITY, rtol=1e-11)
    for mine, other in zip(streams, found.streams, strict=True):
        assert_same(mine, other)


def test_still_poses_come_back_as_such(tmp_path: Path) -> None:
    streams = tuple(replace(stream, time=None, poses=True) for stream in (wrench(mount=Mount(TURN)), pose()))
    for mine, other in zip(streams, again(Recording(streams, GRAVITY), tmp_path).streams, strict=True):
        assert_same(mine, other)


def test_a_torque_that_is_zero_is_declared(tmp_path: Path) -> None:
    gimbal = replace(wrench(), channels={**wrench().channels, "torque": np.zeros((20, 3))})
    assert_same(gimbal, again(Recording((gimbal, pose()), GRAVITY), tmp_path).streams[0])


def test_a_plain_recording_says_no_more_than_it_must(tmp_path: Path) -> None:
    path = write_recording(Recording((wrench(),), np.array([0, 0, -9.81])), tmp_path)
    assert path.read_text() == (
        '[log]\ngravity = [0, 0, -9.81]   # in the world frame W, m/s^2\nwrench  = "on-object"\n\n'
        '[[stream]]\npath = "wrench.csv"\ntime = { columns = ["t"], unit = "s" }\n'
        'force = { columns = ["fx", "fy", "fz"], unit = "N" }\n'
        'torque = { columns = ["tx", "ty", "tz"], unit = "N*m" }\n'
    )


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (Recording((wrench(),), GRAVITY, dead=(True, *[False] * 5)), "no words for channels of the wrench"),
        (Recording((wrench(),), GRAVITY, noise={"heat": 1.0}), "noise 'heat' of 1.0 cannot be written"),
        (Recording((wrench(),), GRAVITY, noise={"force": 0.0}), "noise 'force' of 0.0 cannot be written"),
        (Recording((imu(frames={"specific_force": "W"}),), GRAVITY), "specific_force in W cannot be written"),
        (Recording((replace(pose(), frames={"position": "S"}),), GRAVITY), "position in S cannot be written"),
        (Recording((wrench(poses=True),), GRAVITY), "a table of still poses cannot be written with time"),
        (Recording((replace(wrench(), name="a.csv#2"),), GRAVITY), r"must end in \.csv, \.tsv, \.txt"),
    ],
)
def test_what_cannot_be_said_is_refused(made: Recording, message: str, tmp_path: Path) -> None:
    with pytest.raises(BadValue, match=message):
        write_recording(made, tmp_path / "new")
    assert not (tmp_path / "new").exists()
