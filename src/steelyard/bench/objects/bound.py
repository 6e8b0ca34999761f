"""The Cramer-Rao bound of the held-object bench: what the best unbiased estimator that knows the parts could do.

Source: functional errors-in-variables model with the true accelerations as nuisance parameters: the information about
phi is sum Y^T (Sigma_w + M Sigma_a M^T)^-1 Y at the true motion, and B^T I B about the masses of parts.
"""

from __future__ import annotations

import numpy as np

from steelyard import evaluate
from steelyard.check import Array
from steelyard.identify.cost.linear import inverse_scaled, normal_equations
from steelyard.identify.cost.noise_cost import residual_map_of, weight
from steelyard.inertia import InertialParameters, forms
from steelyard.inertia.people import people_jacobian
from steelyard.inertia.regressor import design
from steelyard.logs.log import MotionLog, Noise
from steelyard.logs.moments import Moments
from steelyard.parts.parts import Parts
from steelyard.simulate.handling import noise_std

DRAWS = 4000


def covariance(log: MotionLog, noise: Noise, body: InertialParameters, parts: Parts) -> Array:
    """Return the least covariance (10, 10) of phi with free masses of `parts`, from the exact rows of `body`."""
    T = design(with_bias=False)
    K = residual_map_of(T, body.vector.copy())
    scatter = Moments.of_log(log).sum
    information, _ = normal_equations(T, scatter[None], weight(K, noise.acceleration, noise.wrench)[None])
    B = parts.per_mass
    return np.asarray(B @ inverse_scaled(B.T @ information @ B) @ B.T)


def expected_scores(spread: Array, body: InertialParameters, edges: Array) -> dict[str, float]:
    """Return the expected scores of Gaussian errors with covariance `spread` (10, 10), to first order.

    Means over a fixed draw: absolute errors of mass, centre of mass and inertia, and the Riemannian distance.
    """
    values, vectors = np.linalg.eigh(spread)
    root = vectors * np.sqrt(np.maximum(values, 0))
    error = np.random.default_rng(0).standard_normal((DRAWS, 10)) @ root.T
    mass = float(body.mass)
    centre = error @ people_jacobian(body.vector.copy())[1:4].T
    relative = np.linalg.solve(body.pseudo_inertia, forms.pseudo_inertia(error))
    return {
        "mass_pct": float(np.mean(100 * np.abs(error[:, 0]) / mass)),
        "com_pct": float(np.mean(100 * np.abs(centre) / edges)),
        "com_mm": float(np.mean(1000 * np.linalg.norm(centre, axis=1))),
        "inertia_pct": float(np.mean(100 * np.abs(error[:, 4:] / evaluate.inertia_scale(mass, edges)))),
        "riemannian": float(np.mean(np.sqrt(0.5 * np.einsum("nij,nji->n", relative, relative)))),
    }


def noise_of(scenario: str) -> Noise:
    """Return the variances of a noise scenario."""
    return Noise.of_std(*noise_std(scenario))
