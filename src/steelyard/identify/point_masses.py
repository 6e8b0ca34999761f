"""PointMasses: the object as free, non-negative masses spread over its shape, so that every answer is a possible body.

For comparison. All rows are used with full dynamics, weighted by the wrench noise; no part is known.
Source: Nadeau, Giamou, Kelly 2022, "Fast Object Inertial Parameter Identification for Collaborative Robots", section
III; their switch between a static and a dynamic model is left out, since weighting and all rows do better.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import nnls

from steelyard import check
from steelyard.check import Array
from steelyard.errors import BadValue, CannotAnswer
from steelyard.identify.cost.linear import unit_diagonal
from steelyard.identify.fit import Estimator
from steelyard.identify.problem import Problem
from steelyard.identify.solution import Solution
from steelyard.inertia import forms

FEWEST = 4
NEGLIGIBLE = 1e-12


@dataclass(frozen=True, eq=False)
class PointMasses(Estimator):
    """Options of the point-mass discretisation; the sensor is taken to be tared.

    points  (K, 3) points inside the object, in S [m]
    """

    method = "point-masses"

    points: Array

    def __post_init__(self) -> None:
        points = check.vectors("points", self.points)
        if points.ndim != 2 or len(points) < FEWEST:
            raise BadValue(f"at least {FEWEST} points (K, 3) inside the object are needed; got {points.shape}.")
        object.__setattr__(self, "points", points)

    def solution(self, problem: Problem) -> Solution:
        """Return the best masses m >= 0: |R (B m - phi)|^2 with R^T R the weighted normal matrix of phi."""
        weights = problem.wrench_weights
        H, g = problem.normal_equations(weights)
        scaled, scale = unit_diagonal(H)
        values, vectors = np.linalg.eigh(scaled)
        kept = values > NEGLIGIBLE * values[-1]
        root = np.sqrt(values[kept])[:, None] * vectors[:, kept].T
        target = (vectors[:, kept].T @ (scale * g)) / np.sqrt(values[kept])
        masses = nnls((root / scale) @ self._unit_points, target, maxiter=100 * len(self.points))[0]
        if not masses.sum() > 0:
            raise CannotAnswer("The log shows no weight: no point carries mass. Check the sign of the wrench.")
        return Solution.unconstrained(self._unit_points @ masses, weights)

    @cached_property
    def _unit_points(self) -> Array:
        """B (10, K): the ten parameters of 1 kg at every point."""
        homogeneous = np.column_stack([self.points, np.ones(len(self.points))])
        return forms.from_pseudo_inertia(homogeneous[:, :, None] * homogeneous[:, None]).T
