"""A Stream or Recording made by hand takes lists, and says what is wrong with what it was given."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import steelyard as sy
from steelyard.logs.recording import Recording, Stream

N = 40
RNG = np.random.default_rng(0)
TURN = sy.Rotation.exp(RNG.normal(size=(N, 3)))
TIME = np.arange(N) / 100
GRAVITY = [0, 0, -9.81]
HINT = "sy.recording(time=.., force=.., ..) makes recordings of arrays, lists and rotations."
CHANNELS = {"force": RNG.normal(size=(N, 3)), "torque": RNG.normal(size=(N, 3)), "rotation": TURN.matrix}
STREAM = Stream("s", CHANNELS, TIME)


def test_streams_and_recordings_take_lists() -> None:
    stream = Stream("s", {name: values.tolist() for name, values in CHANNELS.items()}, TIME.tolist())  # type: ignore[arg-type]
    made = Recording([stream], GRAVITY)  # type: ignore[arg-type]
    assert np.array_equal(made.gravity * 2, [0, 0, -19.62])
    assert np.array_equal(made.streams[0].channels["force"], CHANNELS["force"])


@pytest.mark.parametrize(
    ("made", "text"),
    [
        (lambda: Stream("s", {}), f"s: channels must be a dict of quantity and array. {HINT}"),
        (
            lambda: Stream("s", {"forces": CHANNELS["force"]}),
            's: unknown quantity "forces"; there are force, torque, rotation, position, linear_velocity, '
            "angular_velocity, linear_acceleration, angular_acceleration, specific_force, gravity.",
        ),
        (
            lambda: Stream("s", {"rotation": TURN.matrix.reshape(N, 9)}),
            f"s, rotation: expected shape (N, 3, 3); found (40, 9). {HINT}",
        ),
        (lambda: Stream("s", {"rotation": TURN}), f"s, rotation: expected an array of numbers; got Rotation. {HINT}"),
        (
            lambda: Stream("s", {"force": CHANNELS["force"]}, TIME[1:]),
            "s: the lengths differ: force 40, time 39 rows. Each quantity needs one row per sample.",
        ),
        (
            lambda: Stream("s", {"force": CHANNELS["force"]}, frames={"force": "base"}),
            's: the frame of force must be "S" or "W"; got \'base\'.',
        ),
        (lambda: Recording(STREAM, GRAVITY), f"a Recording takes a tuple of Streams; got Stream. {HINT}"),
        (
            lambda: Recording((STREAM,), -9.81),
            "gravity must have shape (..., 3); got ().",
        ),
        (
            lambda: Recording((STREAM,), GRAVITY, "on-sensor"),
            "wrench_sign must be 1 (on-object) or -1 (on-sensor); got 'on-sensor'.",
        ),
        (
            lambda: Recording((Stream("s", {"force": np.full((N, 3), np.nan)}),), GRAVITY),
            "s: rows miss numbers (NaN, infinity); sy.recording leaves such rows out.",
        ),
    ],
)
def test_values_made_by_hand_are_checked(made: Any, text: str) -> None:
    with pytest.raises(sy.BadInput) as caught:
        made()
    assert str(caught.value) == text
