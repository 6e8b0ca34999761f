"""A log that is at rest throughout: readings of acceleration are noise, and no part's mass hangs on them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from steelyard.identify.masses.shape_error import EXACT
from steelyard.identify.part_masses import PartMasses
from steelyard.identify.rest import without_noise_of_rest
from steelyard.inertia import solids
from steelyard.logs.log import MotionLog
from steelyard.parts.parts import Parts
from steelyard.simulate.handling import handling_log
from steelyard.spatial import Pose, Rotation

# A block of 23 kg, 0.24 m long, held 0.1 m below the sensor.
X_SO = Pose(Rotation.exp(np.array([0.3, -0.5, 0.4])), np.array([0, 0, 0.1]))
BLOCK = solids.box(0.24, 0.2, 0.16, 3000.0).in_frame(X_SO)
PARTS = Parts(np.zeros(1, np.int64), BLOCK.vector[None] / 3000.0)


def log_of(seed: int) -> MotionLog:
    return handling_log(BLOCK, "static", "low", seed)


@pytest.mark.parametrize("seed", range(3))
def test_the_mass_of_a_heavy_part_keeps_within_its_bars(seed: int) -> None:
    found = PartMasses(PARTS, shape_error=EXACT).identify(log_of(seed))
    assert abs(found.mass - BLOCK.mass) < 3 * found.std[0]


def test_noise_at_rest_is_taken_for_nothing() -> None:
    quiet = without_noise_of_rest(log_of(0))
    assert not quiet.acceleration.any()
    assert not quiet.angular_acceleration.any()


def test_readings_above_their_noise_stay() -> None:
    log = log_of(0)
    moving = replace(log, acceleration=3 * log.acceleration)
    assert without_noise_of_rest(moving) is moving


def test_a_log_with_rows_in_motion_stays() -> None:
    log = handling_log(BLOCK, "slow", "low", 0)
    assert without_noise_of_rest(log) is log
