"""Stamps that jitter are evened where the numbers say so, and only there."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import make_lsq_spline

from steelyard.check import Array
from steelyard.logs.recording import Recording, Stream
from steelyard.logs.steady import _broken_line, with_steady_stamps
from steelyard.spatial import Rotation

STEP = 0.008
COUNT = 4000


def swinging(time: Array) -> dict[str, Array]:
    """Return poses of a sensor that swings about two axes, as encoders give them."""
    turn = np.stack([np.sin(1.7 * time), 0.8 * np.sin(1.1 * time + 1), 0 * time], axis=1)
    place = 0.1 * np.stack([np.sin(2.1 * time), np.cos(1.3 * time), np.sin(0.7 * time)], axis=1)
    noise = np.random.default_rng(3).normal(0, 2e-5, (2, len(time), 3))
    return {"rotation": Rotation.exp(turn + noise[0]).matrix, "position": place + noise[1]}


def steadied(time: Array, stamps: Array) -> tuple[Array, tuple[str, ...]]:
    """Return the stamps that poses at `time` get which were stamped so."""
    stream = Stream("pose.csv", swinging(time), stamps)
    recording, notes = with_steady_stamps(Recording((stream,), np.array([0, 0, -9.81])))
    (out,) = recording.streams
    assert out.time is not None
    return out.time, notes


@pytest.mark.parametrize("drift", [0.0, 1e-4])
@pytest.mark.parametrize("jitter", [0.3e-3, 1e-3])
def test_jitter_is_taken_out(jitter: float, drift: float) -> None:
    time = np.arange(COUNT) * STEP * (1 + drift)
    stamps = time + np.random.default_rng(0).normal(0, jitter, COUNT)
    found, (note,) = steadied(time, stamps)
    assert np.std(found - time) < 0.15 * jitter
    assert note.startswith(f"the stamps of 'pose.csv' jitter by {1e3 * jitter:.2g} ms")


def test_lost_rows_and_a_pause_stay_where_they_were() -> None:
    rng = np.random.default_rng(1)
    time = np.arange(COUNT) * STEP
    time = time[(rng.random(COUNT) > 0.05) & ((time < 9) | (time > 11.5))]
    found, notes = steadied(time, time + rng.normal(0, 0.5e-3, len(time)))
    assert len(notes) == 1
    assert np.abs(found - time).max() < 0.5e-3


def test_a_clock_that_is_right_is_believed_however_unsteady_the_rate() -> None:
    rng = np.random.default_rng(2)
    time = np.arange(COUNT) * STEP + rng.uniform(-0.3, 0.3, COUNT) * STEP
    found, notes = steadied(time, time)
    assert notes == ()
    assert np.array_equal(found, time)


def test_rows_lost_behind_much_jitter_are_not_closed_up() -> None:
    rng = np.random.default_rng(4)
    time = (np.arange(COUNT) * STEP)[rng.random(COUNT) > 0.05]
    stamps = np.sort(time + rng.normal(0, 3e-3, len(time)))
    found, notes = steadied(time, stamps)
    assert notes == ()
    assert np.array_equal(found, stamps)


@pytest.mark.parametrize("count", [2, 49])
def test_short_streams_and_repeated_stamps_are_left(count: int) -> None:
    for stamps in (np.arange(count) * STEP, np.repeat(np.arange(100) * STEP, 2)):
        found, notes = steadied(stamps, stamps)
        assert notes == ()
        assert np.array_equal(found, stamps)


def test_a_slow_rate_is_evened_as_well() -> None:
    stamps = 10.0 * np.arange(120) + np.random.default_rng(5).normal(0, 0.2, 120)
    stream = Stream("slow.csv", {"force": np.sin(0.02 * np.floor(stamps / 10 + 0.5))[:, None] * np.ones(3)}, stamps)
    recording, notes = with_steady_stamps(Recording((stream,), np.array([0, 0, -9.81])))
    time = recording.streams[0].time
    assert time is not None
    assert len(notes) == 1
    assert np.abs(time - 10.0 * np.arange(120)).max() < 0.1


def test_the_broken_line_is_the_nearest_one() -> None:
    rng = np.random.default_rng(1)
    x = np.delete(np.arange(900.0), np.arange(300, 350))
    y = 5.0 + 0.002 * x + 1e-4 * rng.normal(size=len(x))
    knees = x[[0, 200, 500, len(x) - 1]]
    expected = make_lsq_spline(x, y, np.concatenate([knees[:1], knees, knees[-1:]]), k=1)(x)
    np.testing.assert_allclose(_broken_line(x, y, knees), expected, rtol=0, atol=1e-12)
