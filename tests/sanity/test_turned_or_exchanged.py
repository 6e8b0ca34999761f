"""A sensor turned by a right angle is not taken for forces and torques in each other's columns, nor those for it."""

from __future__ import annotations

import numpy as np
import pytest

from steelyard.io.arrays import recording
from steelyard.logs.recording import Recording
from steelyard.sanity.before import examine
from steelyard.simulate import scenarios
from steelyard.simulate.logs import exact_log
from steelyard.simulate.motions import Fourier
from steelyard.spatial import Rotation

RIGHT = np.pi / 2


def swing(seed: int, turn: tuple[float, float, float], columns: tuple[int, ...] = (0, 1, 2, 3, 4, 5)) -> Recording:
    """Return 20 s without a stop, of a sensor that is turned against the frame of the rotations."""
    rng = np.random.default_rng(seed)
    along, about = rng.uniform(-1, 1, (2, 3, 4)), rng.uniform(-1, 1, (2, 3, 4))
    time = np.arange(0, 20, 0.008)
    at = Fourier(0.12, 0.9, along[0], along[1], 0.12, about[0], about[1]).at(time)
    felt = exact_log(at, scenarios.body("hammer").parameters(), np.array([0, 0, -9.81]), (0.05, 0.1)).wrench
    felt = Rotation.exp(np.array(turn)).inverse().matrix @ felt.reshape(-1, 2, 3, 1)
    felt = felt.reshape(-1, 6) + rng.normal(size=(len(time), 6)) * np.repeat([0.003, 0.06], 3)
    felt = felt[:, columns]
    return recording(
        time=time,
        torque=felt[:, :3],
        force=felt[:, 3:],
        rotation=at.rotation.matrix,
        position=at.position,
        gravity=[0, 0, -9.81],
        wrench="on-object",
    )


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("turn", [(0.0, 0.0, RIGHT), (0.0, 0.0, -RIGHT)])
def test_a_turned_sensor(seed: int, turn: tuple[float, float, float]) -> None:
    assert [finding.code for finding in examine(swing(seed, turn))[1]] == ["sensor-turned"]


@pytest.mark.parametrize("seed", range(4))
def test_exchanged_columns(seed: int) -> None:
    found = examine(swing(seed, (0.0, 0.0, 0.0), (3, 4, 5, 0, 1, 2)))[1]
    assert [finding.code for finding in found] == ["force-unit"]
    assert "in each other's columns" in found[0].message
