"""Answers of impossible size are named: units that no residual shows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.identify.noise_aware import NoiseAware
from steelyard.sanity.fitted.no_body import implausible
from steelyard.simulate.logs import simulate_log


def found(force: float = 1.0, torque: float = 1.0) -> set[str]:
    log, _ = simulate_log("drill", "stop_go", "low", 0, shuffled=False)
    wrench = log.wrench * np.repeat([torque, force], 3)
    return {f.code for f in implausible(NoiseAware().identify(replace(log, wrench=wrench, noise=None)), 9.81)}


def test_a_plain_body_is_plausible() -> None:
    assert found() == set()


def test_kilonewtons_for_newtons() -> None:
    assert found(force=1000.0, torque=1000.0) == {"force-unit"}


def test_newton_metres_read_as_newton_millimetres() -> None:
    assert found(torque=1e-3) == {"length-in-mm"}
