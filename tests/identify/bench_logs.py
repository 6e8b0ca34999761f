"""Logs and estimators that the laws of identification share."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.identify.estimate import Estimate
from steelyard.identify.geodesic import Geodesic
from steelyard.identify.least_squares import LeastSquares
from steelyard.identify.noise_aware import NoiseAware
from steelyard.inertia import InertialParameters, forms
from steelyard.logs.log import MotionLog, Noise
from steelyard.simulate.logs import simulate_log

Estimator = NoiseAware | LeastSquares | Geodesic

BIAS = np.array([0.12, -0.31, 0.05, 3.2, -1.4, 7.9])
OBJECTS = ("hammer", "mallet", "hacksaw")
MOTIONS = ("stop_go", "dyn_slow", "dyn_fast")

# The geodesic prior is the only thing that moves its answer off the truth, in proportion to alpha.
WEAK = 1e-15
ESTIMATORS: dict[str, Estimator] = {
    "noise-aware": NoiseAware(),
    "ordinary": LeastSquares("ordinary"),
    "weighted": LeastSquares("weighted"),
    "total": LeastSquares("total"),
    "entropic": Geodesic(distance="entropic", alpha=WEAK),
    "riemannian": Geodesic(distance="riemannian", alpha=WEAK),
}


def bench_log(name: str, motion: str, noise: str = "none", seed: int = 0, biased: bool = True) -> MotionLog:
    """An ordered bench log with a sensor bias."""
    return simulate_log(name, motion, noise, seed, shuffled=False, bias=BIAS if biased else None)[0]


def truth(name: str) -> InertialParameters:
    return simulate_log(name, "stop_go", "none", 0)[1]


def declared(log: MotionLog, *std: float) -> MotionLog:
    """The log in one noise class of these standard deviations: alpha, a, force, torque."""
    return replace(log, noise=(Noise.of_std(*std),), noise_class=np.zeros(len(log), np.int64))


def people(body: InertialParameters) -> np.ndarray:
    """Mass, com, inertia about the CoM (10,)."""
    return np.concatenate([[float(body.mass)], body.com, forms.upper(body.inertia_com)])


def gaps(found: InertialParameters, true: InertialParameters) -> np.ndarray:
    """Errors (3,) of mass, first moment, inertia about the origin, as shares of m, m 0.1 m and the largest entry."""
    gap, size = np.abs(found.vector - true.vector), np.abs(true.vector)
    return np.array([gap[0] / size[0], gap[1:4].max() / (0.1 * size[0]), gap[4:].max() / size[4:].max()])


def same_bits(one: Estimate, other: Estimate) -> bool:
    return (
        np.array_equal(one.parameters.vector, other.parameters.vector)
        and np.array_equal(one.covariance, other.covariance)
        and np.array_equal(one.wrench_bias, other.wrench_bias)
        and one.evidence.chi2_per_dof == other.evidence.chi2_per_dof
        and one.findings == other.findings
    )
