"""Geodesic with the object's shape as prior: a body of one density, done right, and as published for the table.

Source: Lee, Wensing, Park 2019, entropic; the prior of "The Sum of Its Parts", section V-A.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from steelyard import check
from steelyard.errors import CannotAnswer
from steelyard.identify.estimate import Estimate
from steelyard.identify.geodesic import Geodesic
from steelyard.identify.least_squares import LeastSquares
from steelyard.inertia import InertialParameters, forms
from steelyard.logs.log import MotionLog
from steelyard.logs.moments import Moments
from steelyard.parts.parts import Parts


@dataclass(frozen=True)
class HomogeneousGeodesic:
    """Options of GEO with a homogeneous body as prior.

    parts  the object's shape, in the frame of the sensor
    mass   its true mass [kg]; None = what weighted least squares finds
    alpha  strength, see `Geodesic`
    """

    parts: Parts
    mass: float | None = None
    alpha: float = 1e-5

    def identify(self, log: MotionLog) -> Estimate:
        """Return the estimate of a log; the sensor is taken to be tared."""
        mass = self.mass or LeastSquares("weighted", bias="none").identify(log).mass
        return Geodesic(self._prior(mass), alpha=self.alpha, bias="none").identify(log)

    def solve(self, moments: Moments) -> Estimate:
        """Return the estimate from a statistic that carries its noise."""
        mass = self.mass or LeastSquares("weighted", bias="none").solve(moments).mass
        return Geodesic(self._prior(mass), alpha=self.alpha, bias="none").solve(moments)

    def _prior(self, mass: float) -> InertialParameters:
        if not mass > 0:
            raise CannotAnswer(
                f"Least squares finds a mass of {mass:.3g} kg, so there is no prior body. Check the sign of the wrench."
            )
        return uniform_body(self.parts, mass)


def uniform_body(parts: Parts, mass: float) -> InertialParameters:
    """Return the body of one density with the shape of `parts` and the given mass [kg], in their frame."""
    return parts.whole(parts.volume * (mass / parts.volume.sum()))


def published_prior(points: ArrayLike, mass: float) -> InertialParameters:
    """Return the prior of the published code from the centroids (T, 3) [m] of tetrahedra in S: wrong, for the table.

    The centre of mass is the plain mean of the centroids, whatever their volume. The inertia J is that of equal point
    masses about S, and on top of it the parallel-axis term m (|c|^2 1 - c c^T) is added a second time.
    """
    places = check.vectors("points", points)
    com = places.mean(0)
    inertia = mass * (forms.point_inertia(places).mean(0) + forms.point_inertia(com))
    return InertialParameters(np.concatenate([[mass], mass * com, forms.upper(inertia)]))
