"""Forces that follow the acceleration of one mass and the weight of another, as one fit of both masses tells.

UR, Franka and others subtract the weight of the payload that was set in the controller before they report the force.
What it takes to accelerate the load is left in, or more of it. A clock that runs too fast, or positions in a smaller
unit than was said, make accelerations too large, and the mass that they show too small.
"""

from __future__ import annotations

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding, about
from steelyard.sanity.readings.glance import Glance
from steelyard.sanity.readings.static_fit import beside, solve, varies

# The weight is that of less than this share of the mass that is accelerated, beyond so many standard deviations.
SHARE, SURE = 0.8, 5.0
# Nobody sets a payload of twice the mass: a weight of minus the mass that is accelerated is a gravity upside down.
TOO_MUCH = 0.7
# An accelerated mass above this [kg] is one of wrong units.
HEAVIEST = 100.0
# Accelerations are too large by more than this factor where both masses together explain all but so much.
TOO_LARGE, CLOSELY = 2.0, 0.05
# Nobody is wrong by a larger factor about a rate; masses that are this much unlike are worth a word about one.
WRONG_RATE, CLOCK = 12.0, 1.2
# Both masses together explain all but this share of the force variance.
EXPLAINED = 0.5
TAKEN_AWAY = "the controller, or the sensor's driver, takes the weight of a payload away. The answer is what it leaves."


def both_masses(view: Glance, gravity: Array, rotation: Array) -> tuple[Array, Array, float]:
    """Return the mass [kg] that the force shows by acceleration, then by weight (2,), jackknife std, the share left.

    gravity, rotation  (3,) [m/s^2] in W, and S to W (N, 3, 3), as the log is read
    """
    seen = view.still.seen(gravity, rotation)
    slowed = view.seen(np.zeros(3), rotation).pull
    columns = beside(np.stack([-slowed, -seen.pull], 2), seen.lever)
    masses, spread, left = solve(columns * seen.heard(1), seen.wrench[:, 3:], view.block)
    return masses[:2], spread[:2], left


def clock_words(moved: float, weighed: float) -> str:
    """Say which clock or unit of positions makes a weighed mass [kg] look as another by acceleration; "" if none."""
    ratio = max(moved, weighed) / max(min(moved, weighed), 1e-300)
    if not CLOCK < ratio < WRONG_RATE**2:
        return ""
    clock, size = ("fast", "large") if weighed > moved else ("slow", "small")
    rate = about(float(np.sqrt(ratio)))
    return f"A clock that runs {rate} times too {clock}, or positions {about(ratio)} times too {size}, do so"


def compensated(both: str, other: str) -> Finding:
    """Return `weight-compensated` of what is said of both masses, and of another cause that may be."""
    return Finding.of("weight-compensated", both + TAKEN_AWAY + (f" {other}, too." if other else ""))


def examine_both_masses(view: Glance, gravity: Array, rotation: Array | None) -> tuple[Finding, ...]:
    """Return `weight-compensated` or `motion-mismatch` where force shows another mass by acceleration than by weight.

    gravity (3,) [m/s^2] in W and rotation (N, 3, 3) as the log is read.
    """
    if view.acceleration is None or rotation is None or not varies(view, gravity, rotation):
        return ()
    masses, spread, left = both_masses(view, gravity, rotation)
    moved, weighed = float(masses[0]), float(np.sign(masses[0]) * masses[1])
    both = (
        f"The force follows the acceleration as that of {abs(moved):.4g} ± {spread[0]:.2g} kg, but the direction of "
        f"gravity as that of {weighed:.3g} ± {spread[1]:.2g} kg: "
    )
    large = abs(moved) > SURE * spread[0] and TOO_LARGE * (abs(moved) + SURE * spread[0]) < weighed - SURE * spread[1]
    if large and left < CLOSELY:
        text = f"{both}accelerations are too large. {clock_words(abs(moved), weighed)}."
        return (Finding.of("motion-mismatch", text),)
    small = weighed > SURE * spread[1] and abs(moved) - SURE * spread[0] > WRONG_RATE**2 * weighed
    if small and left < CLOSELY:
        text = f"{both}accelerations are too small, as with positions {about(abs(moved) / weighed)} times too small."
        return (Finding.of("motion-mismatch", text),)
    short = SHARE * abs(moved) - weighed
    sure = abs(moved) > SURE * spread[0] and short > SURE * float(np.hypot(SHARE * spread[0], spread[1]))
    if not sure or abs(moved) > HEAVIEST or left > EXPLAINED or weighed < -TOO_MUCH * abs(moved):
        return ()
    other = clock_words(abs(moved), weighed) if weighed > SURE * spread[1] and left < CLOSELY else ""
    return (compensated(both, other),)
