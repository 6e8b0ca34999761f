"""Solution: what an estimator found, and how it was weighted."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from steelyard.check import Array


@dataclass(frozen=True, eq=False)
class Solution:
    """Linear parameters (p,), d phi / d coordinates (10, 10), prior Hessian in them (10, 10).

    weights  (C, 6, 6) fixed weights of the rows of each class; None = the inverse of their noise, that in the regressor
             included and taken out of the scatter
    known    (10,) what of phi was known beforehand, a tool, and is not asked for
    """

    linear: Array
    jacobian: Array
    prior: Array
    weights: Array | None = None
    known: Array = field(default_factory=lambda: np.zeros(10))

    @classmethod
    def unconstrained(cls, linear: Array, weights: Array | None = None) -> Solution:
        """Return a solution whose coordinates are the parameters `linear` (10,) or (16,), without a prior."""
        return cls(linear, np.eye(10), np.zeros((10, 10)), weights)

    @property
    def chain(self) -> Array:
        """J (p, p), the derivative of the linear parameters by the coordinates; a bias is its own."""
        J = np.eye(len(self.linear))
        J[:10, :10] = self.jacobian
        return J

    def with_prior(self, H: Array) -> Array:
        """Return information H (p, p) of the linear parameters as that of the coordinates, with the prior."""
        A = self.chain.T @ H @ self.chain
        A[:10, :10] += self.prior
        return np.asarray(A)

    @property
    def bias(self) -> Array:
        """The wrench bias (6,) [tau, f]; zero where it was not estimated."""
        return self.linear[10:16] if len(self.linear) > 10 else np.zeros(6)
