"""NoiseAware: maximum likelihood with noise in the wrench and in the measured acceleration (errors in variables).

At cobot speed the error of every plain least squares is dominated by noise in the regressor. Here the residual of a row
has the covariance Sigma_w + M(phi) Sigma_a M(phi)^T; the cost sum r^T W r is minimised by Newton steps in log-Cholesky
coordinates, so that every answer is a rigid body, from scatter matrices alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadValue, CannotAnswer
from steelyard.identify.cost import newton
from steelyard.identify.fit import Bias, Estimator
from steelyard.identify.problem import Problem
from steelyard.identify.solution import Solution
from steelyard.inertia import forms

# No search starts with a centre of mass further than this from the sensor [m].
FURTHEST = 3.0
# A body's radius of gyration per axis starts within these bounds [m]; the prior pulls it to that of a 5 cm ball.
SMALLEST, LARGEST, NEUTRAL = 0.005, 0.2, 0.05 / np.sqrt(5)


@dataclass(frozen=True)
class NoiseAware(Estimator):
    """Options of the noise-aware estimator.

    bias         "free", "none", or a Bias with a prior or a drift
    prior        weight of the pull toward the ball of the size that fits best: 1 counts like one sample per axis
    size         radius of gyration per axis to which the size is pulled where the data are silent [m]
    size_spread  how far off `size` may be, as a factor e^size_spread (one standard deviation)
    iterations   Newton steps at most
    """

    method = "noise-aware"
    verify_rest = True

    bias: Bias | str = "free"
    prior: float = 0.5
    size: float = float(NEUTRAL)
    size_spread: float = 1.0
    iterations: int = 60

    def __post_init__(self) -> None:
        if not 0 <= self.prior < np.inf:
            raise BadValue(f"prior must be a weight of zero or more; got {self.prior}.")
        if not (0 < self.size < np.inf and 0 < self.size_spread < np.inf):
            raise BadValue(f"size [m] and size_spread must be above zero; got {self.size} and {self.size_spread}.")
        if self.iterations < 1:
            raise BadValue(f"iterations must be 1 or more; got {self.iterations}.")

    def solution(self, problem: Problem) -> Solution:
        """Return the solution of a problem."""
        bias = problem.bias_prior
        priors = newton.Priors(self.prior, float(np.log(self.size)), self.size_spread**-2, bias.mean, bias.precision)
        linear = problem.reweighted(3)
        best = None
        for start in self._starts(linear):
            found = newton.minimise(start, problem.rows, priors, self.iterations)
            if best is None or found[1] < best[1]:
                best = found
            if found[2]:
                break
        if best is None or not np.isfinite(best[1]):
            raise CannotAnswer("The noise-aware cost has no minimum on this log; check units and signs with `doctor`.")
        u = best[0]
        prior = newton.shape_prior(u[:10], priors.gamma, priors.log_size, priors.precision)[2]
        return Solution(newton.linear_of(u), newton.jacobian(u[:10], newton.factor(u[:10])), prior)

    def _starts(self, linear: Array) -> Iterator[Array]:
        """Yield starting points [theta, bias]: the linear solution made a body, then the neutral ball at its centre."""
        mass = max(float(linear[0]), 1e-3)
        com = linear[1:4] / mass
        com = com * min(1.0, FURTHEST / max(float(np.linalg.norm(com)), FURTHEST))
        pseudo = forms.pseudo_inertia(linear[:10])
        values, axes = np.linalg.eigh(pseudo[:3, :3] / mass - np.outer(com, com))
        shape = (axes * np.clip(values, SMALLEST**2, LARGEST**2)) @ axes.T
        for s in (shape, self.size**2 * np.eye(3)):
            yield np.concatenate([forms.log_cholesky(forms.pseudo_inertia_about(mass, com, s)), linear[10:]])
