"""Rows that waited in a buffer are put where they were sampled, and nothing else passes for waiting."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from made_recordings import BODY, Swing, recording

from steelyard.check import Array
from steelyard.identify.estimate import Estimate
from steelyard.logs.alignment import align
from steelyard.logs.arrival import when_sampled
from steelyard.logs.recording import Recording
from steelyard.pipelines.held_object import identify

STEP = 0.008
COUNT = 4000
CLOSE = 1e-4  # [s] between rows that come together


def in_order(arrival: Array, apart: float = CLOSE) -> Array:
    """Return when rows (N,) come that cannot overtake one another."""
    k = apart * np.arange(len(arrival))
    return np.maximum.accumulate(arrival - k) + k


def held_back(time: Array, at: Array, long: float) -> Array:
    """Return stamps of rows that are held back at some times for so long [s], and then come at once."""
    waits = (time[:, None] >= at) & (time[:, None] < at + long)
    return in_order(np.where(waits, at + long, time[:, None]).max(1))


def in_packets(time: Array, rows: int) -> Array:
    last = np.minimum((np.arange(len(time)) // rows + 1) * rows, len(time)) - 1
    return in_order(time[last])


def by_radio(time: Array, mean: float, rng: np.random.Generator) -> Array:
    """Return stamps that are mostly late by little, and now and then by 50 to 200 ms."""
    late = rng.exponential(mean, len(time)) + (rng.random(len(time)) < 0.003) * rng.uniform(0.05, 0.2, len(time))
    return in_order(time + late, 2e-5)


def even(lost: float = 0.0, seed: int = 0) -> Array:
    time = STEP * np.arange(COUNT)
    return time[np.random.default_rng(seed).random(COUNT) >= lost]


WAITS: dict[str, Callable[[Array, np.random.Generator], Array]] = {
    "held back once": lambda time, _: held_back(time, np.array([7.3]), 0.2),
    "held back often": lambda time, rng: held_back(time, np.sort(rng.uniform(0, 30, 20)), 0.1),
    "held back for long": lambda time, _: held_back(time, np.array([7.3]), 1.5),
    "from the beginning": lambda time, _: in_order(np.maximum(time, 0.5)),
    "to the end": lambda time, _: in_order(np.where(time > time[-1] - 0.2, time[-1], time)),
    "packets of three": lambda time, _: in_packets(time, 3),
    "packets of 25": lambda time, _: in_packets(time, 25),
    "by a fair radio": lambda time, rng: by_radio(time, 1e-3, rng),
    "by a poor radio": lambda time, rng: by_radio(time, 8e-3, rng),
}


@pytest.mark.parametrize("drift", [0.0, 1e-4])
@pytest.mark.parametrize("name", WAITS)
def test_what_rows_waited_for_is_taken_away(name: str, drift: float) -> None:
    time = even()
    stamps = WAITS[name](time, np.random.default_rng(1))
    found = when_sampled(stamps * (1 + drift))
    assert found is not None
    off = found[1] / (1 + drift) - time
    assert np.quantile(np.abs(off - np.median(off)), 0.99) < 0.5 * STEP
    assert np.std(off) < 0.1 * STEP


@pytest.mark.parametrize("name", ["held back often", "by a fair radio"])
def test_rows_that_were_lost_leave_the_others_where_they_were(name: str) -> None:
    time = even(lost=0.02)
    found = when_sampled(WAITS[name](time, np.random.default_rng(2)))
    assert found is not None
    assert np.std(found[1] - time) < 0.15 * STEP


def test_no_stamp_becomes_later_and_prompt_rows_may_keep_theirs() -> None:
    rng = np.random.default_rng(3)
    time = even() + rng.uniform(-0.1, 0.1, COUNT) * STEP
    stamps = held_back(time, np.array([7.3]), 0.2)
    found = when_sampled(stamps)
    assert found is not None
    late, every = found
    assert (every <= late).all()
    assert (late <= stamps).all()
    assert np.array_equal(late[stamps == time], time[stamps == time])
    assert np.abs(late - time).max() < 0.5 * STEP


def _two_rates() -> Array:
    before = STEP * np.arange(COUNT // 2)
    return np.concatenate([before, before[-1] + 0.8 * STEP * np.arange(1, COUNT // 2)])


RIGHT: dict[str, Callable[[np.random.Generator], Array]] = {
    "even": lambda _: even(),
    "a sixth lost": lambda _: even(lost=0.17),
    "a third lost": lambda _: even(lost=0.33),
    "at random": lambda rng: np.cumsum(rng.exponential(STEP, COUNT)),
    "wandering": lambda rng: np.cumsum(rng.gamma(4, STEP / 4, COUNT)),
    "uneven": lambda rng: even() + rng.uniform(-0.45, 0.45, COUNT) * STEP,
    "jitter": lambda rng: np.sort(even() + rng.normal(0, 0.3 * STEP, COUNT)),
    "a new rate": lambda _: _two_rates(),
    "a new rate that jitters": lambda rng: _two_rates() + rng.normal(0, 1e-3, COUNT - 1),
    "half the rate": lambda _: even()[(np.arange(COUNT) % 2 == 0) | (np.arange(COUNT) < COUNT // 2)],
    "holes": lambda _: even()[even() % 3 > 0.4],
    "pairs": lambda _: even()[: 2 * (COUNT // 4)].repeat(2)[: COUNT // 2] * 2 + np.tile([0, 0.2 * STEP], COUNT // 4),
}


@pytest.mark.parametrize("name", RIGHT)
@pytest.mark.parametrize("seed", range(3))
def test_an_unsteady_rate_is_no_waiting(name: str, seed: int) -> None:
    assert when_sampled(RIGHT[name](np.random.default_rng(seed))) is None


def late(sound: Recording, name: str, waiting: Callable[[Array], Array]) -> Recording:
    """Return the recording with a stream whose stamps are those of arrival."""
    streams = (replace(s, time=waiting(s.time)) if s.name == name else s for s in sound.streams)
    return replace(sound, streams=tuple(streams))


def made(seed: int) -> Recording:
    return recording(Swing(seed, 16.0), seed=seed + 1, position=True, imu=False)


@pytest.fixture(scope="module")
def sound() -> Estimate:
    return identify(made(0))


@pytest.mark.parametrize("name", ["wrench.csv", "pose.csv"])
@pytest.mark.parametrize(
    ("waiting", "rate_is_lost"),
    [
        (lambda time: held_back(time, np.array([6.3]), 0.2), False),
        (lambda time: held_back(time, np.array([3.1, 5.2, 7.9, 12.0]), 0.4), False),
        (lambda time: in_packets(time, 8), True),
        (lambda time: by_radio(time, 1e-3, np.random.default_rng(5)), True),
    ],
    ids=["once", "often", "packets", "radio"],
)
def test_waiting_costs_nothing(
    name: str, waiting: Callable[[Array], Array], rate_is_lost: bool, sound: Estimate
) -> None:
    found = identify(late(made(0), name, waiting))
    # Where all rows wait for others of their packet, the stream is late.
    assert found.codes() <= {"stream-delayed"}
    assert (np.abs(found.parameters.people - BODY.people) < 4 * found.std).all()
    # Nothing tells by how little rows that waited were uneven.
    assert (found.std < (12 if rate_is_lost else 4) * sound.std).all()


def test_waiting_is_told_and_is_no_hole() -> None:
    notes = align(late(made(0), "pose.csv", lambda time: held_back(time, np.array([6.3]), 0.4))).notes
    (said,) = [note for note in notes if "waited" in note or "no rows" in note]
    assert said.startswith("rows of 'pose.csv' waited and came together, up to 398 ms late, as from a buffer")


def test_poses_that_are_sampled_in_bursts_keep_stamps_that_are_right() -> None:
    swing = Swing(0, 16.0)
    sound = recording(swing, seed=1, position=True, imu=False)
    k = np.arange(1600)
    time = 0.1 * (k // 10) + 0.002 * (k % 10)
    R, _, _, place, _, _ = swing.at(time)
    pose = replace(sound.streams[1], channels={"rotation": R, "position": place}, time=time)
    assert not [n for n in align(replace(sound, streams=(sound.streams[0], pose))).notes if "waited" in n]
