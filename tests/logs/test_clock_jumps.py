"""Clocks that jump within a log are found, named and put right, and nothing else passes for one."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from made_recordings import BODY, Swing, recording

from steelyard.identify.estimate import Estimate
from steelyard.logs import clock_jumps
from steelyard.logs.alignment import Aligned, align
from steelyard.logs.clock import jump_gap
from steelyard.logs.recording import Recording, Stream
from steelyard.pipelines.held_object import identify

DURATION = 16.0


def made(seed: int = 0, *, imu: bool = False, **how) -> Recording:
    return recording(Swing(seed, DURATION), seed=seed + 1, position=not imu, imu=imu, **how)


@cache
def answer() -> Estimate:
    """Return the answer of the sound recording."""
    return identify(made())


def with_streams(sound: Recording, *changed: Stream) -> Recording:
    by = {stream.name: stream for stream in changed}
    return replace(sound, streams=tuple(by.get(s.name, s) for s in sound.streams))


def stream_of(log: Recording, name: str) -> Stream:
    return next(s for s in log.streams if s.name == name)


def leaping(sound: Recording, name: str, by: float, at: float = 7.0) -> Recording:
    """Return the recording with a clock that leaps ahead [s] at a time [s]."""
    stream = stream_of(sound, name)
    return with_streams(sound, replace(stream, time=stream.time + by * (stream.time > at)))


def losing(sound: Recording, name: str, seconds: float, at: float = 7.0) -> Recording:
    """Return the recording with rows that were lost and whose stamps were counted, as by a `rate`."""
    stream = stream_of(sound, name)
    kept = stream.rows((stream.time < at) | (stream.time > at + seconds))
    return with_streams(sound, replace(kept, time=stream.time[: len(kept)]))


def unsteady(log: Recording) -> list[str]:
    return said_of_clocks(align(log))


def said_of_clocks(found: Aligned | Estimate) -> list[str]:
    return [f.message for f in found.findings if f.code == "clock-unsteady"]


def size_told(message: str) -> tuple[float, float]:
    """Return by how much [s] the message says that a clock jumped, and the standard deviation."""
    size, rest = message.split(" by ")[1].split(" ± ")
    return float(size) / 1e3, float(rest.split(" ms")[0]) / 1e3


def assert_right(found: Estimate, wider: float = 1.15) -> None:
    # Beside rows that were lost something may pass for a tap.
    assert {"clock-unsteady"} <= found.codes() <= {"clock-unsteady", "outliers"}
    assert abs(found.mass - BODY.mass) < 3 * found.std[0]
    assert (np.abs(found.com - BODY.com) < 4 * found.std[1:4]).all()
    assert (np.abs(found.parameters.people - BODY.people)[4:] < 4 * found.std[4:]).all()
    assert (found.std < wider * answer().std).all()


@pytest.mark.parametrize("by", [0.02, 0.7])
def test_a_clock_that_leaps_costs_nothing_and_is_told_with_its_place(by: float) -> None:
    found = identify(leaping(made(), "pose.csv", by))
    assert_right(found)
    (said,) = said_of_clocks(found)
    assert said.startswith("The clock of 'pose.csv' leaps ahead by ")
    assert said.endswith(" at 7.0 s, beside the wrench; its stamps from there on were put right.")
    size, std = size_told(said)
    assert abs(size - by) < 4 * std < 5e-3


@pytest.mark.parametrize(("name", "beside"), [("wrench.csv", "'pose.csv'"), ("pose.csv", "the wrench")])
def test_a_leap_is_told_of_the_stream_that_leaps_and_is_no_hole(name: str, beside: str) -> None:
    sound = recording(Swing(0, 24.0), seed=1, position=True, imu=False)
    aligned = align(leaping(sound, name, 1.0))
    (said,) = [f.message for f in aligned.findings if f.code == "clock-unsteady"]
    assert said.startswith(f"The clock of '{name}' leaps ahead by ")
    assert f"at 7.0 s, beside {beside}; its stamps" in said
    assert not [note for note in aligned.notes if "no rows" in note]


def test_rows_left_out_beside_a_jump_are_no_hole() -> None:
    assert not [note for note in align(losing(made(), "pose.csv", 0.1)).notes if "no rows" in note]


def test_a_leap_of_the_wrench_beside_two_streams_is_one() -> None:
    (said,) = unsteady(leaping(made(imu=True), "wrench.csv", 0.1))
    assert said.startswith("The clock of 'wrench.csv' leaps ahead by ")
    assert "'pose.csv'" in said
    assert "'imu.csv'" in said


@pytest.mark.parametrize("name", ["pose.csv", "imu.csv"])
def test_of_two_streams_the_one_that_leaps_is_named(name: str) -> None:
    (said,) = unsteady(leaping(made(imu=True), name, 0.2))
    assert said.startswith(f"The clock of '{name}' leaps ahead by ")


@pytest.mark.parametrize("name", ["pose.csv", "wrench.csv"])
def test_rows_that_were_lost_uncounted_are_put_right(name: str) -> None:
    found = identify(losing(made(), name, 0.1))
    (said,) = said_of_clocks(found)
    assert "without its rows within 0.3 s" in said
    size, std = size_told(said)
    assert abs(size - 0.1) < max(4 * std, 2e-3)
    # The pause that is put where poses leap widens the bar of the mass.
    assert_right(found, wider=1.4 if name == "wrench.csv" else 11.0)


def test_leaps_of_two_clocks_are_both_put_right() -> None:
    found = identify(leaping(leaping(made(), "pose.csv", 0.2, at=5.0), "wrench.csv", 0.15, at=11.0))
    first, second = sorted(said_of_clocks(found), key=lambda said: "at 11.0 s" in said)
    for said, name, size in ((first, "pose.csv", 0.2), (second, "wrench.csv", 0.15)):
        assert f"'{name}' leaps ahead" in said
        assert abs(size_told(said)[0] - size) < 0.01
    assert (np.abs(found.parameters.people - BODY.people) < 4 * found.std).all()


def test_a_late_clock_that_leaps_keeps_its_delay() -> None:
    aligned = align(leaping(made(pose_delay=0.03), "pose.csv", 0.1))
    assert abs(aligned.delays_s["pose.csv"] - 0.03) < 1e-3


@pytest.mark.parametrize("rate", [1e-3, -1e-2])
def test_a_clock_that_runs_fast_does_not_leap(rate: float) -> None:
    stream = stream_of(made(), "pose.csv")
    (said,) = unsteady(with_streams(made(), replace(stream, time=stream.time * (1 + rate))))
    assert " runs " in said


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("imu", [False, True])
def test_sound_clocks_are_not_searched(seed: int, imu: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clock_jumps, "_searched", lambda *_: pytest.fail("a sound log was searched"))
    assert not unsteady(made(seed, imu=imu))


def test_stamps_with_a_hole_that_are_right_do_not_leap() -> None:
    stream = stream_of(made(), "pose.csv")
    assert not unsteady(with_streams(made(), stream.rows((stream.time < 7.0) | (stream.time > 7.2))))


@pytest.mark.parametrize("what", ["load", "slip", "hand", "pose errors"])
def test_what_happens_to_the_load_is_no_clock(what: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clock_jumps, "_APART", 0.0)  # every log is searched
    monkeypatch.setattr(clock_jumps, "LEAST_S", 0.0)
    sound = made(1)
    wrench, poses = sound.streams
    force, torque = wrench.channels["force"], wrench.channels["torque"]
    later = (wrench.time > 8.0)[:, None]
    if what == "load":
        force, torque = force * (1 + 0.3 * later), torque * (1 + 0.3 * later)
    elif what == "slip":
        torque = torque + later * np.cross([0.0, 0.01, 0.005], force)
    elif what == "hand":
        force = force + later * (wrench.time < 12)[:, None] * np.array([3.0, -5.0, 4.0])
    else:
        turns = poses.channels["rotation"].reshape(-1, 9)
        weight = np.random.default_rng(1).normal(size=(18, 6)) * ([0.2] * 3 + [0.02] * 3)
        smooth = np.concatenate([turns**2, np.sin(3 * turns)], 1) @ weight
        off = np.stack([np.interp(wrench.time, poses.time, column) for column in smooth.T], 1)
        force, torque = force + off[:, :3], torque + off[:, 3:]
    changed = replace(wrench, channels={**wrench.channels, "force": force, "torque": torque})
    assert not [said for said in unsteady(with_streams(sound, changed)) if "runs" not in said]


def test_a_gap_is_a_jumps_where_it_is_as_long() -> None:
    time = np.arange(0.0, 10.0, 0.01)
    late = time + 0.1 * (np.arange(len(time)) >= 400)
    assert jump_gap(late, 0.1, 4.3) == 399
    assert jump_gap(late, 0.3, 4.3) is None
    assert jump_gap(late, 0.1, 7.0) is None
    assert jump_gap(late, -0.1, 4.3) is None
