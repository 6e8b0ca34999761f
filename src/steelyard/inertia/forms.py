"""Linear and nonlinear forms of the ten parameters, as functions of plain arrays.

The order is m, h_x, h_y, h_z, I_xx, I_xy, I_xz, I_yy, I_yz, I_zz: mass [kg], first moment [kg m] and the
rotational inertia about the frame origin [kg m^2] with tensor off-diagonals (I_xy = -sum m x y). Nothing is
checked here: these run inside the estimators' loops.
"""

from __future__ import annotations

import numpy as np

from steelyard.check import Array

UPPER = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
_SHEAR = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))  # places in U of s12, s23, s13, t1, t2, t3


def inertia_matrix(phi: Array) -> Array:
    """Return the inertia about the origin (..., 3, 3) from (..., 10)."""
    return np.asarray(phi[..., [[4, 5, 6], [5, 7, 8], [6, 8, 9]]])


def upper(matrix: Array) -> Array:
    """Return the entries xx xy xz yy yz zz (..., 6) of symmetric (..., 3, 3)."""
    return np.asarray(matrix[..., [0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2]])


def point_inertia(point: Array) -> Array:
    """Return |c|^2 1 - c c^T (..., 3, 3), the inertia of 1 kg at `point` (..., 3) about the origin [m^2]."""
    square = (point * point).sum(-1)[..., None, None]
    return np.asarray(square * np.eye(3) - point[..., :, None] * point[..., None, :])


def com(phi: Array) -> Array:
    """Return the centre of mass (..., 3) [m] from (..., 10); NaN where the mass is zero."""
    mass = phi[..., :1]
    return np.asarray(phi[..., 1:4] / np.where(mass == 0, np.nan, mass))


def inertia_com(phi: Array) -> Array:
    """Return the inertia about the centre of mass (..., 3, 3) [kg m^2]; NaN where the mass is zero."""
    return np.asarray(inertia_matrix(phi) - phi[..., 0, None, None] * point_inertia(com(phi)))


def people(phi: Array) -> Array:
    """Return mass, centre of mass and inertia about it xx xy xz yy yz zz (..., 10); NaN where the mass is zero."""
    return np.concatenate([phi[..., :1], com(phi), upper(inertia_com(phi))], axis=-1)


def pseudo_inertia(phi: Array) -> Array:
    """Return P = [[Sigma, h], [h^T, m]] (..., 4, 4), Sigma = tr(I)/2 1 - I the second moment of mass.

    Source: Wensing, Kim, Slotine 2018, eq. 14.
    """
    inertia = inertia_matrix(phi)
    out = np.empty((*phi.shape[:-1], 4, 4))
    half_trace = 0.5 * np.trace(inertia, axis1=-2, axis2=-1)
    out[..., :3, :3] = half_trace[..., None, None] * np.eye(3) - inertia
    out[..., :3, 3] = out[..., 3, :3] = phi[..., 1:4]
    out[..., 3, 3] = phi[..., 0]
    return out


def from_pseudo_inertia(pseudo: Array) -> Array:
    """Return (..., 10) from the pseudo-inertia (..., 4, 4)."""
    sigma = pseudo[..., :3, :3]
    inertia = np.trace(sigma, axis1=-2, axis2=-1)[..., None, None] * np.eye(3) - sigma
    return np.concatenate([pseudo[..., 3, 3, None], pseudo[..., :3, 3], upper(inertia)], axis=-1)


def pseudo_inertia_about(mass: float, com: Array, second: Array) -> Array:
    """Return P (4, 4) of a body with second moment per unit mass `second` (3, 3) about its centre of mass (3,)."""
    centre = np.append(com, 1.0)
    out = np.outer(centre, centre)
    out[:3, :3] += second
    return mass * out


def log_cholesky(pseudo: Array) -> Array:
    """Return theta = [alpha, d1, d2, d3, s12, s23, s13, t1, t2, t3] (..., 10) of P (..., 4, 4), P > 0.

    P = U U^T with U = e^alpha [[e^d1, s12, s13, t1], [0, e^d2, s23, t2], [0, 0, e^d3, t3], [0, 0, 0, 1]].
    Source: Rucker and Wensing 2022, eq. 8-9.
    """
    flipped = np.linalg.cholesky(pseudo[..., ::-1, ::-1])
    u = flipped[..., ::-1, ::-1]
    unit = u / u[..., 3:, 3:]
    theta = [np.log(u[..., 3, 3])]
    theta += [np.log(unit[..., i, i]) for i in range(3)]
    theta += [unit[..., i, j] for i, j in _SHEAR]
    return np.stack(theta, axis=-1)


def log_cholesky_factor(theta: Array) -> Array:
    """Return U (..., 4, 4), upper triangular, from theta (..., 10)."""
    u = np.zeros((*theta.shape[:-1], 4, 4))
    for i in range(3):
        u[..., i, i] = np.exp(theta[..., 1 + i])
    for k, (i, j) in enumerate(_SHEAR):
        u[..., i, j] = theta[..., 4 + k]
    u[..., 3, 3] = 1
    return np.asarray(np.exp(theta[..., 0])[..., None, None] * u)


def from_log_cholesky(theta: Array) -> Array:
    """Return (..., 10) from theta (..., 10): every theta is a physically consistent body."""
    u = log_cholesky_factor(theta)
    return from_pseudo_inertia(u @ np.swapaxes(u, -1, -2))


def log_cholesky_jacobian(theta: Array) -> Array:
    """Return d phi / d theta (..., 10, 10), columns in the order of theta."""
    u = log_cholesky_factor(theta)
    scale = np.exp(theta[..., 0])
    columns = []
    for k in range(10):
        du = np.zeros_like(u)
        if k == 0:
            du = u
        elif k <= 3:
            du[..., k - 1, k - 1] = u[..., k - 1, k - 1]
        else:
            i, j = _SHEAR[k - 4]
            du[..., i, j] = scale
        half = du @ np.swapaxes(u, -1, -2)
        columns.append(from_pseudo_inertia(half + np.swapaxes(half, -1, -2)))
    return np.stack(columns, axis=-1)


def principal_slopes(axes: Array) -> Array:
    """Return d (principal moments) / d (inertia xx xy xz yy yz zz), (3, 6), of principal axes (3, 3) in columns."""
    return np.asarray(upper(axes.T[:, :, None] * axes.T[:, None, :]) * [1, 2, 2, 1, 2, 1])
