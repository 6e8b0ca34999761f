"""Rows of one pose that remember each other count as fewer: error bars hold without a clock, too."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from held_poses import BODY, recorded

from steelyard.logs.recording import Recording, Stream
from steelyard.pipelines import held_object
from steelyard.sanity.rows.still_rows import examine_memory
from steelyard.simulate.noise import Spectrum
from steelyard.spatial import Rotation


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


def with_offsets(seed: int, poses: int) -> Recording:
    """Return poses of a hundred rows, each with an offset of its own, as stiction in an arm makes."""
    rng = np.random.default_rng(seed)
    rotation = Rotation.exp(rng.normal(0, 1.2, (poses, 3)))
    pull = np.repeat(rotation.inverse().apply(np.array([0, 0, -9.81])), 100, axis=0)
    offset = np.repeat(rng.normal(size=(poses, 6)), 100, axis=0) + 0.3 * rng.normal(size=(100 * poses, 6))
    body = np.concatenate([np.cross(BODY.com, -BODY.mass * pull), -BODY.mass * pull], 1)
    felt = body + np.repeat([0.01, 0.2], 3) * offset
    channels = {"force": felt[:, 3:], "torque": felt[:, :3], "rotation": np.repeat(rotation.matrix, 100, axis=0)}
    return Recording((Stream("poses", channels, poses=True),), np.array([0, 0, -9.81]))


@pytest.mark.parametrize("poses", [8, 24])
def test_rows_that_share_an_offset_count_as_one(poses: int) -> None:
    off = []
    for seed in range(20):
        found = held_object.identify(with_offsets(seed, poses))
        assert found.codes() == {"inertia-not-identified"}
        off.append(np.append(found.mass - float(BODY.mass), found.com - BODY.com) / found.std[:4])
    assert 0.6 < float(np.sqrt(np.mean(np.square(off)))) < 1.4
    assert f"one mean for each pose was read, {poses} in all" in " ".join(found.notes)


def test_channels_that_do_not_measure_hide_no_offsets() -> None:
    (stream,) = with_offsets(0, 24).streams
    silent = replace(stream, channels={**stream.channels, "torque": np.zeros((len(stream), 3))})
    (note,) = examine_memory(replace(with_offsets(0, 24), streams=(silent,))).notes
    assert note.startswith("poses scatter")
