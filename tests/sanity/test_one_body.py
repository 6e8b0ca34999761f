"""What spoils a whole log is not taken for a hand, and a hand is still found beside it."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from sanity.held_poses import of_the_tip, recorded
from steelyard.logs.recording import Recording
from steelyard.pipelines.held_object import identify


def felt(recording: Recording, change: np.ndarray) -> Recording:
    """Return the recording with the force columns multiplied by `change` (3, 3)."""
    (stream,) = recording.streams
    force = stream.channels["force"] @ change.T
    return replace(recording, streams=(replace(stream, channels={**stream.channels, "force": force}),))


def pushed(recording: Recording, start: float, end: float) -> Recording:
    """Return the recording with a push of 12 N along x from start to end [s]."""
    (stream,) = recording.streams
    assert stream.time is not None
    share = np.clip((stream.time - start) / (end - start), 0, 1)
    force = stream.channels["force"] + np.outer(np.sqrt(np.sin(np.pi * share)), [12.0, 0, 0])
    return replace(recording, streams=(replace(stream, channels={**stream.channels, "force": force}),))


@pytest.mark.parametrize("gain", [1.2, 1.4])
def test_unlike_gains_are_no_hand(gain: float) -> None:
    found = identify(felt(recorded("paper", 0), np.diag([gain, 1, 1])))
    assert "gains-differ" in found.codes()
    assert "contact" not in found.codes()


def test_a_hand_is_found_beside_positions_of_another_point() -> None:
    found = identify(pushed(of_the_tip(recorded("paper", 0), (0.0, 0.0, 0.05)), 6.0, 8.0))
    assert found.codes() == {"motion-mismatch", "contact"}
    (contact,) = (f for f in found.findings if f.code == "contact")
    times = re.search(r"touched the object at (.*?) to (.*?) s, with", contact.message)
    assert times is not None
    assert 5 < float(times[1]) < 6.2
    assert 7.8 < float(times[2]) < 9


def test_times_are_told_since_the_first_row_of_the_wrench() -> None:
    touched = pushed(recorded("paper", 0), 6.0, 8.0)
    (stream,) = touched.streams
    assert stream.time is not None
    later = replace(touched, streams=(replace(stream, time=stream.time + 1000.0),))
    said, said_later = (
        [f.message for f in identify(each).findings if f.code == "contact"] for each in (touched, later)
    )
    assert len(said) == 1
    assert said_later == said
