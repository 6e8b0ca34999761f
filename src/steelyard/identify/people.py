"""The numbers that people read (mass, centre of mass, inertia about it) and the ten parameters: slopes both ways.

Compiled for one body: every estimate needs them a few times, and the plain forms cost more than the solve.
"""

from __future__ import annotations

import numba
import numpy as np

from steelyard.check import Array


@numba.njit(cache=True)
def people_jacobian(phi: Array) -> Array:
    """Return d (mass, com, inertia about the CoM xx xy xz yy yz zz) / d phi (10, 10) at phi (10,)."""
    m = phi[0]
    x, y, z = phi[1] / m, phi[2] / m, phi[3] / m
    out = np.eye(10)
    for i in range(3):
        out[1 + i, 0], out[1 + i, 1 + i] = -phi[1 + i] / (m * m), 1 / m
    out[4:, 0] = _shift(x, y, z)
    out[4:, 1:4] = -_shift_slopes(x, y, z)
    return out


@numba.njit(cache=True)
def parameter_jacobian(phi: Array) -> Array:
    """Return d phi / d (mass, com, inertia about the CoM) (10, 10) at phi (10,): the inverse of `people_jacobian`."""
    m = phi[0]
    x, y, z = phi[1] / m, phi[2] / m, phi[3] / m
    out = np.eye(10)
    for i in range(3):
        out[1 + i, 0], out[1 + i, 1 + i] = phi[1 + i] / m, m
    out[4:, 0] = _shift(x, y, z)
    out[4:, 1:4] = m * _shift_slopes(x, y, z)
    return out


@numba.njit(cache=True)
def half_trace_com(phi: Array) -> float:
    """Return half the trace of the inertia about the centre of mass of phi (10,) [kg m^2]."""
    square = phi[1] * phi[1] + phi[2] * phi[2] + phi[3] * phi[3]
    return 0.5 * float(phi[4] + phi[7] + phi[9]) - float(square / phi[0])


@numba.njit(cache=True)
def _shift(x: float, y: float, z: float) -> Array:
    """Return the inertia (6,) of 1 kg at a point [m^2]."""
    return np.array([y * y + z * z, -x * y, -x * z, x * x + z * z, -y * z, x * x + y * y])


@numba.njit(cache=True)
def _shift_slopes(x: float, y: float, z: float) -> Array:
    """Return the slope (6, 3) of `_shift` along the point."""
    out = np.zeros((6, 3))
    out[0, 1], out[0, 2] = 2 * y, 2 * z
    out[1, 0], out[1, 1] = -y, -x
    out[2, 0], out[2, 2] = -z, -x
    out[3, 0], out[3, 2] = 2 * x, 2 * z
    out[4, 1], out[4, 2] = -z, -y
    out[5, 0], out[5, 1] = 2 * x, 2 * y
    return out
