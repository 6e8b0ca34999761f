"""A wrench channel that does not measure is named and says nothing: the answer is that of the other five."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from synthetic import Kind, write

from steelyard.identify.estimate import Estimate
from steelyard.io import read_recording
from steelyard.logs.recording import Mount, Recording, Stream
from steelyard.pipelines.held_object import identify
from steelyard.sanity.rows.judged import dead_channels
from steelyard.spatial import Rotation


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return read_recording(write(tmp_path_factory.mktemp("log"), Kind()))


@pytest.fixture(scope="module")
def whole(recording: Recording) -> Estimate:
    return identify(recording)


def with_dead(recording: Recording, quantity: str, axis: int) -> Recording:
    def dead(stream: Stream) -> Stream:
        values = stream.channels[quantity].copy()
        values[:, axis] = values[0, axis]
        return replace(stream, channels={**stream.channels, quantity: values})

    return replace(recording, streams=tuple(dead(s) if "force" in s.channels else s for s in recording.streams))


def with_noise_only(recording: Recording, quantity: str, axis: int) -> Recording:
    def deaf(stream: Stream) -> Stream:
        values = stream.channels[quantity].copy()
        level = {"force": 0.02, "torque": 0.001}[quantity]
        values[:, axis] = 0.3 + level * np.random.default_rng(3).normal(size=len(values))
        return replace(stream, channels={**stream.channels, quantity: values})

    return replace(recording, streams=tuple(deaf(s) if "force" in s.channels else s for s in recording.streams))


@pytest.mark.parametrize(
    ("spoil", "quantity", "axis"),
    [(with_dead, "force", 0), (with_dead, "torque", 1), (with_noise_only, "force", 2), (with_noise_only, "torque", 1)],
)
def test_the_others_answer(
    spoil: Callable[[Recording, str, int], Recording],
    quantity: str,
    axis: int,
    recording: Recording,
    whole: Estimate,
) -> None:
    five = identify(spoil(recording, quantity, axis))
    known = {f.code for f in whole.findings}
    assert [f.code for f in five.findings if f.code not in known] == ["channel-stuck"]
    assert five.delays_s == pytest.approx(whole.delays_s, abs=1e-3)
    assert five.evidence.residual_force_N < 1.5 * whole.evidence.residual_force_N
    std = np.hypot(whole.std[:4], five.std[:4])
    gap = np.append(five.mass - whole.mass, five.com - whole.com)
    assert (np.abs(gap) < 4 * std).all()
    assert five.std[0] < 0.02 * whole.mass


def test_only_channels_of_the_sensor_itself_are_dead(recording: Recording) -> None:
    assert not any(dead_channels(recording))
    dead = with_dead(recording, "force", 1)
    assert dead_channels(dead) == (False, False, False, False, True, False)
    turned = tuple(replace(s, mount=Mount(Rotation.exp([0.1, 0.2, 0.3]))) for s in dead.streams)
    assert not any(dead_channels(replace(dead, streams=turned)))
    moved = tuple(replace(s, mount=Mount(None, np.array([0.0, 0.0, 0.05]))) for s in dead.streams)
    assert dead_channels(replace(dead, streams=moved)) == (True, False, False, False, True, False)
