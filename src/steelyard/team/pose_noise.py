"""Noise of every robot's poses from the residuals of the joint fit."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array
from steelyard.logs.log import Mask

ROUNDS = 60
# [rad], [m] what encoders resolve at best: noise is not taken below it.
LEAST = np.array([1e-7, 1e-7])


def pose_noise(residual: Array, valid: Mask, J: Array, noise: Array) -> Array:
    """Return the standard deviations (N, 2) of rotation [rad] and position [m].

    residual  (T, N, 6) of the joint fit     valid (T, N)     J (N, 6, 6) residuals per motion of the payload
    noise     (N, 2) to begin with

    The motion of the payload takes up six combinations of the residuals, so that their scatter S is that of
    (1 - J A^-1 J^T W) n. Expectation maximisation on S: no pass over the rows. Only rows where all robots speak count.
    """
    count = valid.shape[1]
    rows = residual[valid.all(1)].reshape(-1, 6 * count)
    if not len(rows):
        return noise
    return noise_of_scatter(rows.T @ rows, float(len(rows)), J, noise)


def noise_of_scatter(scatter: Array, rows: float, J: Array, noise: Array) -> Array:
    """Return the same from the scatter (6 N, 6 N) of residuals, or of measured twists, of which J explains six."""
    count = len(noise)
    if not rows:
        return noise
    S = scatter / rows
    stack = J.reshape(6 * count, 6)
    variance = noise**2
    for _ in range(ROUNDS):
        W = np.repeat(1 / variance, 3, axis=1).ravel()
        A = np.linalg.inv((stack * W[:, None]).T @ stack)
        P = np.eye(6 * count) - stack @ A @ (stack * W[:, None]).T
        expected = np.diag(P @ S @ P.T) + np.einsum("ka,ab,kb->k", stack, A, stack)
        new = np.maximum(expected.reshape(count, 2, 3).mean(-1), LEAST**2)
        if np.abs(np.log(new / variance)).max() < 1e-3:
            return np.asarray(np.sqrt(new))
        variance = new
    return np.asarray(np.sqrt(variance))
