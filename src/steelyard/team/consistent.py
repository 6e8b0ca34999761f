"""The physically consistent body nearest to an answer, in the metric of the answer's own covariance.

Source: log-Cholesky parameters of Rucker and Wensing 2022: every one of them is a body.
"""

from __future__ import annotations

import numpy as np

from steelyard.check import Array
from steelyard.inertia import forms

STEPS = 60
# Least eigenvalue of the pseudo-inertia, as a share of its middle one in units of mass and size, that counts as a body.
MARGIN = 1e-6


def consistent(phi: Array, covariance: Array, scale: Array) -> Array:
    """Return phi (10,), or the body of least (phi - phi')^T C^-1 (phi - phi') where phi is none.

    scale  (10,) units of mass, mass times size, mass times size squared
    """
    pseudo = forms.pseudo_inertia(phi / scale)
    if np.linalg.eigvalsh(pseudo)[0] > 0:
        return phi
    goal = phi / scale
    F = np.linalg.inv(covariance / np.outer(scale, scale) + 1e-18 * np.eye(10))
    F /= np.trace(F)
    theta = forms.log_cholesky(_nearby(pseudo))
    damping, found = 1e-3, forms.from_log_cholesky(theta)
    cost = float((found - goal) @ F @ (found - goal))
    for _ in range(STEPS):
        J = forms.log_cholesky_jacobian(theta)
        H, g = J.T @ F @ J, J.T @ F @ (goal - found)
        step = np.linalg.solve(H + damping * (np.diag(np.diag(H)) + 1e-12 * np.eye(10)), g)
        trial = theta + np.clip(step, -1.0, 1.0)
        body = forms.from_log_cholesky(trial)
        new = float((body - goal) @ F @ (body - goal))
        if new < cost and np.linalg.eigvalsh(forms.pseudo_inertia(body))[0] > MARGIN * MARGIN:
            settled = cost - new < 1e-10 * cost
            theta, found, cost, damping = trial, body, new, 0.3 * damping
            if settled:
                break
        else:
            damping *= 10
            if damping > 1e8:
                break
    return np.asarray(found * scale)


def _nearby(pseudo: Array) -> Array:
    """Return the pseudo-inertia (4, 4) of a body to start from: of the same mass and centre of mass, where the mass is
    above zero. These are mostly known far better than the rest, and a search from elsewhere creeps along what they
    allow.
    """
    mass, first = float(pseudo[3, 3]), pseudo[:3, 3]
    if mass <= 0:
        values, vectors = np.linalg.eigh(pseudo)
        return np.asarray((vectors * np.maximum(values, 1e-3 * max(float(values[-1]), 1.0))) @ vectors.T)
    out = pseudo.copy()
    point = np.outer(first, first) / mass
    values, vectors = np.linalg.eigh(pseudo[:3, :3] - point)
    out[:3, :3] = point + (vectors * np.maximum(values, 1e-3 * max(float(values[-1]), mass))) @ vectors.T
    return out
