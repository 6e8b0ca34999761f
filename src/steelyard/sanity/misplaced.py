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
from steelyard.sanity.full_fit import Rows
from steelyard.sanity.sensor_matrix import sensor_matrix
from steelyard.sanity.torques import UNITS
from steelyard.sanity.two_masses import ELSEWHERE, noise_share, two_masses
from steelyard.spatial import cross_matrix

# A point this far [m] from S is worth a word, if it is so many standard deviations from none, by leaving out stretches,
# and leaves less of the squared residual. No tool's tip is farther than the last.
APART, SURE, LEFT, FARTHEST = 0.01, 8.0, 0.95, 2.0
# Noise of an acceleration draws the point to the centre of mass by its share of the variance; so many times that is
# allowed, and no point is told above the second share.
NOISE, CALM = 3.0, 0.05
# Forces k times too large look like a point at 1 - k times the centre of mass. So near, the unit is likelier.
NEAR = 0.03
# The point is sought anew with the body found until it moves by less [m].
ROUNDS, SETTLED = 5, 1e-5
_FEWEST_ROWS, _FEWEST_BLOCKS = 50, 6


@dataclass(frozen=True, eq=False)
class Misplaced:
    """The point whose acceleration is given.

    place, std  (3,) [m] from the origin of S, in S, with standard deviations by leaving out stretches of the log
    left        squared residual beside that with the origin of S
    moved       (10,) what the parameters are less with it
    com         (3,) [m] centre of mass with it
    noise       share of noise in the squared acceleration of the rows
    """

    place: Array
    std: Array
    left: float
    moved: Array
    com: Array
    noise: float

    @property
    def sure(self) -> bool:
        """Whether it is another point than the origin of S beyond doubt, and one that poses may be of."""
        far = float(np.linalg.norm(self.place))
        least = APART + NOISE * self.noise * float(np.linalg.norm(self.com))
        seen = bool((np.abs(self.place) > SURE * self.std).any()) and self.noise < CALM
        return seen and least < far < FARTHEST and self.left < LEFT and not self._of_a_unit

    @property
    def _of_a_unit(self) -> bool:
        """Whether it lies where the wrong unit of force or torque puts it."""
        ways = np.array([1 - factor for factor in (*(factor for factor, _ in UNITS), 1e3, 1e-3)])
        gaps = np.linalg.norm(self.place - ways[:, None] * self.com, axis=1)
        return bool((gaps < NEAR * np.linalg.norm(self.place)).any())

    @property
    def finding(self) -> Finding:
        """What is said of it."""
        where = ", ".join(f"{1e3 * v:.1f}" for v in self.place + 0.0)
        text = (
            f"The load moves as if the positions were those of a point ({where}) ± "
            f"{1e3 * float(np.linalg.norm(self.std)):.1g} mm from the origin of S, such as the tip of a tool. The "
            "answer assumes this."
        )
        return Finding("motion-mismatch", text, "Set the controller's TCP to S, or correct the positions.")

    def widened(self, estimate: Estimate) -> Estimate:
        """Return the estimate with bars that hold how well the point is known."""
        share = float(np.linalg.norm(self.std) / np.linalg.norm(self.place))
        return replace(estimate, covariance=estimate.covariance + share**2 * np.outer(self.moved, self.moved))

    def put_right(self, log: MotionLog) -> MotionLog:
        """Return the log with accelerations of S."""
        return replace(log, acceleration=log.acceleration - _lever(log) @ self.place)


def misplaced(log: MotionLog, drift: bool = False) -> Misplaced | None:
    """Return the point whose acceleration the log gives; None where too few rows move or channels do not measure.

    drift  whether the bias may grow with time
    """
    if log.dead.any() or (~log.still).sum() < _FEWEST_ROWS or not log.acceleration.any():
        return None
    rows, _ = Rows.of(log, drift)
    if rows.block.max() + 1 < _FEWEST_BLOCKS:
        return None
    once = rows.solve()
    phi, place, at = once.solution[:10], np.zeros(3), len(once.solution)
    lever = _lever(rows.log)
    for _ in range(ROUNDS):
        # What a body misses in its wrench where the point at one metre along each axis is taken for S.
        missed = -np.concatenate([cross_matrix(phi[1:4]) @ lever, phi[0] * lever], 1)
        fit = rows.solve(missed, jackknife=True)
        before, place, phi = place, fit.solution[at:], fit.solution[:10]
        if np.linalg.norm(place - before) < SETTLED:
            break
    left = fit.left / once.left if once.left else 1.0
    return Misplaced(place, fit.spread[at:], left, once.solution[:10] - phi, phi[1:4] / phi[0], noise_share(log))


def examine_place(log: MotionLog, known: tuple[Finding, ...], drift: bool = False) -> Misplaced | None:
    """Return the point whose acceleration the log gives where it is not S and is the best cause.

    Two masses, or a turned sensor, must leave more of the residual.

    known  what was found before: where the motion or the wrench is no body's, no point is looked for
    """
    if {f.code for f in known} & ELSEWHERE:
        return None
    found = misplaced(log, drift)
    if found is None or not found.sure:
        return None
    rivals = (two_masses(log), sensor_matrix(log, drift))
    return found if all(r is None or found.left < r.left for r in rivals) else None


def _lever(log: MotionLog) -> Array:
    """Return what turning adds to the acceleration of a point per metre from S (N, 3, 3)."""
    across = cross_matrix(log.angular_velocity)
    return np.asarray(cross_matrix(log.angular_acceleration) + across @ across)
