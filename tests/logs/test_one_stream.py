"""One table that holds the wrench and what a simulator or a controller logs beside it."""

from __future__ import annotations

import numpy as np
from made_recordings import BODY, GRAVITY, Swing, fitted

from steelyard.logs.alignment import Aligned, align
from steelyard.logs.recording import Recording, Stream

SWING = Swing(seed=3)
TIME = np.arange(0.0, SWING.duration, 0.01)
ROTATION, OMEGA, ALPHA, POSITION, VELOCITY, ACCELERATION = SWING.at(TIME)
LOG = SWING.log(TIME)
WORLD = {"linear_acceleration": "W", "linear_velocity": "W"}


def aligned(**channels: np.ndarray) -> Aligned:
    rng = np.random.default_rng(0)
    felt = LOG.wrench + rng.normal(size=(len(TIME), 6)) * np.repeat([0.005, 0.05], 3)
    wrench = {"torque": felt[:, :3], "force": felt[:, 3:]}
    stream = Stream("log", {**wrench, **channels}, time=TIME, frames={q: f for q, f in WORLD.items() if q in channels})
    return align(Recording((stream,), GRAVITY))


def off(log: Aligned) -> float:
    return float(np.linalg.norm(fitted(log.log)[:10] - BODY.vector) / np.linalg.norm(BODY.vector))


def test_positions_may_stand_beside_given_accelerations() -> None:
    found = aligned(rotation=ROTATION, position=POSITION, linear_acceleration=ACCELERATION, angular_acceleration=ALPHA)
    assert found.acceleration_from == "linear_acceleration"
    assert off(found) < 0.01


def test_positions_and_velocities_may_stand_beside_given_accelerations() -> None:
    found = aligned(
        rotation=ROTATION, position=POSITION, linear_velocity=VELOCITY, angular_velocity=OMEGA,
        linear_acceleration=ACCELERATION, angular_acceleration=ALPHA,
    )  # fmt: skip
    assert off(found) < 0.01


def test_an_accelerometer_alone_is_enough() -> None:
    felt = LOG.acceleration - LOG.gravity
    found = aligned(specific_force=felt)
    assert found.acceleration_from == "specific_force"
    assert abs(fitted(found.log)[0] / BODY.vector[0] - 1) < 0.05
