"""Logs of which no stream tells how the sensor is accelerated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import steelyard as sy
from sanity.held_poses import BODY, recorded, swaying
from steelyard.findings import UNMEASURED
from steelyard.logs.recording import Recording
from steelyard.pipelines.held_object import identify
from steelyard.simulate.handling import motion_arrays
from steelyard.workshop.catalogue import build


def without_positions(recording: Recording) -> Recording:
    """Return the recording of which nothing tells how the sensor is accelerated."""
    (stream,) = recording.streams
    turned = {q: v for q, v in stream.channels.items() if q != "position"}
    return replace(recording, streams=(replace(stream, channels=turned),))


@pytest.mark.parametrize("noise", [0.1, 1.0])
def test_without_positions_slow_turns_tell_no_inertia(noise: float) -> None:
    """An arm turns the sensor about points a metre away, and what that accelerates looks like inertia."""
    found = identify(without_positions(swaying(1, 3.0, noise)))
    assert found.inertia_com is None
    assert "wrench-unexplained" not in found.codes()
    (said,) = (f for f in found.findings if f.code == "inertia-not-identified")
    assert said.remedy == UNMEASURED["inertia-not-identified"]
    assert abs(found.mass / BODY.mass - 1) < 0.02


def test_with_stops_the_rows_at_rest_tell_all_there_is() -> None:
    """Turns that are derived from poses at rest are their noise."""
    found = identify(without_positions(recorded("paper", 0)))
    assert "no stream measures the acceleration: only the rows at rest were used" in found.notes
    assert "wrench-unexplained" not in found.codes()
    assert abs(found.mass - BODY.mass) < 3 * found.std[0] < 6e-3


def test_with_parts_their_shape_tells_it() -> None:
    tool = build("hammer")
    recording = replace(without_positions(swaying(0, 3.0, 0.1)), object_pose=tool.X_OS.inverse())
    found = identify(recording, parts=tool.parts)
    assert "give std_mm and std_deg with pose_in_sensor, both 0 where it is exact" in found.notes
    assert found.inertia_com is not None
    assert np.abs(np.diag(found.inertia_com - BODY.inertia_com)).max() < 0.2 * np.trace(BODY.inertia_com)


@pytest.mark.parametrize("seed", range(3))
def test_without_a_clock_errors_that_last_are_in_the_bars(seed: int) -> None:
    """Rows in the order of measuring tell what lasts from one to the next; in another order it passes for noise."""
    rng = np.random.default_rng(seed)
    made = motion_arrays("slow")
    lasting = 0.1 * np.sin(np.arange(len(made["time"]))[:, None] / rng.uniform(20, 80, 3) + rng.uniform(0, 6, 3))
    held = BODY.wrench(made["gravity_sensor"])
    columns = {
        "force": held.force + lasting + 0.05 * rng.standard_normal(lasting.shape),
        "torque": held.torque + 0.002 * rng.standard_normal(lasting.shape),
        "rotation": made["rotation_world_from_sensor"],
    }
    mixed = rng.permutation(len(lasting))
    ordered, shuffled = (
        sy.identify(sy.recording(**{name: rows[order] for name, rows in columns.items()}, gravity=[0, 0, -9.81]))
        for order in (slice(None), mixed)
    )
    assert "clock-missing" in ordered.codes()
    assert ordered.std[0] > 1.5 * shuffled.std[0]
    assert abs(ordered.mass - BODY.mass) < 3 * ordered.std[0]
