"""The numbers that people read (mass, centre of mass, inertia about it) and the ten parameters: slopes both ways.

Compiled for one body: every estimate needs them a few times, and the plain forms cost more than the solve. Compiled
once, for arrays that may be written to: hand over a copy of one that may not.
"""

from __future__ import annotations

import numba
import numpy as np

from steelyard.check import Array

ENTRIES = np.array(["xx", "xy", "xz", "yy", "yz", "zz"])  # of an inertia
NAMES = ("mass", "com x", "com y", "com z", *(f"I{entry}" for entry in ENTRIES))


@numba.njit(cache=True, error_model="numpy")
def people_jacobian(phi: Array) -> Array:
    """Return d (mass, com, inertia about the CoM xx xy xz yy yz zz) / d phi (10, 10) at phi (10,)."""
    return _slopes(phi, -1.0, 1 / phi[0])


@numba.njit(cache=True, error_model="numpy")
def parameter_jacobian(phi: Array) -> Array:
    """Return d phi / d (mass, com, inertia about the CoM) (10, 10) at phi (10,): the inverse of `people_jacobian`."""
    return _slopes(phi, phi[0], phi[0])


@numba.njit(cache=True, error_model="numpy")
def _slopes(phi: Array, sign: float, scale: float) -> Array:
    """Return a Jacobian that adds (sign > 0) or takes away the inertia of the mass at its centre.

    The centre goes into its rows by `scale`; along it the inertia has the slopes of one kilogram, times `sign`.
    """
    m = phi[0]
    x, y, z = phi[1] / m, phi[2] / m, phi[3] / m
    out = np.zeros((10, 10))
    out[0, 0] = 1.0
    for i in range(3):
        out[1 + i, 0] = phi[1 + i] / m if sign > 0 else -phi[1 + i] / (m * m)
        out[1 + i, 1 + i] = scale
    for i in range(4, 10):
        out[i, i] = 1.0
    out[4, 0], out[5, 0], out[6, 0] = y * y + z * z, -x * y, -x * z
    out[7, 0], out[8, 0], out[9, 0] = x * x + z * z, -y * z, x * x + y * y
    out[4, 2], out[4, 3] = sign * 2 * y, sign * 2 * z
    out[5, 1], out[5, 2] = -sign * y, -sign * x
    out[6, 1], out[6, 3] = -sign * z, -sign * x
    out[7, 1], out[7, 3] = sign * 2 * x, sign * 2 * z
    out[8, 2], out[8, 3] = -sign * z, -sign * y
    out[9, 1], out[9, 2] = sign * 2 * x, sign * 2 * y
    return out


@numba.njit(cache=True, error_model="numpy")
def half_trace_com(phi: Array) -> float:
    """Return half the trace of the inertia about the centre of mass of phi (10,) [kg m^2]."""
    square = phi[1] * phi[1] + phi[2] * phi[2] + phi[3] * phi[3]
    return 0.5 * float(phi[4] + phi[7] + phi[9]) - float(square / phi[0])
