"""HPS as published: part masses by non-negative least squares on rows that look still, gravity alone, nothing weighted.

For comparison. It takes any number of parts, where the published code refuses more than four.
Source: "The Sum of Its Parts", eq. 6-7 and its code: no acceleration term, newton and newton metre mixed, rows chosen
by their *noisy* acceleration. The sign of gravity here is the physical one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from steelyard.check import Array, Mask
from steelyard.errors import CannotAnswer
from steelyard.evidence import Evidence
from steelyard.identify.estimate import Estimate
from steelyard.identify.masses.models import weighed
from steelyard.logs.log import MotionLog
from steelyard.parts.parts import Parts

# Bounds on the length of measured linear [m/s^2] and angular acceleration [rad/s^2], "below 1 unit".
GATE = 1.0
RANK_TOLERANCE = 1e-9
# Share of the trace of A^T A by which ties are broken.
TIE = 1e-12


@dataclass(frozen=True)
class PublishedPartMasses:
    """HPS with its parts, in the frame of the sensor."""

    parts: Parts

    def identify(self, log: MotionLog) -> Estimate:
        """Return the estimate of a log; the sensor is taken to be tared.

        The covariance is that of the wrench noise through the parts that carry mass, zero where the log declares none.
        Raises CannotAnswer where no row passes the gate or no part carries mass.
        """
        used = self.rows(log)
        if not used.any():
            raise CannotAnswer(
                f"No row has both accelerations below {GATE:g} (m/s^2, rad/s^2), so none looks still. "
                "Use the noise-aware estimator, which takes every row."
            )
        chosen = log.rows(used)
        A, b = _stacked(chosen, self.parts)
        masses = _least_squares(A, b)
        if not masses.sum() > 0:
            raise CannotAnswer("The log shows no weight: no part carries mass. Check the sign of the wrench.")
        return self._estimate(chosen, A, b, masses)

    def rows(self, log: MotionLog) -> Mask:
        """Return which rows (N,) are used: those where both measured accelerations are within the gate."""
        linear = np.linalg.norm(log.acceleration, axis=1)
        angular = np.linalg.norm(log.angular_acceleration, axis=1)
        return np.asarray((linear < GATE) & (angular < GATE))

    def _estimate(self, log: MotionLog, A: Array, b: Array, masses: Array) -> Estimate:
        covariance = _covariance(A, log, masses > 0)
        B = self.parts.per_mass
        values = np.linalg.svd(A / np.linalg.norm(A, axis=0), compute_uv=False)
        seen = values > RANK_TOLERANCE * values[0]
        residual = (b - A @ masses).reshape(-1, 6)
        evidence = Evidence(
            rank=int(seen.sum()),
            condition=float(values[0] / values[-1]) if seen.all() else float("inf"),
            samples=len(log),
            still_samples=int(log.still.sum()),
            residual_force_N=float(np.sqrt(np.mean(residual[:, 3:] ** 2))),
            residual_torque_Nm=float(np.sqrt(np.mean(residual[:, :3] ** 2))),
        )
        return Estimate(
            self.parts.whole(masses),
            B @ covariance @ B.T,
            "part-masses-published",
            evidence,
            np.ones(10, np.bool_),
            parts=weighed(self.parts, masses, covariance),
            part_covariance=covariance,
        )


def _stacked(log: MotionLog, parts: Parts) -> tuple[Array, Array]:
    """Return the data matrix (6 n, P) with columns [c_i x (-g); -g] and the wrenches (6 n,).

    Source: eq. 6, whose wrench is [f, tau]; the order of rows does not matter.
    """
    weight = -log.gravity[:, None, :]
    columns = np.concatenate([np.cross(parts.centroid, weight), np.broadcast_to(weight, (len(log), len(parts), 3))], 2)
    return np.swapaxes(columns, 1, 2).reshape(-1, len(parts)), log.wrench.ravel()


def _least_squares(A: Array, b: Array) -> Array:
    """Return m >= 0 (P,) that minimises |A m - b|^2, of several such the one with the least |m|^2.

    Rows at rest have rank four, so that with more parts the answer of eq. 7 is a whole face; a corner of it, as an
    active-set solver returns, would be worse than what the published interior-point solver finds.
    """
    count = A.shape[1]
    tie = np.sqrt(TIE * np.square(A).sum()) * np.eye(count)
    return np.asarray(nnls(np.concatenate([A, tie]), np.concatenate([b, np.zeros(count)]), maxiter=50 * count)[0])


def _covariance(A: Array, log: MotionLog, held: Mask) -> Array:
    """Return the covariance (P, P) of the masses above zero from the declared wrench noise."""
    out = np.zeros((len(held), len(held)))
    if log.noise is None:
        return out
    variance = np.stack([noise.wrench for noise in log.noise])[log.noise_class].ravel()
    bread = np.linalg.pinv(A[:, held])
    out[np.ix_(held, held)] = (bread * variance) @ bread.T
    return out
