"""Smoothed rotations, and how fast they turn.

They are smoothed as quaternions, component by component with one filter: the answer then turns with the frames, and
noise on the unit sphere stays isotropic. Body rates are 2 q* dq/dt.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from steelyard import check
from steelyard.check import Array
from steelyard.logs.smoothing import Smooth, smooth
from steelyard.spatial import Rotation


def smooth_rotations(time: Array, rotation: Rotation, cutoff_hz: float | None = None) -> Smooth:
    """Smooth rotations R_WS (batch (N,)) sampled at rising `time` (N,) [s], low-passed at `cutoff_hz` [Hz] if given.

    Their quaternions are smoothed, four channels of one noise level; `turning` tells what these say.
    """
    q = rotation.quaternion_wxyz()
    flips = np.cumprod(np.where((q[1:] * q[:-1]).sum(1) < 0, -1.0, 1.0))
    q = q * np.concatenate([[1.0], flips])[:, None]
    return smooth(time, q, 3, cutoff_hz)


def turning(states: Array, variance: Array) -> tuple[Rotation, Array, Array, Array]:
    """Return rotation, angular velocity, angular acceleration (M, 3) in S, and variances (M, 3), of quaternions.

    states (M, 3, 4), variance (M, 3)   of the quaternions with their derivatives, as `Smooth.at` has them

    The variances are per axis of the angle [rad^2], rate [rad^2/s^2] and acceleration [rad^2/s^4].
    """
    matrix, omega, alpha = _turned(check.sealed(states))
    # What is no rotation is refused there.
    turn = Rotation.trusted(matrix) if np.isfinite(matrix).all() else Rotation.from_quaternion_wxyz(states[:, 0])
    return turn, omega, alpha, 4 * variance


@njit(cache=True, error_model="numpy")
def _turned(states: Any) -> Any:
    """Return rotation matrices (M, 3, 3), rates and accelerations (M, 3) of quaternions (M, 3, 4), scalar first."""
    matrix = np.empty((len(states), 3, 3))
    omega, alpha = np.empty((len(states), 3)), np.empty((len(states), 3))
    for k in range(len(states)):
        q, dq, ddq = states[k, 0], states[k, 1], states[k, 2]
        square = _inner(q, q)
        growth = 2 * _inner(q, dq) / square
        for i in range(3):
            omega[k, i] = 2 * _conjugate_times(q, dq, i) / square
            alpha[k, i] = 2 * _conjugate_times(q, ddq, i) / square - omega[k, i] * growth
        norm = np.sqrt(square)
        w, x, y, z = q[0] / norm, q[1] / norm, q[2] / norm, q[3] / norm
        R = matrix[k]
        R[0, 0], R[0, 1], R[0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)
        R[1, 0], R[1, 1], R[1, 2] = 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)
        R[2, 0], R[2, 1], R[2, 2] = 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)
    return matrix, omega, alpha


@njit(cache=True, inline="always")
def _inner(q: Any, p: Any) -> Any:
    return q[0] * p[0] + q[1] * p[1] + q[2] * p[2] + q[3] * p[3]


@njit(cache=True, inline="always")
def _conjugate_times(q: Any, p: Any, i: int) -> Any:
    """Return entry i of the vector part of q* p for quaternions (4,), scalar first."""
    j, k = 1 + (i + 1) % 3, 1 + (i + 2) % 3
    return q[0] * p[1 + i] - q[1 + i] * p[0] - q[j] * p[k] + q[k] * p[j]
