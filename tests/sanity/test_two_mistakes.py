"""Mistakes that hide one another: each of two is told, and put right, where either alone would be."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from synthetic import Kind, motion, write
from traps import edited

from steelyard.errors import CannotAnswer
from steelyard.io import read_recording
from steelyard.logs.recording import Recording, Stream
from steelyard.pipelines.held_object import identify
from steelyard.sanity.before import examine
from steelyard.spatial import Rotation

TILT = (7.0, -6.0)
DOWN = Rotation.from_rpy(np.radians([*TILT, 0.0])).apply(np.array([0.0, 0.0, -9.81]))
# Radians read as degrees.
SMALL = np.radians(1.0)


def read(kind: Kind, folder: pytest.TempPathFactory) -> Recording:
    """Return what three devices wrote, without the accelerometer."""
    recording = read_recording(write(folder.mktemp("two"), kind))
    streams = tuple(s for s in recording.streams if "specific_force" not in s.channels)
    return Recording(streams, recording.gravity, recording.wrench_sign)


def of_wrench(recording: Recording, change: Callable[[Stream], Stream]) -> Recording:
    """Return the recording with the stream of the wrench changed."""
    return replace(recording, streams=tuple(change(s) if "force" in s.channels else s for s in recording.streams))


def rotations(recording: Recording) -> np.ndarray:
    """Return the matrices (N, 3, 3) of the poses."""
    return next(s.channels["rotation"] for s in recording.streams if "rotation" in s.channels)


def off(recording: Recording) -> float:
    """Return how far gravity is off [degrees]."""
    along = recording.gravity @ DOWN / np.linalg.norm(recording.gravity) / np.linalg.norm(DOWN)
    return float(np.degrees(np.arccos(min(along, 1.0))))


def test_a_tilt_shows_once_quaternions_are_read_right(tmp_path_factory: pytest.TempPathFactory) -> None:
    made = read(Kind(seed=1, tilt_deg=TILT, quaternion_swapped=True), tmp_path_factory)
    recording, found = examine(made)
    assert [f.code for f in found] == ["quaternion-order", "base-tilted"]
    assert off(recording) < 0.5


def test_a_tilt_shows_beside_a_hole(tmp_path_factory: pytest.TempPathFactory) -> None:
    def without(stream: Stream) -> Stream:
        assert stream.time is not None
        return stream.rows((stream.time < 3.0) | (stream.time > 6.5))

    recording, found = examine(of_wrench(read(Kind(seed=2, tilt_deg=TILT), tmp_path_factory), without))
    assert [f.code for f in found] == ["base-tilted"]
    assert off(recording) < 0.5


def test_a_tilt_shows_beside_stray_readings(tmp_path_factory: pytest.TempPathFactory) -> None:
    rows = np.random.default_rng(4).integers(0, 7000, 20)

    def stray(values: np.ndarray) -> np.ndarray:
        values = values.copy()
        values[rows] += 150.0
        return values

    recording, found = examine(edited(read(Kind(seed=3, tilt_deg=TILT), tmp_path_factory), force=stray))
    assert [f.code for f in found] == ["base-tilted"]
    assert off(recording) < 0.5


@pytest.mark.parametrize("torques", [1.0, 1000.0], ids=["N m", "N mm"])
def test_a_wrench_in_the_base_beside_small_angles(torques: float, tmp_path_factory: pytest.TempPathFactory) -> None:
    kind = Kind(seed=4)

    def into_base(stream: Stream) -> Stream:
        turned = motion(kind.seed).at(np.asarray(stream.time)).rotation
        return replace(stream, channels={q: turned.apply(v) for q, v in stream.channels.items()})

    def small(R: np.ndarray) -> np.ndarray:
        return Rotation.from_rpy(SMALL * Rotation(R).rpy()).matrix

    given = read(kind, tmp_path_factory)
    made = edited(of_wrench(given, into_base), rotation=small, torque=lambda v: torques * v)
    recording, found = examine(made)
    codes = ["gravity-frame", "gravity-frame", *["length-in-mm"] * (torques > 1)]
    assert [f.code for f in found] == codes
    assert "in the axes of W" in found[0].message
    assert "in radians, not in degrees" in found[1].message
    (felt,) = (s for s in recording.streams if "force" in s.channels)
    assert felt.frames == {"force": "W", "torque": "W"}
    np.testing.assert_allclose(rotations(recording), rotations(given), atol=1e-6)


def test_a_refusal_asks_for_no_poses_where_there_are_enough(tmp_path_factory: pytest.TempPathFactory) -> None:
    made = read(Kind(seed=5, with_position=False), tmp_path_factory)
    spin = Rotation.exp(np.array([0.3, 0.2, 1.0])).matrix

    def of_another_run(R: np.ndarray) -> np.ndarray:
        return np.asarray(R[::-1] @ spin @ R)

    with pytest.raises(CannotAnswer) as caught:
        identify(edited(made, rotation=of_another_run))
    assert "the forces do not turn with it" in str(caught.value)
    assert "Add still poses" not in str(caught.value)
