"""Stop-and-go whose acceleration nobody measures: rows at rest that were moving are left out, drift or not."""

from __future__ import annotations

import numpy as np
import pytest

from steelyard.identify.fit import Bias
from steelyard.identify.noise_aware import NoiseAware
from steelyard.logs.log import MotionLog, Noise

MASS, COM = 1.2, np.array([0.01, -0.02, 0.09])
DRIFT = np.array([0.05, 0.0, -0.02, 1.0, -0.5, 0.3])


def stops(drift: float) -> MotionLog:
    """Return twelve stops of 60 rows at 100 Hz, the first rows of each still moving, without any acceleration."""
    rng = np.random.default_rng(3)
    down = rng.normal(size=(12, 3))
    gravity = np.repeat(9.81 * down / np.linalg.norm(down, axis=1, keepdims=True), 60, axis=0)
    force = -MASS * gravity
    late = np.arange(len(gravity)) % 60 < 2
    force[late] += 3.0
    time = np.arange(len(gravity)) / 100
    wrench = np.concatenate([np.cross(COM, force), force], 1) + drift * np.outer(time / time[-1], DRIFT)
    wrench += rng.normal(size=wrench.shape) * np.repeat([0.005, 0.08], 3)
    zero = np.zeros_like(gravity)
    still = np.ones(len(time), np.bool_)
    noise = (Noise(np.full(6, 1e-6), np.zeros(6)),)
    return MotionLog(wrench, gravity, zero, zero, zero, time, still, np.arange(len(time)) // 60, noise=noise)


@pytest.mark.parametrize("drift", [0.0, 1.0])
def test_rows_that_moved_are_left_out(drift: float) -> None:
    estimate = NoiseAware(bias=Bias("free", drift=drift > 0)).identify(stops(drift))
    assert estimate.evidence.samples < 12 * 60
    assert abs(estimate.mass - MASS) < 4 * estimate.std[0]
    assert (np.abs(estimate.com - COM) < 4 * estimate.std[1:4]).all()
