"""Logs of which no stream tells how the sensor is accelerated."""

from __future__ import annotations

from dataclasses import replace

import pytest

from sanity.held_poses import BODY, swaying
from steelyard.findings import UNMEASURED
from steelyard.pipelines.held_object import identify


@pytest.mark.parametrize("seed", range(2))
def test_without_positions_slow_turns_tell_no_inertia(seed: int) -> None:
    """An arm turns the sensor about points a metre away, and what that accelerates looks like inertia."""
    recording = swaying(seed, 3.0, 0.1)
    (stream,) = recording.streams
    turned = {q: v for q, v in stream.channels.items() if q != "position"}
    found = identify(replace(recording, streams=(replace(stream, channels=turned),)))
    assert found.inertia_com is None
    (said,) = (f for f in found.findings if f.code == "inertia-not-identified")
    assert said.remedy == UNMEASURED["inertia-not-identified"]
    assert abs(found.mass / BODY.mass - 1) < 0.02
