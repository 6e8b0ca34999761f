"""Positions of another point than the origin of S, such as the tip of a tool: no body feels what they say.

A point r from S is accelerated by alpha x r + omega x (omega x r) more than S. By its turning, the force then shows the
first moment h - m r of mass, and the torque at rest the first moment h: their difference is the point.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding
from steelyard.identify.estimate import Estimate
from steelyard.logs.log import MotionLog
from steelyard.sanity.aside import stands_aside
from steelyard.sanity.fitted.full_fit import CALM, NOISE, Rows, moves, noise_share
from steelyard.sanity.fitted.load_motion import two_masses
from steelyard.sanity.fitted.sensor_matrix import sensor_matrix
from steelyard.sanity.readings.levers import UNITS, compared
from steelyard.sanity.readings.torques import opposed
from steelyard.sanity.words import axis_words
from steelyard.spatial import cross_matrix, lever_matrix

# A point this far [m] from S is worth a word, if it is so many standard deviations from none, by leaving out stretches,
# and leaves less of the squared residual. No tool's tip is farther than the last.
APART, SURE, LEFT, FARTHEST = 0.01, 8.0, 0.95, 2.0
# In slow motion noise hides what a point does: then what it leaves of means over a second tells. Sound logs keep 0.96.
SLOWLY = 0.93
# Beyond doubt it is where it explains so many times what it leaves (`Rows.clear`): errors of a sensor that come back
# with the motion fall on any column.
CLEAR = 0.5
# From so many standard deviations on a point is held by the bars.
MAYBE = 2.5
# Forces k times too large look like a point at 1 - k times the centre of mass. So near, the unit is likelier.
NEAR = 0.03
# The unit, or sign, is told where the ratio that it puts the point at is known to this share.
TOLD = 0.1
# The point is sought anew with the body found until it moves by less [m].
ROUNDS, SETTLED = 5, 1e-5
# Along an axis of S about which alone it turns, no point is told from another: the motion shows this much less of it.
BLIND = 0.01


@dataclass(frozen=True, eq=False)
class Misplaced:
    """The point whose acceleration is given.

    place, std  (3,) [m] from the origin of S, in S, with standard deviations by leaving out stretches of the log
    left        squared residual beside that with the origin of S
    slowly      the same, of means over a second
    clear       how many times as much of these it explains as it leaves, see `Rows.clear`
    moved       (10,) what the parameters are less with it
    com         (3,) [m] centre of mass with it
    trace       [kg m^2] sum of the moments of inertia about it that a free fit has
    noise       share of noise in the squared acceleration of the rows
    blind       (3,) an axis of S along which the motion does not show the point, which is then taken to lie at zero;
                None where there is none
    measured    whether it is an accelerometer whose accelerations are of it, and not positions
    """

    place: Array
    std: Array
    left: float
    slowly: float
    clear: float
    moved: Array
    com: Array
    trace: float
    noise: float
    blind: Array | None = None
    measured: bool = False

    @property
    def sure(self) -> bool:
        """Whether it is another point than the origin of S beyond doubt, and one that poses may be of."""
        return self.seen and not self.of_a_unit

    @property
    def seen(self) -> bool:
        """Whether it is another point than the origin of S beyond doubt."""
        far = float(np.linalg.norm(self.place))
        least = APART + NOISE * self.noise * float(np.linalg.norm(self.com))
        return self._stands_out(SURE) and self.clear > CLEAR and least < far < FARTHEST

    @property
    def maybe(self) -> bool:
        """Whether it may well be another point than the origin of S."""
        return self._stands_out(MAYBE) and float(np.linalg.norm(self.place)) < FARTHEST

    def _stands_out(self, times: float) -> bool:
        """Whether it is so many standard deviations from the origin of S, and explains what that leaves."""
        far = bool((np.abs(self.place) > times * self.std).any())
        return far and self.noise < CALM and (self.left < LEFT or self.slowly < SLOWLY)

    @property
    def of_a_unit(self) -> bool:
        """Whether it lies where the wrong unit of force or torque, or the other sign of torques, puts it."""
        ways = np.array([1 - unit.ratio for unit in UNITS])
        gaps = np.linalg.norm(self.place - ways[:, None] * self.com, axis=1)
        return self._of_a_sign or bool((gaps < NEAR * np.linalg.norm(self.place)).any())

    @property
    def _of_a_sign(self) -> bool:
        """Whether it lies at twice the centre of mass, as the tip of a rod held at its end, with an inertia below zero.

        The sign of torques is that of the inertia: no body has one below zero, however little is known of it.
        """
        gap = float(np.linalg.norm(self.place - 2 * self.com))
        near = NEAR * float(np.linalg.norm(self.place)) + 2 * float(np.linalg.norm(self.std))
        return self.trace < 0 and gap < near

    @property
    def larger(self) -> tuple[float, float]:
        """How many times larger the first moment by the force is than by the torque, with its standard deviation."""
        square = float(self.com @ self.com)
        return 1 - float(self.place @ self.com) / square, float(np.linalg.norm(self.com * self.std)) / square

    @property
    def finding(self) -> Finding:
        """What is said of it."""
        what, such, remedy = self._what
        blind = ""
        if self.blind is not None:
            blind = f"; where it is along ({axis_words(self.blind)}) of S, turns about that axis alone do not show"
        text = f"The load moves as if {what} a point {self._size}{such}{blind}. The answer assumes this."
        return Finding("motion-mismatch", text, remedy)

    @property
    def _size(self) -> str:
        """Say where it is."""
        where = ", ".join(f"{1e3 * v:.1f}" for v in self.place + 0.0)
        return f"({where}) ± {1e3 * float(np.linalg.norm(self.std)):.1g} mm from the origin of S"

    @property
    def _what(self) -> tuple[str, str, str]:
        """Say what is of it, what it may be, and what to do."""
        if self.measured:
            return "the accelerations were those of", "", "Correct the accelerometer's mount by as much."
        mount = ", ".join(f"{v:.1f}" for v in np.round(-1e3 * self.place, 1) + 0.0)
        remedy = (
            "Set the controller's TCP to S, or correct the positions; or call their point S, and give the wrench "
            f'mount = {{ position = [{mount}], unit = "mm" }} in it.'
        )
        return "the positions were those of", ", such as the tip of a tool", remedy

    def allowed(self, estimate: Estimate) -> Estimate:
        """Return the estimate of the origin of S with bars that hold all that the point would change."""
        return estimate.allowing(self.moved).noted(
            f"the load moves as if {self._what[0]} a point {self._size}; error bars hold what that changes"
        )

    def widened(self, estimate: Estimate) -> Estimate:
        """Return the estimate with bars that hold how well the point is known."""
        share = float(np.linalg.norm(self.std) / np.linalg.norm(self.place))
        return estimate.allowing(share * self.moved)

    def put_right(self, log: MotionLog) -> MotionLog:
        """Return the log with accelerations of S."""
        return of_sensor(log, self.place)


def of_sensor(log: MotionLog, place: Array) -> MotionLog:
    """Return the log with accelerations of S, where they are of a point (3,) [m] in S."""
    return replace(
        log, acceleration=log.acceleration - lever_matrix(log.angular_velocity, log.angular_acceleration) @ place
    )


def misplaced(log: MotionLog, drift: bool = False) -> Misplaced | None:
    """Return the point whose acceleration the log gives; None where too few rows move or channels do not measure.

    drift  whether the bias may grow with time
    """
    if not moves(log):
        return None
    rows, _ = Rows.of(log, drift)
    if not rows.split:
        return None
    once = rows.solve()
    phi, place = once.phi, np.zeros(3)
    lever = lever_matrix(rows.log.angular_velocity, rows.log.angular_acceleration)
    # The axes of S along which turns show a point, and the one along which they do not.
    values, axes = np.linalg.eigh(np.einsum("nki,nkj->ij", lever, lever))
    seen = values > BLIND * values[2]
    axes, blind = (np.eye(3), None) if seen.all() else (axes[:, seen], axes[:, 0])
    for _ in range(ROUNDS):
        # What a body misses in its wrench where the point at one metre along each axis is taken for S.
        missed = -np.concatenate([cross_matrix(phi[1:4]) @ lever, phi[0] * lever], 1) @ axes
        fit = rows.solve(missed, jackknife=True)
        before, place, phi = place, axes @ fit.extra, fit.phi
        if np.linalg.norm(place - before) < SETTLED:
            break
    slow = rows.slowly(once)
    slowly = rows.slowly(fit, missed) / slow if slow else 1.0
    clear = rows.clear(once, fit, missed)
    std, moved = np.sqrt(axes**2 @ fit.extra_std**2), once.phi - phi
    com = phi[1:4] / phi[0]
    trace = float(phi[4] + phi[7] + phi[9] - 2 * phi[0] * com @ com)
    return Misplaced(place, std, fit.beside(once), slowly, clear, moved, com, trace, noise_share(log), blind)


def examine_place(
    log: MotionLog, known: tuple[Finding, ...], drift: bool = False
) -> tuple[Misplaced | None, tuple[Finding, ...]]:
    """Return the point whose acceleration the log gives where it is not S and is the best cause, or `force-unit`.

    It is seen beyond doubt, or only may be one.
    Two masses, or a turned sensor, must leave more of the residual. A point where another unit or sign puts it is none.

    known  what was found before: where the motion or the wrench is no body's, no point is looked for
    """
    if stands_aside("place", known):
        return None, ()
    found = misplaced(log, drift)
    if found is None or not (found.seen or found.maybe):
        return None, ()
    if any(r is not None and found.left >= r.left for r in (two_masses(log), sensor_matrix(log, drift))):
        return None, ()
    if not found.of_a_unit:
        return found, ()
    if not found.seen:
        return None, ()
    ratio, std = found.larger
    # A point at the centre of mass itself has no ratio that tells.
    return None, (opposed(ratio, std) or compared(ratio, std)) if std < TOLD * abs(ratio) else ()
