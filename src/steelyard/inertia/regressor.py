"""The Newton-Euler regressor: how the ten parameters turn the 12 motion features of a sample into a wrench.

With x = [alpha, a - g, omega omega^T (xx xy xz yy yz zz)] and phi = [m, h, I]:
    f   = m (a - g) + alpha x h + omega x (omega x h)
    tau = h x (a - g) + I alpha + omega x (I omega)
so [tau; f] = L(phi) x with L = sum_k phi_k E_k, and the acceleration noise enters through M = L[:, :6].
Source: Atkeson, An, Hollerbach 1986, eq. 6-9; the sign of gravity is that of a - g.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from steelyard.check import Array
from steelyard.inertia import forms
from steelyard.spatial import axial_vector, cross, cross_matrix, lever_acceleration


def _motion_map(phi: Array) -> Array:
    """Return L(phi) (6, 12) as it is written above: what the basis is made of."""
    m, h, inertia = phi[0], phi[1:4], forms.inertia_matrix(phi)
    out = np.zeros((6, 12))
    out[:3, :3], out[:3, 3:6] = inertia, cross_matrix(h)
    out[3:, :3], out[3:, 3:6] = -cross_matrix(h), m * np.eye(3)
    for k, outer in enumerate(forms.inertia_matrix(np.eye(10)[4:])):
        # omega x (I omega) = the axial vector of I omega omega^T: eps_ijk (omega omega^T I)_jk.
        out[:3, 6 + k] = axial_vector(inertia @ outer)
        out[3:, 6 + k] = (outer - np.trace(outer) * np.eye(3)) @ h
    return out


def newton_euler(phi: Array, felt: Array, omega: Array, alpha: Array) -> Array:
    """Return the wrench (..., 6) [tau, f] that bodies phi (..., 10) need; batches broadcast.

    felt   (..., 3) a - g [m/s^2];  omega (..., 3) [rad/s];  alpha (..., 3) [rad/s^2], in the axes of phi
    """
    m, h, inertia = phi[..., :1], phi[..., 1:4], forms.inertia_matrix(phi)
    force = m * felt + lever_acceleration(omega, alpha, h)
    torque = cross(h, felt) + _applied(inertia, alpha) + cross(omega, _applied(inertia, omega))
    return np.concatenate([torque, force], -1)


def _applied(matrix: Array, vectors: Array) -> Array:
    """Return symmetric matrices (..., 3, 3) times vectors (..., 3)."""
    return vectors @ matrix if matrix.ndim == 2 else np.einsum("...ij,...j->...i", matrix, vectors)


@cache
def basis() -> Array:
    """Return E (10, 6, 12), so that L(phi) = sum_k phi_k E_k."""
    out = np.stack([_motion_map(row) for row in np.eye(10)])
    out.flags.writeable = False
    return out


def motion_map(phi: Array) -> Array:
    """Return L(phi) (6, 12)."""
    return np.tensordot(phi, basis(), axes=1)


@cache
def design(with_bias: bool) -> Array:
    """Return T (p, 6, 19): the derivative of the residual map K = [-L, 1, -b] by phi (10) and bias (6)."""
    parameters = 16 if with_bias else 10
    out = np.zeros((parameters, 6, 19))
    out[:10, :, :12] = -basis()
    if with_bias:
        out[10:, :, 18] = -np.eye(6)
    out.flags.writeable = False
    return out
