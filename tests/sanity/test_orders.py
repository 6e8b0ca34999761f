"""Columns of force or torque in another order or with other signs: the answer is that of the log as it was meant."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sanity.held_poses import recorded
from sound_hammer import hammer_answer, hammer_log
from steelyard.logs.recording import Recording
from steelyard.pipelines.held_object import identify
from steelyard.sanity.before import examine
from steelyard.simulate.scenarios import body
from steelyard.spatial import Rotation

XY, CYCLE = np.eye(3)[[1, 0, 2]], np.eye(3)[[1, 2, 0]]
X, Y, Z = (np.diag(1 - 2 * row) for row in np.eye(3))
NONE = np.eye(3)


def mixed(recording: Recording, force: np.ndarray, torque: np.ndarray) -> Recording:
    """Return the recording with the columns of force and torque each multiplied by a matrix (3, 3)."""
    for quantity, matrix in (("force", force), ("torque", torque)):
        streams = tuple(
            s.with_channels(**{quantity: s.channels[quantity] @ matrix.T}) if quantity in s.channels else s
            for s in recording.streams
        )
        recording = replace(recording, streams=streams)
    return recording


def in_world(recording: Recording) -> Recording:
    """Return the recording of one stream with its wrench in the axes of W, said to be so."""
    (stream,) = recording.streams
    turn = Rotation(stream.channels["rotation"])
    felt = {part: turn.apply(stream.channels[part] + bias) for part, bias in (("force", [0, 2, 1]), ("torque", 0.1))}
    return replace(recording, streams=(replace(stream.with_channels(**felt), frames={"force": "W", "torque": "W"}),))


@pytest.mark.parametrize(
    ("force", "torque", "said", "remedy"),
    [
        (XY, NONE, ["forces fit one body if they are read as Fx = Fy, Fy = Fx, Fz = Fz"], "in the order Fy, Fx, Fz"),
        (
            Z,
            NONE,
            ["read as Fx = Fx, Fy = Fy, Fz = -Fz"],
            "Turn the sign of Fz round where the force columns are logged.",
        ),
        (X @ Y @ XY, NONE, ["read as Fx = -Fy, Fy = -Fx, Fz = Fz"], "give these in the order Fy, Fx, Fz"),
        (NONE, CYCLE, ["read as Tx = Tz, Ty = Tx, Tz = Ty"], "in the order Tz, Tx, Ty"),
        (XY, XY, ["Fx = Fy, Fy = Fx, Fz = Fz", "Tx = Ty, Ty = Tx, Tz = Tz"], "in the order Fy, Fx, Fz"),
        (X, -X, ["Fx = -Fx, Fy = Fy, Fz = Fz", "Tx = Tx, Ty = -Ty, Tz = -Tz"], "Turn the sign of Fx round"),
    ],
)
def test_another_order_or_sign_is_put_right(
    force: np.ndarray, torque: np.ndarray, said: list[str], remedy: str
) -> None:
    read, found = examine(mixed(hammer_log(), force, torque))
    assert [f.code for f in found] == ["force-unit"] * len(said)
    assert all(words in f.message and not f.left_in for words, f in zip(said, found, strict=True))
    assert remedy in found[0].remedy
    for stream, meant in zip(read.streams, hammer_log().streams, strict=True):
        for part in {"force", "torque"} & stream.channels.keys():
            np.testing.assert_array_equal(stream.channels[part], meant.channels[part])


@pytest.mark.parametrize(
    ("force", "read"), [(CYCLE, "Fx = Fz, Fy = Fx, Fz = Fy"), (X @ Y, "Fx = -Fx, Fy = -Fy, Fz = Fz")]
)
def test_forces_that_are_turned_without_their_torques(force: np.ndarray, read: str) -> None:
    sound = hammer_log()
    put, found = examine(mixed(sound, force, NONE))
    assert [f.code for f in found] == ["force-unit"]
    assert f"forces fit one body if they are read as {read}" in found[0].message
    for stream, meant in zip(put.streams, sound.streams, strict=True):
        if "force" in meant.channels:
            np.testing.assert_array_equal(stream.channels["force"], meant.channels["force"])
    # With its torques it is the sensor that is turned.
    assert [f.code for f in examine(mixed(sound, force, force))[1]] == ["sensor-turned"]


def test_torques_of_the_other_sign_are_put_right() -> None:
    found, sound = identify(mixed(hammer_log(), NONE, -NONE)), hammer_answer()
    assert found.codes() == sound.codes() | {"force-unit"}
    np.testing.assert_allclose(found.parameters.vector, sound.parameters.vector)


@pytest.mark.parametrize(("force", "torque"), [(XY, NONE), (Z, NONE), (NONE, XY), (XY, XY)])
def test_columns_in_the_axes_of_the_world(force: np.ndarray, torque: np.ndarray) -> None:
    sound = in_world(recorded("paper", 0))
    read, found = examine(mixed(sound, force, torque))
    assert {f.code for f in found} == {"force-unit"}
    for part in ("force", "torque"):
        np.testing.assert_array_equal(read.streams[0].channels[part], sound.streams[0].channels[part])


def test_at_rest_the_other_sign_is_told_too() -> None:
    rng = np.random.default_rng(7)
    rotation = Rotation.exp(rng.normal(0, 1.2, (16, 3)))
    held = body("hammer").parameters()
    pull = rotation.inverse().apply(np.array([0, 0, -9.81]))
    torque = np.cross(held.com, -held.mass * pull) + 1e-3 * rng.normal(size=(16, 3))
    force = -held.mass * pull + 1e-2 * rng.normal(size=(16, 3))
    (stream, *_) = recorded("paper", 0).streams
    channels = {"force": force, "torque": torque @ XY, "rotation": rotation.matrix}
    table = Recording((replace(stream, channels=channels, time=None, poses=True),), np.array([0, 0, -9.81]))
    _, (found,) = examine(table)
    assert "the other sign of all three fits as well, with the centre of mass beyond the origin of S" in found.message
