"""Rows of one pose that remember each other count as fewer: error bars hold without a clock, too."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from held_poses import BODY, recorded

from steelyard.logs.recording import Recording
from steelyard.pipelines import held_object
from steelyard.sanity.memory import examine_memory
from steelyard.simulate.noise import Spectrum


def table(seed: int, spectrum: Spectrum) -> Recording:
    """Return a thousand rows in six poses without a clock."""
    log = recorded("static", seed, spectrum)
    return replace(log, streams=tuple(replace(s, time=None, poses=True) for s in log.streams))


@pytest.mark.parametrize("spectrum", ["white", "2hz"])
def test_bars_hold(spectrum: Spectrum) -> None:
    inside = []
    for seed in range(40):
        found = held_object.identify(table(seed, spectrum))
        off = np.append(found.mass - float(BODY.mass), found.com - BODY.com) / found.std[:4]
        inside.append(np.abs(off) < 1.96)
    assert np.mean(inside) > 0.9


def test_white_rows_and_single_rows_stay() -> None:
    white = table(0, "white")
    assert examine_memory(white) is white
    slow = table(0, "2hz")
    one = replace(slow, streams=tuple(replace(s, channels={q: v[::200] for q, v in s.channels.items()})
                                      for s in slow.streams))  # fmt: skip
    assert examine_memory(one) is one


def test_it_is_said() -> None:
    read = examine_memory(table(0, "2hz"))
    (note,) = read.notes
    assert "rows of one pose remember each other over" in note
    assert 6 <= len(read.streams[0]) <= 60


def test_a_motion_without_a_clock_is_no_pose() -> None:
    log = recorded("slow", 0, "2hz")
    moving = replace(log, streams=tuple(replace(s, time=None, poses=True) for s in log.streams))
    assert examine_memory(moving) is moving
