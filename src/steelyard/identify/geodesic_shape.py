"""Geodesic with the object's shape as prior: a body of one density, done right, and as published for the table.

Source: Lee, Wensing, Park 2019, entropic; the prior of "The Sum of Its Parts", section V-A.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from steelyard import check
from steelyard.errors import CannotAnswer
from steelyard.identify.cost.linear import solve_scaled
from steelyard.identify.fit import Estimator
from steelyard.identify.geodesic import Geodesic
from steelyard.identify.problem import Problem
from steelyard.identify.solution import Solution
from steelyard.inertia import InertialParameters, forms


@dataclass(frozen=True, eq=False)
class ShapeGeodesic(Estimator):
    """Options of GEO with the object's shape as prior; the sensor is taken to be tared.

    shape     the prior in S up to its mass: `uniform` of the parts, or `published_prior`
    mass      the mass of the prior [kg]; None = what least squares finds
    alpha     strength, see `Geodesic`
    weighted  rows weighted by the wrench noise; as published N and N m count alike, and the pull is then far weaker
    """

    method = "geodesic-shape"

    shape: InertialParameters
    mass: float | None = None
    alpha: float = 1e-5
    weighted: bool = False

    def solution(self, problem: Problem) -> Solution:
        """Return the solution of a problem."""
        if not self.weighted:
            problem = replace(problem, wrench=np.ones_like(problem.wrench))
        weights = problem.wrench_weights
        mass = self.mass or float(solve_scaled(*problem.normal_equations(weights))[0])
        if not mass > 0:
            raise CannotAnswer(
                f"Least squares finds a mass of {mass:.3g} kg, so there is no prior body. Check the sign of the wrench."
            )
        prior = InertialParameters(self.shape.vector * (mass / self.shape.mass))
        return Geodesic(prior, alpha=self.alpha, bias="none").solution(problem)


def published_prior(points: ArrayLike) -> InertialParameters:
    """Return the prior of the published code, of 1 kg, from centroids (T, 3) [m] of tets in S: wrong, for the table.

    The centre of mass is the plain mean of the centroids, whatever their volume. The inertia J is that of equal point
    masses about S, and on top of it the parallel-axis term |c|^2 1 - c c^T is added a second time.
    """
    places = check.vectors("points", points)
    com = places.mean(0)
    inertia = forms.point_inertia(places).mean(0) + forms.point_inertia(com)
    return InertialParameters(np.concatenate([[1.0], com, forms.upper(inertia)]))
