"""Stamps in another unit than seconds are found by the motion that they make, and nothing else is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sanity.held_poses import recorded, swaying
from steelyard.io import read_recording
from steelyard.logs.recording import Recording
from steelyard.pipelines.held_object import identify
from steelyard.sanity.before import examine

DESCRIPTION = """\
[log]
gravity = [0, 0, -9.81]
wrench = "on-sensor"

[[stream]]
path = "data.csv"
time = { columns = ["t"], unit = "ms" }
force = { columns = ["fx", "fy", "fz"], unit = "N" }
torque = { columns = ["tx", "ty", "tz"], unit = "N*m" }
rotation = { columns = ["qw", "qx", "qy", "qz"], form = "quaternion-wxyz" }
"""


def stamped(recording: Recording, times: float) -> Recording:
    """Return the recording with stamps so many times as large."""
    streams = tuple(replace(s, time=None if s.time is None else s.time * times) for s in recording.streams)
    return replace(recording, streams=streams)


@pytest.mark.parametrize(("times", "unit"), [(1e3, "ms"), (1e6, "us"), (1e9, "ns")])
def test_stamps_in_a_smaller_unit_are_read_in_it(times: float, unit: str) -> None:
    recording = recorded("paper", 0)
    read, (found,) = examine(stamped(recording, times))
    assert found.code == "time-unit"
    assert f'unit = "{unit}"' in found.remedy
    np.testing.assert_allclose(read.streams[0].time, recording.streams[0].time, rtol=1e-12)


@pytest.mark.parametrize(("said", "times", "unit"), [("ms", 1e3, "us"), ("ms", 1e6, "ns"), ("us", 1e3, "ns")])
def test_the_unit_is_told_beside_the_one_that_was_said(said: str, times: float, unit: str) -> None:
    recording = stamped(recorded("paper", 0), times)
    streams = tuple(replace(s, said=said) for s in recording.streams)
    (found,) = examine(replace(recording, streams=streams))[1]
    assert f"in {unit}, not in {said}" in found.message
    assert found.remedy == f'Set unit = "{unit}" in time of every stream.'


def test_units_smaller_than_any_are_not_proposed() -> None:
    recording = stamped(recorded("paper", 0), 1e3)
    streams = tuple(replace(s, said="ns") for s in recording.streams)
    assert "time-unit" not in {f.code for f in examine(replace(recording, streams=streams))[1]}


def test_a_description_says_the_unit(tmp_path: Path) -> None:
    (tmp_path / "data.csv").write_text(
        "t,fx,fy,fz,tx,ty,tz,qw,qx,qy,qz\n0,0,0,1,0,0,1,1,0,0,0\n4,0,0,1,0,0,1,1,0,0,0\n"
    )
    (tmp_path / "log.toml").write_text(DESCRIPTION)
    (stream,) = read_recording(tmp_path / "log.toml").streams
    assert stream.said == "ms"


def test_the_answer_is_that_of_seconds() -> None:
    recording = recorded("paper", 0)
    right, found = identify(recording), identify(stamped(recording, 1e3))
    np.testing.assert_allclose(found.parameters.vector, right.parameters.vector, rtol=1e-6, atol=1e-12)
    assert found.codes() == {"time-unit"}


def test_a_declared_delay_has_a_unit_of_its_own() -> None:
    recording = recorded("paper", 0)
    late = replace(recording, streams=tuple(replace(s, delay=0.0075) for s in recording.streams))
    read, (found,) = examine(stamped(late, 1e3))
    assert found.code == "time-unit"
    assert [s.delay for s in read.streams] == [0.0075]


def test_a_log_too_slow_to_show_a_motion_is_left_alone() -> None:
    """Poses a second apart stand still: at any speed they would show no acceleration that the force knows."""
    recording = recorded("static", 0)
    (stream,) = recording.streams
    few = replace(stream, channels={q: v[::100] for q, v in stream.channels.items()}, time=stream.time[::100])
    codes = {f.code for f in examine(replace(recording, streams=(few,)))[1]}
    assert "time-unit" not in codes


@pytest.mark.parametrize("seed", range(4))
def test_a_slow_motion_shows_the_unit_though_its_acceleration_is_weak(seed: int) -> None:
    """The mass that is accelerated is known to a tenth, and by ten of its standard deviations not none."""
    recording = swaying(seed, 0.2, 3.0)
    read, found = examine(stamped(recording, 1e3))
    assert "time-unit" in {f.code for f in found}
    np.testing.assert_allclose(read.streams[0].time, recording.streams[0].time, rtol=1e-12)


@pytest.mark.parametrize("noise", [0.0, 1.0])
@pytest.mark.parametrize("seed", range(3))
def test_hours_with_rare_rows_are_left_alone(seed: int, noise: float) -> None:
    """What moves so slowly feels no acceleration: a note asks, and no unit is named."""
    recording = swaying(seed, 0.8)
    (stream,) = recording.streams
    down = np.einsum("nji,j->ni", stream.channels["rotation"], recording.gravity)
    felt = noise * np.random.default_rng(seed).normal(size=down.shape)
    still = {"force": -2.0 * down + 0.05 * felt, "torque": np.cross(down, [0.02, 0.0, 0.1]) + 0.0025 * felt}
    hours = stamped(replace(recording, streams=(replace(stream, channels={**stream.channels, **still}),)), 1e3)
    read, found = examine(hours)
    assert "time-unit" not in {f.code for f in found}
    assert any("in a smaller unit" in note for note in read.notes)
    assert read.streams[0].time[-1] == hours.streams[0].time[-1]
