"""The direction of gravity is estimated where that is asked for and the log tells it; bars hold how well it does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import steelyard as sy
from steelyard.errors import BadValue, CannotAnswer
from steelyard.logs.log import MotionLog
from steelyard.logs.recording import Recording, Stream
from steelyard.simulate import hammer
from steelyard.spatial import Rotation

UNKNOWN = sy.Options(gravity="unknown")
DOWN = np.array([0.0, 0.0, -9.81])
ROWS = 14


def about_one_axis(seed: int, wobble_deg: float) -> Rotation:
    """Return turns (ROWS,) about one axis by up to two radians, each beside it by some degrees."""
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=3)
    turns = Rotation.exp(np.linspace(0, 2, ROWS)[:, None] * axis / np.linalg.norm(axis))
    return turns @ Rotation.exp(np.radians(wobble_deg) * rng.uniform(-1, 1, (ROWS, 3)))


def still(turns: Rotation, seed: int, told: str = "rotation") -> Recording:
    """Return a table of still poses of the hammer on a base that is tilted by some degrees."""
    rng = np.random.default_rng(seed + 100)
    pull = turns.inverse().apply(DOWN)
    felt = MotionLog.of_poses(np.zeros((ROWS, 6)), pull).predicted(hammer.body().vector)
    raw = -felt - rng.normal(size=felt.shape) * np.repeat([1e-3, 1e-2], 3)
    channels = {"force": raw[:, 3:], "torque": raw[:, :3], told: turns.matrix if told == "rotation" else pull}
    tilted = Rotation.exp(np.radians(4) * rng.normal(size=3)).apply(DOWN)
    return replace(hammer.recording(0).recording, streams=(Stream("poses", channels, poses=True),), gravity=tilted)


@pytest.mark.parametrize("seed", range(3))
def test_turns_about_one_axis_do_not_tell_it(seed: int) -> None:
    """Any mass fits then, with gravity nearer the axis or farther from it: 0.35 kg came out for 0.62, as 0.1 % sure."""
    with pytest.raises(CannotAnswer, match="does not show the direction of gravity: turn the sensor about two"):
        sy.identify(still(about_one_axis(seed, 0.0), seed), UNKNOWN)


def test_bars_hold_a_direction_that_is_told_badly() -> None:
    found = [sy.identify(still(about_one_axis(seed, 4.0), seed), UNKNOWN) for seed in range(12)]
    off = np.array([(one.mass - hammer.body().mass) / one.std[0] for one in found])
    assert np.sqrt((off**2).mean()) < 1.6
    assert np.sqrt((off**2).mean()) > 0.5


def test_it_needs_rotations() -> None:
    with pytest.raises(BadValue, match='gravity "unknown" needs the rotation of the sensor'):
        sy.identify(still(about_one_axis(0, 30.0), 0, told="gravity"), UNKNOWN)
