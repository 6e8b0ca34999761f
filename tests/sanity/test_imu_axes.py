"""Inertial sensors in other axes, or beside a wrench of the other sign: told, and put right."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sanity.synthetic import Kind, write
from steelyard.io import read_recording
from steelyard.logs.recording import Recording, Stream
from steelyard.sanity.before import examine
from steelyard.spatial import Rotation

MOUNTS = [Rotation.identity(), Rotation.exp([0.4, -1.1, 2.0])]


def by_accelerometer(folder: Path, sign_flipped: bool, mount: Rotation) -> Recording:
    """A log whose gravity comes from an accelerometer of unknown mount alone."""
    made = read_recording(write(folder, Kind(sign_flipped=sign_flipped)))
    streams = []
    for stream in made.streams:
        if "rotation" in stream.channels:
            continue
        if "specific_force" in stream.channels:
            felt = mount.apply(stream.channels["specific_force"])
            stream = replace(stream, channels={"specific_force": felt}, mount=None)
        streams.append(stream)
    return replace(made, streams=tuple(streams))


@pytest.mark.parametrize("mount", MOUNTS, ids=["along", "turned"])
def test_the_sign_shows_beside_an_accelerometer_of_unknown_mount(tmp_path: Path, mount: Rotation) -> None:
    made = by_accelerometer(tmp_path, True, mount)
    read, findings = examine(made)
    assert [f.code for f in findings] == ["wrench-sign-flipped"]
    assert "no mounting is" in findings[0].message
    assert read.wrench_sign == -made.wrench_sign


@pytest.mark.parametrize("mount", MOUNTS, ids=["along", "turned"])
def test_a_wrench_of_the_right_sign_is_left_alone(tmp_path: Path, mount: Rotation) -> None:
    assert examine(by_accelerometer(tmp_path, False, mount))[1] == ()


def test_turns_about_one_axis_show_no_sign(tmp_path: Path) -> None:
    """Forces within a plane are those of an accelerometer turned over, too."""
    made = by_accelerometer(tmp_path, False, Rotation.identity())
    angle = np.linspace(0, 5, 2000)
    pull = 9.81 * np.stack([np.sin(angle), 0 * angle, np.cos(angle)], 1)
    time = np.linspace(0, 20, 2000)
    wrench = {"force": -0.7 * pull, "torque": -0.7 * np.cross([0.02, 0.01, 0.1], pull)}
    streams = (Stream("wrench", wrench, time), Stream("imu", {"specific_force": pull}, time))
    read, findings = examine(replace(made, streams=streams))
    assert read.wrench_sign == made.wrench_sign
    assert "wrench-sign-flipped" not in {f.code for f in findings}


def with_gyroscope(folder: Path, frame: str, mount: Rotation) -> Recording:
    """A log with a gyroscope, whose axes are turned by `mount`, said to be in `frame`."""
    made = read_recording(write(folder, Kind()))
    pose = next(s for s in made.streams if "rotation" in s.channels)
    assert pose.time is not None
    turn = pose.channels["rotation"]
    change = np.swapaxes(turn, 1, 2) @ np.gradient(turn, pose.time, axis=0)
    omega = 0.5 * np.stack([change[:, i, j] - change[:, j, i] for i, j in ((2, 1), (0, 2), (1, 0))], 1)
    shown = Stream("gyro", {"angular_velocity": mount.apply(omega)}, pose.time, frames={"angular_velocity": frame})
    return replace(made, streams=(*made.streams, shown))


def test_a_gyroscope_in_s_that_is_said_to_be_in_w(tmp_path: Path) -> None:
    read, findings = examine(with_gyroscope(tmp_path, "W", Rotation.identity()))
    assert [f.code for f in findings] == ["gravity-frame"]
    assert "The angular velocity of 'gyro' is in the axes of S, not of W" in findings[0].message
    assert findings[0].remedy == 'Set frame = "S" in its angular_velocity.'
    assert read.streams[-1].frames["angular_velocity"] == "S"


@pytest.mark.parametrize("unit", ["deg/s", "rad/s"])
def test_a_gyroscope_in_another_unit(tmp_path: Path, unit: str) -> None:
    made = with_gyroscope(tmp_path, "W", Rotation.identity())
    (*others, gyro) = made.streams
    factor = 180 / np.pi if unit == "deg/s" else np.pi / 180
    shown = replace(gyro, channels={"angular_velocity": factor * gyro.channels["angular_velocity"]})
    read, findings = examine(replace(made, streams=(*others, shown)))
    assert [f.code for f in findings] == ["gravity-frame"]
    assert findings[0].remedy == f'Set unit = "{unit}" and frame = "S" in its angular_velocity.'
    meant = gyro.channels["angular_velocity"]
    np.testing.assert_allclose(read.streams[-1].channels["angular_velocity"], meant, atol=1e-12)


def test_a_gyroscope_whose_axes_are_turned(tmp_path: Path) -> None:
    made = with_gyroscope(tmp_path, "S", Rotation.exp([0.0, 0.0, 1.4]))
    read, findings = examine(made)
    assert [f.code for f in findings] == ["imu-rotated"]
    assert "is turned by 80." in findings[0].message
    right = with_gyroscope(tmp_path, "S", Rotation.identity())
    gap = read.streams[-1].channels["angular_velocity"] - right.streams[-1].channels["angular_velocity"]
    assert np.abs(gap).max() < 0.05


def test_a_gyroscope_along_s_is_left_alone(tmp_path: Path) -> None:
    assert examine(with_gyroscope(tmp_path, "S", Rotation.exp([0.0, 0.0, 0.1])))[1] == ()


def in_one_unit(folder: Path, mount: Rotation, gyroscope: Rotation) -> Recording:
    """A log without orientations: an accelerometer in axes turned by `mount`, a gyroscope turned by `gyroscope`."""
    made, turning = by_accelerometer(folder, False, mount), with_gyroscope(folder, "S", gyroscope).streams[-1]
    (imu,) = (s for s in made.streams if "specific_force" in s.channels)
    assert imu.time is not None
    assert turning.time is not None
    clock, values = turning.time - (turning.delay or 0.0), turning.channels["angular_velocity"]
    omega = np.stack([np.interp(imu.time - (imu.delay or 0.0), clock, v) for v in values.T], 1)
    whole = replace(imu, channels={**imu.channels, "angular_velocity": omega})
    return replace(made, streams=tuple(whole if s is imu else s for s in made.streams))


@pytest.mark.parametrize("turn", [[0.4, -1.1, 2.0], [0.0, 0.0, 0.8]])
def test_a_gyroscope_in_the_axes_of_its_accelerometer_is_turned_with_it(tmp_path: Path, turn: list[float]) -> None:
    mount = Rotation.exp(turn)
    read, findings = examine(in_one_unit(tmp_path, mount, mount))
    assert [f.code for f in findings] == ["imu-rotated"]
    assert "is in the axes of its accelerometer, turned by" in findings[0].message
    right, _ = examine(in_one_unit(tmp_path, mount, Rotation.identity()))
    both = [next(s for s in r.streams if "angular_velocity" in s.channels) for r in (read, right)]
    gap, meant = both[0].channels["angular_velocity"], both[1].channels["angular_velocity"]
    assert np.sqrt(((gap - meant) ** 2).mean()) < 0.05 * np.sqrt((meant**2).mean())


@pytest.mark.parametrize("mount", MOUNTS, ids=["along", "turned"])
def test_a_gyroscope_in_s_beside_an_accelerometer_is_left_alone(tmp_path: Path, mount: Rotation) -> None:
    assert examine(in_one_unit(tmp_path, mount, Rotation.identity()))[1] == ()
