"""PartMasses: the ten parameters through the masses of homogeneous parts, noise-aware, with priors on their densities.

phi = B m, one column per part. The statistic enters once as the effective information about phi (noise taken out of the
acceleration block, bias projected out, sandwich folded in); everything else is small algebra in the masses, so that
averaging over hundreds of models of "which parts share a density" costs milliseconds.
Source: "The Sum of Its Parts", section III, for the model; the estimator is our own.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.optimize import nnls

from steelyard.check import Array
from steelyard.errors import BadValue, CannotAnswer
from steelyard.identify import density_priors, noise_cost
from steelyard.identify.conclude import conclude
from steelyard.identify.correlated import score_variance
from steelyard.identify.estimate import Estimate, PartMass
from steelyard.identify.fit import Bias
from steelyard.identify.linear import inverse_scaled, nonnegative, normal_equations, solve_scaled
from steelyard.identify.noise_levels import with_noise
from steelyard.identify.part_findings import part_findings
from steelyard.identify.problem import Problem
from steelyard.identify.solution import Solution
from steelyard.inertia import InertialParameters
from steelyard.logs.log import MotionLog
from steelyard.logs.moments import Moments
from steelyard.parts.parts import Parts

RENEWALS = 3


@dataclass(frozen=True)
class PartMasses:
    """Options of the part-mass estimator.

    parts    the parts, in the frame of the sensor
    bias     "free", "none" or a Bias
    density  "averaged": one common density and groups of equal density, averaged by evidence; "free": every part its
             own mass, not below zero
    """

    parts: Parts
    bias: Bias | str = "free"
    density: Literal["averaged", "free"] = "averaged"

    def __post_init__(self) -> None:
        if self.density not in ("averaged", "free"):
            raise BadValue(f"density must be averaged or free; got {self.density!r}.")

    def identify(self, log: MotionLog) -> Estimate:
        """Return the estimate of a log with the mass of every part."""
        log = with_noise(log, Bias.of(self.bias).free)
        problem = self._problem(Moments.of_log(log))
        start = self._uniform(problem)
        score = score_variance(log, problem, Solution(start, np.eye(10), np.zeros((10, 10))))
        return self._conclude(problem, start, score)

    def solve(self, moments: Moments) -> Estimate:
        """Return the estimate from a statistic that carries its noise."""
        problem = self._problem(moments)
        return self._conclude(problem, self._uniform(problem), None)

    def _problem(self, moments: Moments) -> Problem:
        bias = Bias.of(self.bias)
        return replace(Problem.of(moments, bias.free), bias_prior=bias.prior)

    def _uniform(self, problem: Problem) -> Array:
        """Return the linear parameters (p,) of the object at one density: the start."""
        shape = self.parts.whole(self.parts.volume / self.parts.volume.sum()).vector
        columns = np.zeros((len(problem.T), 1 + len(problem.T) - 10))
        columns[:10, 0] = shape
        columns[10:, 1:] = np.eye(len(problem.T) - 10)
        T = np.tensordot(columns.T, problem.T, axes=1)
        linear = np.zeros(len(problem.T))
        for _ in range(RENEWALS):
            H, g = normal_equations(T, problem.scatter, problem.noise_weights(problem.residual_map(linear)))
            linear = columns @ solve_scaled(H, g)
        if not linear[0] > 0:
            raise CannotAnswer("The log shows no weight: the mass comes out at zero or below. Check the wrench sign.")
        return linear

    def _conclude(self, problem: Problem, linear: Array, score: Array | None) -> Estimate:
        masses = covariance = np.zeros(0)
        for _ in range(RENEWALS):
            data = _effective(problem, linear, score)
            masses, covariance = self._masses(data)
            linear = data.linear_at(self.parts.whole(masses).vector)
        body = self.parts.whole(masses)
        estimate = _estimate(problem, data, body, self.parts, masses, covariance)
        return estimate.with_findings(*part_findings(estimate, self.parts, data.information))

    def _masses(self, data: Effective) -> tuple[Array, Array]:
        """Return masses (P,) [kg] and their covariance (P, P)."""
        B = self.parts.per_mass
        A, b = B.T @ data.information @ B, B.T @ data.pull
        free = _nonnegative_masses(A, b)
        if self.density == "free" or len(self.parts) == 1:
            held = free > 0
            covariance = np.zeros_like(A)
            covariance[np.ix_(held, held)] = inverse_scaled(A[np.ix_(held, held)])
            return free, covariance
        volume = self.parts.volume
        start = np.full(len(volume), np.log(max(free.sum(), 1e-6) / volume.sum()))
        common = density_priors.common_density(A, b, volume, start)
        widest = np.log(common[0][-1] / volume)
        groups = density_priors.equal_groups(A, b, volume, widest, density_priors.first_partitions(widest))
        looked = groups[4]
        families = [common[:1] + common[1:2] + common[2:], (groups[0][:looked], groups[1][:looked], groups[2][:looked])]
        mean, covariance, _ = density_priors.averaged(families)
        return mean, covariance


@dataclass(frozen=True, eq=False)
class Effective:
    """What the log says about phi: information F (10, 10) and F phi_hat (10,), and how the bias follows phi."""

    information: Array
    pull: Array
    bias_at: Array
    bias_slope: Array

    def linear_at(self, phi: Array) -> Array:
        """Return [phi, bias] (p,) with the bias that fits best beside phi."""
        return np.concatenate([phi, self.bias_at - self.bias_slope @ phi])


def _effective(problem: Problem, linear: Array, score: Array | None) -> Effective:
    """Return the effective information H V^-1 H about phi, with V the variance of the score and the bias projected out.

    H is the information with the noise of the acceleration taken out of the scatter, so that H phi = g is consistent.
    """
    K = problem.residual_map(linear)
    H, extra, plain = noise_cost.information(K, problem.T, problem.scatter, problem.acceleration, problem.wrench)
    _, g = problem.normal_equations(problem.noise_weights(K))
    H = nonnegative(H, plain)
    V = H + extra if score is None else score.copy()
    if problem.with_bias:
        H[10:16, 10:16] += problem.bias_prior.precision
        V[10:16, 10:16] += problem.bias_prior.precision
    bread = inverse_scaled(H[10:, 10:]) if problem.with_bias else np.zeros((0, 0))
    project = np.concatenate([np.eye(10), -H[:10, 10:] @ bread], 1)
    F, pull, meat = project @ H[:, :10], project @ g, project @ V @ project.T
    half = F @ inverse_scaled(meat)
    information = half @ F
    return Effective(0.5 * (information + information.T), half @ pull, bread @ g[10:], bread @ H[10:, :10])


def _nonnegative_masses(A: Array, b: Array) -> Array:
    """Return m >= 0 that minimises m^T A m / 2 - b^T m."""
    scale = 1 / np.sqrt(np.maximum(np.diag(A), 1e-300))
    values, vectors = np.linalg.eigh(A * np.outer(scale, scale))
    kept = values > 1e-12 * values[-1]
    root = np.sqrt(values[kept])[:, None] * vectors[:, kept].T
    target = (vectors[:, kept].T @ (scale * b)) / np.sqrt(values[kept])
    return np.asarray(scale * nnls(root, target, maxiter=50 * len(b))[0])


def _estimate(
    problem: Problem, data: Effective, body: InertialParameters, parts: Parts, masses: Array, covariance: Array
) -> Estimate:
    """Return the Estimate of part masses: conclude for the evidence, then the covariance of the masses."""
    solution = Solution(data.linear_at(body.vector), np.eye(10), np.zeros((10, 10)))
    estimate = conclude(problem, solution, "part-masses", require=False)
    B = parts.per_mass
    std = np.sqrt(np.maximum(np.diag(covariance), 0))
    found = tuple(
        PartMass(int(label), float(m), float(s), float(v), c)
        for label, m, s, v, c in zip(parts.label, masses, std, parts.volume, parts.centroid, strict=True)
    )
    return replace(
        estimate,
        parts=found,
        covariance=B @ covariance @ B.T,
        part_covariance=covariance,
        identified=np.ones(10, np.bool_),
        findings=tuple(f for f in estimate.findings if f.code != "inertia-not-identified"),
    )
