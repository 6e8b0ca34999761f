"""Torque columns that hold zeros, as of a driver that does not fill them, break nothing."""

from __future__ import annotations

import numpy as np

from steelyard.errors import CannotAnswer
from steelyard.logs.recording import Recording, Stream
from steelyard.pipelines.held_object import identify
from steelyard.spatial import Rotation


def test_zero_torque_breaks_nothing() -> None:
    rng = np.random.default_rng(0)
    time = np.arange(0, 12, 0.01)
    turn = Rotation.exp(np.stack([np.sin(0.9 * time), np.sin(0.7 * time + 1), np.cos(0.5 * time)], 1)).matrix
    force = -1.2 * np.einsum("nji,j->ni", turn, [0.0, 0.0, -9.81]) + 0.05 * rng.normal(size=(len(time), 3))
    position = 0.1 * np.stack([np.sin(time), np.cos(time), np.sin(0.3 * time)], 1)
    channels = {"force": force, "torque": np.zeros_like(force), "rotation": turn, "position": position}
    recording = Recording((Stream("log.csv", channels, time),), np.array([0, 0, -9.81]))
    try:
        estimate = identify(recording)
    except CannotAnswer:
        return
    assert np.isfinite(estimate.std).all()
