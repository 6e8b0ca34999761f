"""Forces in the axes of the base are a controller's: a note says where a payload that is set in it would not show."""

from __future__ import annotations

import pytest

from sanity.held_poses import recorded, swaying
from steelyard.logs.recording import Recording
from steelyard.pipelines.held_object import identify
from steelyard.sanity.readings.glance import in_axes
from steelyard.spatial import Rotation

WORDS = "which takes away the weight of the payload that is set in it"


def in_base(recording: Recording, set_kg: float = 0.0) -> Recording:
    """Return the recording with its wrench in the axes of W, and the weight of a payload at S taken away."""
    (stream,) = recording.streams
    R = Rotation(stream.channels["rotation"])
    force, torque = (R.apply(stream.channels[part]) for part in ("force", "torque"))
    turned = stream.with_channels(force=force + set_kg * recording.gravity, torque=torque)
    return in_axes(Recording((turned,), recording.gravity), ("torque", "force"))


def said(recording: Recording) -> list[str]:
    return [note for note in identify(recording).notes if WORDS in note]


@pytest.mark.parametrize("set_kg", [0.0, 0.05])
def test_slow_motion_would_not_show_it(set_kg: float) -> None:
    (note,) = said(in_base(swaying(0), set_kg))
    assert "set none before the run" in note


def test_a_wrench_in_the_sensors_axes_is_taken_for_a_sensors() -> None:
    assert said(swaying(0)) == []


def test_brisk_motion_shows_it_and_nothing_is_said() -> None:
    assert said(in_base(recorded("paper", 0))) == []
    assert "weight-compensated" in identify(in_base(recorded("paper", 0), 0.3)).codes()
