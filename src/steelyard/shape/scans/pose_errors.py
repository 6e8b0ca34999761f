"""What reported poses of cameras are off by: what all have in common, the camera's own at the wrist, each view's alone.

An arm errs from view to view; a camera that is calibrated askew errs by the same in its own frame each time. How large
both are is found with them, by expectation and maximisation: without an error at the wrist its part goes to nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from steelyard.check import Array

_ROUNDS = 10  # of the variances, whenever the views were asked anew
_WRIST = 0.3  # of what views are off by, each by itself: an error at the wrist is believed to be no less, rms
_LEAST = np.radians(0.005), 5e-5  # poses are known no better [rad], [m]
_FREE = 1e-9  # precision of what all have in common, which no view can tell


@dataclass(frozen=True, eq=False)
class Shared:
    """Errors m_k (3,) of views, all turns or all shifts, as g + R_k h + e_k.

    own, common      h (3,) and g (3,)     covariance  (6, 6) of both
    of_own, of_each  variances of h and e_k, per axis
    """

    own: Array
    common: Array
    covariance: Array
    of_own: float
    of_each: float

    @classmethod
    def unknown(cls, variance: float) -> Shared:
        """Return what is believed before anything was seen: as much at the wrist as of each view, per axis."""
        return cls(np.zeros(3), np.zeros(3), variance * np.eye(6), variance, variance)

    def mean(self, R: Array) -> Array:
        """Return the errors (V, 3) that views of cameras with axes R (V, 3, 3) share."""
        return np.asarray(self.common + R @ self.own)

    def of(self, errors: Array, R: Array, unsure: float, least: float) -> Shared:
        """Return the parts of errors (V, 3) of cameras with axes R (V, 3, 3), the variances as they are here.

        unsure  variance of the errors, per axis     least  that of e_k is no less
        """
        A = np.concatenate([R, np.broadcast_to(np.eye(3), R.shape)], axis=2).reshape(-1, 6)
        normal, b = A.T @ A, errors.reshape(-1)
        covariance = np.linalg.inv(normal / self.of_each + np.diag([1 / self.of_own] * 3 + [0.0] * 3))
        x = covariance @ (A.T @ b) / self.of_each
        rest = b - A @ x
        of_each = float(rest @ rest + np.trace(normal @ covariance)) / len(b) + unsure + least
        of_own = max(float(x[:3] @ x[:3] + np.trace(covariance[:3, :3])) / 3, _WRIST**2 * of_each)
        return Shared(x[:3], x[3:], covariance, of_own, of_each)


@dataclass(frozen=True, eq=False)
class PoseErrors:
    """What is believed of the errors (V, 6) of reported poses: turns about a point of the object, and shifts there.

    given  axes (V, 3, 3) of the cameras as reported
    """

    given: Array
    turns: Shared
    shifts: Shared

    @classmethod
    def unknown(cls, given: Array, std_rad: float, std_m: float) -> PoseErrors:
        """Return what is believed of the poses of cameras with axes (V, 3, 3) before anything was seen.

        std_rad, std_m  standard deviations of turns and of shifts, at the wrist and of each view, per axis
        """
        return cls(given, Shared.unknown(std_rad**2), Shared.unknown(std_m**2))

    @property
    def mean(self) -> Array:
        """The errors (V, 6) that views share."""
        return np.concatenate([self.turns.mean(self.given), self.shifts.mean(self.given)], axis=1)

    @property
    def precision(self) -> Array:
        """Precision (6,) of what each view has beside them."""
        return np.repeat([1 / self.turns.of_each, 1 / self.shifts.of_each], 3)

    def information(self) -> Array:
        """Return the precision matrix (6 V, 6 V) of the errors of all views, whatever they share."""
        count = len(self.given)
        share = np.zeros((count, 2, 3, 2, 6))
        for kind in range(2):
            share[:, kind, :, kind, :3], share[:, kind, :, kind, 3:] = self.given, np.eye(3)
        shared = share.reshape(-1, 12)
        each = np.tile(self.precision, count)
        known = np.concatenate([[1 / part.of_own] * 3 + [_FREE] * 3 for part in (self.turns, self.shifts)])
        weighed = each[:, None] * shared
        inner = np.diag(known) + shared.T @ weighed
        return np.asarray(np.diag(each) - weighed @ np.linalg.solve(inner, weighed.T))

    def seen(self, off: Array, H: Array, g: Array) -> PoseErrors:
        """Return what is believed once views that are `off` (V, 6) their poses have shown more of it.

        H (V, 6, 6), g (V, 6)  Hessian and gradient of half the squares of what a view measures, by steps from there
        """
        turns, shifts = self.turns, self.shifts
        for _ in range(_ROUNDS):
            now = PoseErrors(self.given, turns, shifts)
            covariance = np.linalg.inv(H + np.diag(now.precision))
            errors = off + np.einsum("vij,vj->vi", covariance, now.precision * (now.mean - off) - g)
            unsure = np.diagonal(covariance, axis1=1, axis2=2).mean(0)
            turns = turns.of(errors[:, :3], self.given, float(unsure[:3].mean()), _LEAST[0] ** 2)
            shifts = shifts.of(errors[:, 3:], self.given, float(unsure[3:].mean()), _LEAST[1] ** 2)
        return PoseErrors(self.given, turns, shifts)
