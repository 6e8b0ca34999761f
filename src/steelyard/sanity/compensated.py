"""A controller that takes a payload away: forces then follow the acceleration of one mass and the weight of a smaller.

UR, Franka and others subtract the weight of the payload that was set in the controller before they report the force.
What it takes to accelerate the load is left in, or more of it, so that one fit of both masses tells.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding
from steelyard.sanity.glance import Glance
from steelyard.sanity.static_fit import beside, solve

# The weight is that of less than this share of the mass that is accelerated, beyond so many standard deviations.
SHARE, SURE = 0.8, 5.0
# Nobody sets a payload of twice the mass: a weight of minus the mass that is accelerated is a gravity upside down.
TOO_MUCH = 0.7
# An accelerated mass above this [kg] is one of wrong units.
HEAVIEST = 100.0
# Both masses together explain all but this share of the force variance.
EXPLAINED = 0.5


def both_masses(view: Glance, gravity: Array, rotation: Array) -> tuple[Array, Array, float]:
    """Return the mass that the force shows by acceleration, then by weight, their jackknife std, and the share left."""
    seen = replace(view, acceleration=None).seen(gravity, rotation)
    slowed = view.seen(np.zeros(3), rotation).pull
    columns = beside(np.stack([-slowed, -seen.pull], 2), seen.lever)
    masses, spread, left = solve(columns * seen.heard(1), seen.wrench[:, 3:], view.block)
    return masses[:2], spread[:2], left


def compensated(view: Glance, gravity: Array, rotation: Array | None) -> tuple[Finding, ...]:
    """Return `weight-compensated` where the force shows more mass by acceleration than by weight.

    gravity (3,) [m/s^2] in W and rotation (N, 3, 3) as the log is read.
    """
    if view.acceleration is None or rotation is None:
        return ()
    masses, spread, left = both_masses(view, gravity, rotation)
    moved, weighed = float(masses[0]), float(np.sign(masses[0]) * masses[1])
    short = SHARE * abs(moved) - weighed
    sure = abs(moved) > SURE * spread[0] and short > SURE * float(np.hypot(SHARE * spread[0], spread[1]))
    if not sure or abs(moved) > HEAVIEST or left > EXPLAINED or weighed < -TOO_MUCH * abs(moved):
        return ()
    message = (
        f"The force follows the acceleration as that of {abs(moved):.3g} ± {spread[0]:.2g} kg, but the direction of "
        f"gravity as that of {weighed:.3g} ± {spread[1]:.2g} kg: the controller, or the sensor's driver, takes the "
        "weight of a payload away. The answer is what it leaves."
    )
    return (Finding.of("weight-compensated", message),)
