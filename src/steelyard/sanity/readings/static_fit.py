"""Static fit: mass and first moment of mass that explain a wrench by gravity, and how much they leave unexplained.

Beside the mass that is weighed stands the mass that is accelerated. UR, Franka and others subtract the weight of the
payload that was set in the controller before they report the force. What it takes to accelerate the load is left in, or
more of it. Stamps too close together, or positions in a smaller unit than was said, make accelerations too large, and
the mass that they show too small.

Throughout, `gravity` (3,) [m/s^2] is in W, and `rotation` (N, 3, 3) turns S into W, as the log is read.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from steelyard.check import Array, Integers
from steelyard.findings import Finding, about
from steelyard.identify.cost.left_out import block_scatter, jackknife, solutions
from steelyard.sanity.lasting import clear
from steelyard.sanity.readings.glance import CUTOFF_HZ, Glance, Seen
from steelyard.spatial import cross_matrix

# A fit that leaves less than this share of the variance is as good as perfect: no rival can be better.
LEAST_SHARE = 1e-4
# Directions below the first share of the largest, and columns below the second of all squares, say nothing.
RANK, SILENT = 1e-6, 1e-12
# Gravity that moves about in S by less than this share of its size tells no weight from a bias.
TURNING = 0.05

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
# Of a force in the axes of the base that keeps less than this share of the weight all may have been zeroed away.
WEIGHTLESS = 0.05
# Both masses together explain all but this share of the force variance, and of what one leaves of means over a second
# so many times what they leave (`lasting`): a controller did 5 and more, hysteresis 0.6 at most.
EXPLAINED, CLEAR = 0.5, 1.0
TAKEN_AWAY = "the controller, or the sensor's driver, takes the weight of a payload away. The answer is what it leaves."


@dataclass(frozen=True, eq=False)
class StaticFit:
    """What one set of conventions makes of a log.

    mass, mass_std        [kg]; the standard deviation by leaving out one stretch or pose after the other
    moment, moment_std    (3,) first moment of mass [kg m]
    force_share, torque_share   variance left over the variance that a bias alone leaves
    """

    mass: float
    mass_std: float
    moment: Array
    moment_std: Array
    force_share: float
    torque_share: float

    @property
    def cost(self) -> float:
        """Logarithm of the product of both shares: differences are those of a profile likelihood per row and axis."""
        return float(np.log(max(self.force_share, LEAST_SHARE)) + np.log(max(self.torque_share, LEAST_SHARE)))

    @property
    def arm(self) -> float:
        """Distance of the centre of mass from the sensor [m]; infinite without mass."""
        size = float(np.linalg.norm(self.moment))
        return size / abs(self.mass) if self.mass else float("inf")

    @property
    def sign(self) -> int:
        """Sign of the mass where it is beyond five standard deviations and explains something, else 0."""
        sure = abs(self.mass) > 5 * self.mass_std and self.force_share < 0.7
        return int(np.sign(self.mass)) if sure else 0


def fit(seen: Seen, block: Integers) -> StaticFit:
    """Fit f = -m pull + lever h' + bias and tau = pull x h + spin I + bias to a glance."""
    turned, forced = columns(seen)
    mass, mass_std, force_share = solve(forced * seen.heard(1), seen.wrench[:, 3:], block)
    moment, moment_std, torque_share = solve(turned * seen.heard(0), seen.wrench[:, :3], block)
    return StaticFit(float(mass[0]), float(mass_std[0]), moment[:3], moment_std[:3], force_share, torque_share)


def better_fit(view: Glance, gravity: Array, rotation: Array | None) -> StaticFit:
    """Return the better of two fits: with the measured acceleration and without."""
    views = (view,) if view.acceleration is None else (view, view.still)
    return min((fit(v.seen(gravity, rotation), v.block) for v in views), key=lambda found: found.force_share)


def varies(view: Glance, gravity: Array, rotation: Array | None) -> bool:
    """Tell whether gravity, so read, moves about in S by more than a twentieth of its size."""
    pull = view.still.seen(gravity, rotation).pull
    return float(np.sqrt(pull.var(0).sum())) > TURNING * float(np.linalg.norm(gravity))


def columns(seen: Seen) -> tuple[Array, Array]:
    """Return what the torque (N, 3, 3 or 9) and the force (N, 3, 1 or 4) of a body are linear in."""
    return beside(cross_matrix(seen.pull), seen.spin), beside(-seen.pull[:, :, None], seen.lever)


def beside(columns: Array, more: Array | None) -> Array:
    """Return columns (N, 3, k) with more of them behind, if there are any."""
    return columns if more is None else np.concatenate([columns, more], 2)


def solve(columns: Array, values: Array, block: Integers) -> tuple[Array, Array, float]:
    """Return least squares with a free bias: solution (k,), jackknife std (k,), share of variance left.

    columns (N, 3, k), values (N, 3), block (N,)
    """
    count, size = len(values), columns.shape[2]
    total, solution, left_out = leave_out(columns, values, block)
    spread = np.sqrt(np.diag(jackknife(left_out - solution)))
    variance = float(total[size, size])
    left = variance - float(solution @ total[:size, size])
    freedom = max(3 * count - 3 - size, 1) / max(3 * count - 3, 1)
    share = max(left, 0.0) / variance / freedom if variance > 0 else 1.0
    return solution, spread, min(share, 1.0)


def leave_out(columns: Array, values: Array, block: Integers) -> tuple[Array, Array, Array]:
    """Return the centred scatter (k+1, k+1), its solution (k,) and the solutions (B, k) without one block each."""
    both = np.concatenate([columns, values[:, :, None]], 2)
    scatter = block_scatter(both - both.mean(0), block)
    total = scatter.sum(0)
    found = solutions(np.concatenate([total[None], total - scatter]), RANK, SILENT)
    return total, found[0], found[1:]


def masses_at_a_glance(view: Glance, gravity: Array, rotation: Array) -> tuple[Array, Array, float]:
    """Return the mass [kg] that the force shows by acceleration, then by weight (2,), jackknife std, the share left."""
    columns, force = _two_masses(view, gravity, rotation)
    masses, spread, left = solve(columns, force, view.block)
    return masses[:2], spread[:2], left


def _two_masses(view: Glance, gravity: Array, rotation: Array) -> tuple[Array, Array]:
    """Return what the force is linear in (N, 3, 2 or 5), a mass by acceleration and one by weight, and it (N, 3)."""
    seen = view.still.seen(gravity, rotation)
    slowed = view.seen(np.zeros(3), rotation).pull
    columns = beside(np.stack([-slowed, -seen.pull], 2), seen.lever)
    return columns * seen.heard(1), seen.wrench[:, 3:]


def apart_clearly(view: Glance, gravity: Array, rotation: Array) -> bool:
    """Tell whether two masses explain so much of what one leaves of the force that nothing else will have made it."""
    two, force = _two_masses(view, gravity, rotation)
    one = np.concatenate([two[:, :, :1] + two[:, :, 1:2], two[:, :, 2:]], 2)
    left = []
    for columns in (one, two):
        _, solution, _ = leave_out(columns, force, view.block)
        miss = force - columns @ solution
        left.append(miss - miss.mean(0))
    rate = 1.0 if view.rate is None else view.rate
    free = 1.0 if view.rate is None else 2 * CUTOFF_HZ / rate
    return clear(left[0], left[1], (np.arange(len(force)) / rate).astype(np.int64), free) > CLEAR


def stamp_words(moved: float, weighed: float) -> str:
    """Say which stamps or unit of positions make a weighed mass [kg] look as another by acceleration; "" if none."""
    ratio = max(moved, weighed) / max(min(moved, weighed), 1e-300)
    if not CLOCK < ratio < WRONG_RATE**2:
        return ""
    lie, size = ("close together", "large") if weighed > moved else ("far apart", "small")
    rate = about(float(np.sqrt(ratio)))
    return f"Stamps {rate} times too {lie}, or positions {about(ratio)} times too {size}, do so"


def compensated(both: str, other: str) -> Finding:
    """Return `weight-compensated` of what is said of both masses, and of another cause that may be."""
    return Finding.of("weight-compensated", both + TAKEN_AWAY + (f" {other}, too." if other else ""))


def examine_both_masses(view: Glance, gravity: Array, rotation: Array | None) -> tuple[Finding, ...]:
    """Return `weight-compensated` or `motion-mismatch` where force shows another mass by acceleration than weight."""
    if view.acceleration is None or rotation is None or not varies(view, gravity, rotation):
        return ()
    masses, spread, left = masses_at_a_glance(view, gravity, rotation)
    moved, weighed = float(masses[0]), float(np.sign(masses[0]) * masses[1])
    both = (
        f"The force follows the acceleration as that of {abs(moved):.4g} ± {spread[0]:.2g} kg, but the direction of "
        f"gravity as that of {weighed:.3g} ± {spread[1]:.2g} kg: "
    )
    large = abs(moved) > SURE * spread[0] and TOO_LARGE * (abs(moved) + SURE * spread[0]) < weighed - SURE * spread[1]
    if large and left < CLOSELY:
        text = f"{both}accelerations are too large. {stamp_words(abs(moved), weighed)}."
        return (Finding.of("motion-mismatch", text),)
    small = weighed > SURE * spread[1] and abs(moved) - SURE * spread[0] > WRONG_RATE**2 * weighed
    if small and left < CLOSELY:
        text = f"{both}accelerations are too small, as with positions {about(abs(moved) / weighed)} times too small."
        return (Finding.of("motion-mismatch", text),)
    short = SHARE * abs(moved) - weighed
    sure = abs(moved) > SURE * spread[0] and short > SURE * float(np.hypot(SHARE * spread[0], spread[1]))
    if not sure or abs(moved) > HEAVIEST or left > EXPLAINED or weighed < -TOO_MUCH * abs(moved):
        return ()
    if not apart_clearly(view, gravity, rotation):
        return ()
    other = stamp_words(abs(moved), weighed) if weighed > SURE * spread[1] and left < CLOSELY else ""
    if "force" in view.world and abs(weighed) < WEIGHTLESS * abs(moved):
        other = "A wrench that was zeroed in the axes of the base with the load in hand does so"
    return (compensated(both, other),)
