"""A tilt along the only axis about which the sensor turns does not show: the bar of the mass holds it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import steelyard as sy
from steelyard.sanity.readings.tilt import GlanceTilt
from steelyard.spatial import Rotation

G, MASS = 9.81, 1.5


def test_a_tilt_toward_an_upright_axis_changes_most_of_what_is_seen() -> None:
    axis = np.array([np.sin(0.5), 0, np.cos(0.5)])
    seen = GlanceTilt(np.array([0, 0, -G]), 0.05, 0.001, 0.0, 0.0)
    assert seen.length_std == 0
    assert replace(seen, blind=axis).length_std == pytest.approx(0.05 / np.tan(0.5))
    assert replace(seen, blind=np.array([1.0, 0, 0])).length_std == 0


@pytest.mark.parametrize("along", [-0.05, 0.05])
def test_the_bar_of_the_mass_holds_a_tilt_that_one_axis_does_not_show(along: float) -> None:
    """The mass was 6 % and 100 bars off."""
    rng = np.random.default_rng(3)
    time = np.arange(4000) / 100
    upright = np.array([np.sin(0.6), 0, np.cos(0.6)])
    angle = 1.2 * np.sin(0.5 * time) + 0.8 * np.sin(0.33 * time)
    rotation = Rotation.exp(angle[:, None] * upright)
    tilt = Rotation.exp([0.05, 0, 0]) @ Rotation.exp([0, along, 0])
    force = -MASS * rotation.inverse().apply(tilt.apply(np.array([0, 0, -G])))
    torque = np.cross([0.01, 0.02, 0.06], force)
    recording = sy.recording(
        time=time,
        force=force + 0.05 * rng.normal(size=force.shape),
        torque=torque + 0.002 * rng.normal(size=force.shape),
        rotation=rotation,
        position=np.zeros((len(time), 3)),
        gravity=[0, 0, -G],
    )
    estimate = sy.identify(recording)
    assert "base-tilted" in estimate.codes()
    assert 0.02 * MASS < abs(estimate.mass - MASS) < 2 * estimate.std[0]
