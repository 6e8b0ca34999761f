"""Geodesic: weighted least squares with a pull toward a prior body, measured on the cone of bodies (the GEO baseline).

Source: Lee, Wensing, Park 2019, "Geometric robot dynamic identification", eq. 21 (entropic), eq. 18 (Riemannian); the
strength is their gamma = alpha tr(A^T Sigma^-1 A). The prior adds no second parallel-axis term.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np
from scipy.linalg import eigh

from steelyard.check import Array
from steelyard.errors import BadValue, CannotAnswer
from steelyard.identify.cost.linear import solve_scaled
from steelyard.identify.fit import Bias, Estimator
from steelyard.identify.problem import Problem
from steelyard.identify.solution import Solution
from steelyard.inertia import InertialParameters, forms

ITERATIONS = 100
NEUTRAL_RADIUS = 0.05
# Half the expected further fall of the cost, in units of one squared standard deviation.
CONVERGED = 1e-9


@dataclass(frozen=True)
class Geodesic(Estimator):
    """Options of the geodesic estimator.

    prior       the body to pull toward, in S; None = a ball of 5 cm with the mass and centre of least squares
    distance    "entropic": log-det divergence; "riemannian": squared affine-invariant distance
    alpha       strength, as a share of the trace of the weighted normal matrix
    bias        "free" or "none"
    """

    method = "geodesic"

    prior: InertialParameters | None = None
    distance: Literal["entropic", "riemannian"] = "entropic"
    alpha: float = 1e-5
    bias: Bias | str = "free"

    def __post_init__(self) -> None:
        if self.distance not in ("entropic", "riemannian"):
            raise BadValue(f"distance must be entropic or riemannian; got {self.distance!r}.")

    def solution(self, problem: Problem) -> Solution:
        """Newton's method on the cone: the cost is convex in the parameters (entropic) or along geodesics."""
        weights = problem.wrench_weights
        H, g = problem.normal_equations(weights)
        linear = solve_scaled(H, g)
        prior = _neutral(linear) if self.prior is None else forms.pseudo_inertia(self.prior.vector)
        gamma = 0.5 * self.alpha * float(np.trace(H[:10, :10]))
        x = np.concatenate([forms.from_pseudo_inertia(prior), linear[10:]])

        def cost(at: Array) -> float:
            return float(0.5 * at @ H @ at - g @ at + gamma * self._pull(at, prior)[0])

        for _ in range(ITERATIONS):
            _, slope, metric = self._pull(x, prior)
            gradient, hessian = H @ x - g, H.copy()
            gradient[:10] += gamma * slope
            hessian[:10, :10] += gamma * metric
            step = solve_scaled(hessian, -gradient)
            decrement = -float(gradient @ step)
            if decrement < CONVERGED:
                return Solution(x + step, np.eye(10), gamma * metric, weights)
            x = _shortened(cost, x, step, decrement)
        raise CannotAnswer(f"The geodesic fit did not settle in {ITERATIONS} steps; give a prior nearer to the object.")

    def _pull(self, x: Array, prior: Array) -> tuple[float, Array, Array]:
        """Return the distance of phi = x[:10] from the prior, its gradient (10,) and metric (10, 10); inf outside."""
        P = forms.pseudo_inertia(x[:10])
        values, vectors = eigh(P, prior)
        if values[0] <= 0:
            return np.inf, np.zeros(10), np.zeros((10, 10))
        logs = np.log(values)
        inverse = np.linalg.inv(P)
        units = _units()
        half = inverse @ units
        metric = np.einsum("pij,qji->pq", half, half)
        if self.distance == "entropic":
            slope = np.einsum("ij,pij->p", np.linalg.inv(prior) - inverse, units)
            return float((values - logs - 1).sum()), slope, metric
        # With P v = lambda P0 v the gradient of sum log^2 lambda is sum 2 log lambda / lambda v v^T.
        slope = np.einsum("ij,pij->p", (vectors * (2 * logs / values)) @ vectors.T, units)
        longest = float(np.abs(logs).max())
        bend = longest / np.tanh(longest) if longest > 1e-6 else 1.0
        return float((logs**2).sum()), slope, 2 * bend * metric


def _shortened(cost: Callable[[Array], float], x: Array, step: Array, decrement: float) -> Array:
    """Return the first of x + step, x + step/2, ... that is a body and lowers the cost."""
    before = cost(x)
    for share in 0.5 ** np.arange(60):
        trial = x + share * step
        if cost(trial) <= before - 1e-4 * share * decrement + 1e-12 * abs(before):
            return np.asarray(trial)
    return x


@cache
def _units() -> Array:
    """Return the pseudo-inertia (10, 4, 4) of each unit parameter."""
    return forms.pseudo_inertia(np.eye(10))


def _neutral(linear: Array) -> Array:
    """Return the pseudo-inertia of a 5 cm ball with the mass and centre that least squares found."""
    mass = max(float(linear[0]), 1e-3)
    return forms.pseudo_inertia_about(mass, linear[1:4] / mass, NEUTRAL_RADIUS**2 / 5 * np.eye(3))
