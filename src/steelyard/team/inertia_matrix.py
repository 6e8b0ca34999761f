"""Inertia about the centre of mass from the moments that the team applies in motion.

Source: "Cooperative Payload Estimation by a Team of Mocobots", III-D, eq. 17-33 and its footnote.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from steelyard import check
from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.inertia.forms import UPPER
from steelyard.spatial import cross, cross_matrix

Negative = Literal["clamp", "discard"]
# Least singular value of the column-scaled stack over its largest: below it a moment is not fixed.
LEAST_SPREAD = 1e-6


def regressor(omega: Array, alpha: Array) -> Array:
    """Return A (T, 3, 6) so that I alpha + omega x I omega = A (xx, xy, xz, yy, yz, zz), from (T, 3) each (eq. 20)."""
    omega = check.rows("omega", omega)
    alpha = check.rows("alpha", alpha, of=("omega", omega))
    return np.asarray(_times(alpha) + cross_matrix(omega) @ _times(omega))


def moment_about(wrench: Array, point: Array) -> Array:
    """Return moments (T, 3) about `point` (3,) from wrenches (T, 6) about the origin of the same axes (eq. 18)."""
    wrench, point = check.rows("wrench", wrench, 6), check.vectors("point", point)
    return np.asarray(wrench[:, :3] - cross(np.broadcast_to(point, wrench[:, 3:].shape), wrench[:, 3:]))


@dataclass(frozen=True, eq=False)
class InertiaFit:
    """Inertia (3, 3) [kg m^2] about the centre of mass and the formal covariance (6, 6) of xx xy xz yy yz zz.

    condition  of the stack with columns scaled to length 1
    residual   rms moment left per axis [N m]; samples  rows used
    """

    matrix: Array
    covariance: Array
    condition: float
    residual: float
    samples: int


def inertia(omega: Array, alpha: Array, moment: Array) -> InertiaFit:
    """Return the least-squares inertia about the centre of mass (eq. 29-32); negative eigenvalues stay.

    omega, alpha, moment  (T, 3) in the axes of the answer, the moment about the centre of mass
    Raises CannotAnswer where the motion leaves an entry open.
    """
    omega = check.rows("omega", omega)
    moment = check.rows("moment", moment, of=("omega", omega))
    stacked = regressor(omega, alpha).reshape(-1, 6)
    size = np.linalg.norm(stacked, axis=0)
    values = np.linalg.svd(stacked / np.where(size == 0, 1.0, size), compute_uv=False)
    if len(stacked) < 6 or not (size > 0).all() or not values[-1] > LEAST_SPREAD * values[0]:
        raise CannotAnswer(
            "the payload must turn about three axes, faster and slower, to tell its inertia; this motion leaves "
            "entries open. Turn it about all three axes."
        )
    entries, *_ = np.linalg.lstsq(stacked, moment.ravel(), rcond=None)
    left = moment.ravel() - stacked @ entries
    variance = float(left @ left) / max(len(left) - 6, 1)
    matrix = np.zeros((3, 3))
    for value, (i, j) in zip(entries, UPPER, strict=True):
        matrix[i, j] = matrix[j, i] = value
    covariance = np.asarray(variance * np.linalg.inv(stacked.T @ stacked))
    return InertiaFit(matrix, covariance, float(values[0] / values[-1]), float(np.sqrt((left**2).mean())), len(omega))


def made_positive(matrix: Array, negative: Negative = "clamp") -> tuple[Array, int]:
    """Return the inertia with its negative eigenvalues set to zero, and how many there were.

    Raises CannotAnswer instead where `negative` is "discard", the footnote's other choice. A moment of zero is no
    rigid body's either: the triangle inequality is not mended here.
    """
    values, axes = np.linalg.eigh(matrix)
    below = int((values < 0).sum())
    if below and negative == "discard":
        raise CannotAnswer(
            f"the inertia came out with {below} negative eigenvalue(s), the least {values[0]:.3g} kg m^2, and is "
            "discarded. Move faster, or average more rows."
        )
    return (matrix if not below else np.asarray(axes @ np.diag(np.maximum(values, 0)) @ axes.T)), below


def _times(vector: Array) -> Array:
    """Return L (T, 3, 6) so that L (xx, xy, xz, yy, yz, zz) = I vector."""
    x, y, z = vector.T
    zero = np.zeros_like(x)
    rows = [[x, y, z, zero, zero, zero], [zero, x, zero, y, z, zero], [zero, zero, x, zero, y, z]]
    return np.moveaxis(np.array(rows), 2, 0)
