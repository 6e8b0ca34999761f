"""Screws: the exponential of a constant body twist and its inverse, batch-first, angular part first."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from steelyard import check
from steelyard.check import Array
from steelyard.spatial.pose import Pose
from steelyard.spatial.rotation import Rotation
from steelyard.spatial.vectors import cross

_SMALL = 1e-2  # [rad] below it the series is exact to the last digit


def exp_pose(screw: ArrayLike) -> Pose:
    """Return the poses (...) reached after unit time by body twists (..., 6) [rad, m]."""
    s = check.vectors("screw", screw, 6)
    phi, rho = s[..., :3], s[..., 3:]
    b, c = second_coefficients(np.linalg.norm(phi, axis=-1))
    turned = cross(phi, rho)
    return Pose(Rotation.exp(phi), rho + b[..., None] * turned + c[..., None] * cross(phi, turned))


def log_pose(pose: Pose) -> Array:
    """Return the body twists (..., 6) [rad, m] that reach the poses (...) after unit time; angles below pi."""
    phi = pose.rotation.log()
    angle = np.linalg.norm(phi, axis=-1)
    small = angle < _SMALL
    safe = np.where(small, 1.0, angle)
    square = angle**2
    series = 1 / 12 + square / 720 + square**2 / 30240
    factor = np.where(small, series, (1 - safe / (2 * np.tan(safe / 2))) / safe**2)
    turned = cross(phi, pose.position)
    rho = pose.position - 0.5 * turned + factor[..., None] * cross(phi, turned)
    return np.concatenate([phi, rho], axis=-1)


def second_coefficients(angle: Array, least: float = _SMALL) -> tuple[Array, Array]:
    """Return (1 - cos t) / t^2 and (t - sin t) / t^3 of angles [rad], the second by its series below `least`."""
    small = angle < least
    safe = np.where(small, 1.0, angle)
    square = angle**2
    b = 0.5 * np.sinc(angle / (2 * np.pi)) ** 2
    series = 1 / 6 - square / 120 + square**2 / 5040
    return b, np.asarray(np.where(small, series, (safe - np.sin(safe)) / safe**3))
