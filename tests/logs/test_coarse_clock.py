"""Stamps that several rows share, as a clock of whole ticks gives them, cost nothing where the rows are steady."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_recordings import BODY, Swing, recording

from steelyard.logs.clock import median_step
from steelyard.pipelines.held_object import identify


@pytest.mark.parametrize("sharing", [2, 3])
def test_rows_that_share_stamps_are_told_apart(sharing: int) -> None:
    sound = recording(Swing(duration=12.0), position=True, imu=False)
    coarse = tuple(replace(s, time=np.repeat(s.time[::sharing], sharing)[: len(s.time)]) for s in sound.streams)
    exact, found = identify(sound), identify(replace(sound, streams=coarse))
    assert found.mass == pytest.approx(exact.mass, abs=exact.std[0])
    assert exact.std[0] < 0.01 * BODY.mass
    assert found.inertia_com is not None


@pytest.mark.parametrize(("time", "step"), [([0, 0, 0, 3, 3, 3, 6], 1.0), ([0, 1, 2, 3], 1.0), ([0, 1, 1, 2], 1.0)])
def test_the_step_of_a_clock_of_ticks(time: list[float], step: float) -> None:
    assert median_step(np.array(time, float)) == step
