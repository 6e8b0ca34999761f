"""Noise of every robot's poses from the residuals of the joint fit."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array
from steelyard.logs.log import Mask

ROUNDS = 60
# [rad], [m] what encoders resolve at best: noise is not taken below it.
LEAST = np.array([1e-7, 1e-7])
# Scoring ends where noise changes by less than this share: the step after would change it by about its square.
SETTLED = 1e-4
# That robots of a team err alike counts as much as so many rows.
ALIKE = 1.0


def pose_noise(residual: Array, valid: Mask, J: Array, noise: Array) -> Array:
    """Return the standard deviations (N, 2) of rotation [rad] and position [m].

    residual  (T, N, 6) of the joint fit     valid (T, N)     J (N, 6, 6) residuals per motion of the payload
    noise     (N, 2) to begin with

    The motion of the payload takes up six combinations of the residuals, so that their scatter S is that of
    (1 - J A^-1 J^T W) n; no pass over the rows. Only rows where all robots speak count.
    """
    count = valid.shape[1]
    rows = residual[valid.all(1)].reshape(-1, 6 * count)
    if not len(rows):
        return noise
    return noise_of_scatter(rows.T @ rows, float(len(rows)), J, noise)


def noise_of_scatter(scatter: Array, rows: float, J: Array, noise: Array) -> Array:
    """Return the same from the scatter (6 N, 6 N) of residuals, or of measured twists, of which J explains six.

    Restricted maximum likelihood by Fisher scoring, with a faint belief that the robots of a team err alike: two grasps
    alone tell the sum of their noise, not who makes it.
    Source: Patterson and Thompson 1971.
    """
    count = len(noise)
    if not rows:
        return noise
    stack = J.reshape(6 * count, 6)
    variance = noise.ravel() ** 2
    likeness = ALIKE * np.kron(np.eye(count) - 1 / count, np.eye(2))
    for _ in range(ROUNDS):
        W = np.repeat(1 / variance, 3)
        pulled = stack * W[:, None]
        lever = pulled @ np.linalg.inv(pulled.T @ stack)
        M = np.diag(W) - lever @ pulled.T
        MS = W[:, None] * scatter - lever @ (pulled.T @ scatter)
        seen = np.einsum("ab,ab->a", MS, M).reshape(-1, 3).sum(1)
        size = np.diag(M).reshape(-1, 3).sum(1)
        slope = 0.5 * variance * (seen - rows * size) - likeness @ np.log(variance)
        squares = (M**2).reshape(2 * count, 3, 2 * count, 3).sum((1, 3))
        curve = 0.5 * rows * np.outer(variance, variance) * squares + likeness
        change = np.linalg.solve(curve + 1e-9 * np.trace(curve) / len(curve) * np.eye(len(curve)), slope)
        new = np.maximum(variance * (1 + np.maximum(change, -0.9)), np.tile(LEAST**2, count))
        moved = float(np.abs(np.log(new / variance)).max())
        variance = new
        if moved < SETTLED:
            break
    return np.asarray(np.sqrt(variance).reshape(count, 2))
