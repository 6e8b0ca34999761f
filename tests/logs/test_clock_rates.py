"""Clocks that run fast or slow beside the wrench's are found, named and put right."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from made_recordings import BODY, Swing, recording

from steelyard.identify.estimate import Estimate
from steelyard.logs import clock_rates
from steelyard.logs.alignment import align
from steelyard.logs.clock_rates import ClockRate
from steelyard.pipelines.held_object import identify

# [s]; at ends of the log 1 % is then 60 ms, half a turn of some of its sines at 30 s.
DURATION = 12.0


def made(rate: float, *, stream: str = "pose.csv", seed: int = 0, duration: float = DURATION, **how):
    """Return a recording with the stamps of one stream later and later."""
    sound = recording(Swing(seed, duration), seed=seed + 1, position=True, **how)
    streams = (replace(s, time=s.time * (1 + rate)) if s.name == stream else s for s in sound.streams)
    return replace(sound, streams=tuple(streams))


def unsteady(aligned) -> list[str]:
    return [f.message for f in aligned.findings if f.code == "clock-unsteady"]


def test_stamps_put_right_are_as_late_as_the_first() -> None:
    true = np.linspace(3.0, 50.0, 7)
    clock = ClockRate(late=0.2, more=-0.01, middle=20.0)
    right = clock.right(true + clock.at(true))
    assert np.abs(right - (true + clock.at(true[:1]))).max() < 1e-12


@cache
def answer(rate: float) -> Estimate:
    return identify(made(rate, imu=False))


@pytest.mark.parametrize("rate", [1e-4, 0.01, -0.01])
def test_a_clock_that_runs_fast_costs_nothing(rate: float) -> None:
    sound, found = answer(0.0), answer(rate)
    assert found.codes() == {"clock-unsteady"}
    assert abs(found.mass - BODY.mass) < 3 * found.std[0]
    assert (np.abs(found.com - BODY.com) < 4 * found.std[1:4]).all()
    assert (found.std < 1.15 * sound.std).all()


def test_the_rate_is_told() -> None:
    (said,) = unsteady(answer(0.01))
    assert said.startswith("The clock of 'pose.csv' runs 1 % fast (± ")
    assert said.endswith(" ppm) beside the wrench's; its stamps were put right.")
    (said,) = unsteady(align(made(-3e-4, imu=False)))
    assert "slow (±" in said
    assert abs(float(said.split(" runs ")[1].split(" ppm")[0]) - 300) < 25


def test_a_clock_that_runs_far_away_is_followed_from_the_middle_outward() -> None:
    aligned = align(made(0.01, imu=False, duration=40.0))
    assert len(unsteady(aligned)) == 1
    # The stamps begin as late as they are at first, not where the log's middle is 200 ms late.
    assert abs(aligned.delays_s["pose.csv"]) < 1e-3


@pytest.mark.parametrize("stream", ["pose.csv", "imu.csv"])
def test_of_two_streams_the_one_that_runs_fast_is_named(stream: str) -> None:
    (said,) = unsteady(align(made(2e-3, stream=stream, imu_delay=0.01)))
    assert f"'{stream}'" in said


def test_a_late_clock_that_also_runs_fast_keeps_its_delay() -> None:
    late = recording(Swing(2, DURATION), position=True, imu=False, pose_delay=0.03)
    streams = (late.streams[0], replace(late.streams[1], time=late.streams[1].time * 1.001))
    aligned = align(replace(late, streams=streams))
    assert len(unsteady(aligned)) == 1
    assert abs(aligned.delays_s["pose.csv"] - 0.03) < 1e-3


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("imu", [False, True])
def test_clocks_of_one_rate_are_not_named(seed: int, imu: bool) -> None:
    assert not unsteady(align(made(0.0, seed=seed, imu=imu)))


@pytest.mark.parametrize("seed", range(4))
def test_a_hand_on_the_object_is_no_clock(seed: int) -> None:
    sound = made(0.0, seed=seed, imu=False)
    wrench = sound.streams[0]
    pushed = (wrench.time > 4) & (wrench.time < 9)
    force = wrench.channels["force"] + pushed[:, None] * np.array([3.0, -5.0, 4.0])
    hand = replace(wrench, channels={**wrench.channels, "force": force})
    assert not unsteady(align(replace(sound, streams=(hand, *sound.streams[1:]))))


class Slow(Swing):
    """A swing at a fifth of its speed."""

    def at(self, t):
        R, omega, alpha, position, velocity, acceleration = super().at(t / 5)
        return R, omega / 5, alpha / 25, position, velocity / 5, acceleration / 25


@pytest.mark.parametrize("seed", range(4))
def test_errors_that_vary_with_the_pose_are_no_clock(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    # Some pass all other bounds; here all do.
    monkeypatch.setattr(clock_rates, "SURE", 0.0)
    monkeypatch.setattr(clock_rates, "LEFT", np.inf)
    monkeypatch.setattr(clock_rates, "LEAST_S", 0.0)
    sound = recording(Slow(seed, 60.0), position=True, imu=False)
    wrench, poses = sound.streams
    rng = np.random.default_rng(seed)
    turns = poses.channels["rotation"].reshape(-1, 9)
    smooth = np.concatenate([turns**2, np.sin(3 * turns)], 1) @ rng.normal(size=(18, 6)) * ([0.4] * 3 + [0.04] * 3)
    off = np.stack([np.interp(wrench.time, poses.time, column) for column in smooth.T], 1)
    channels = {"force": wrench.channels["force"] + off[:, :3], "torque": wrench.channels["torque"] + off[:, 3:]}
    aligned = align(replace(sound, streams=(replace(wrench, channels=channels), poses)))
    assert not unsteady(aligned)
