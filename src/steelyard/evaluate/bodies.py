"""Scores of an estimate against the truth: the papers' metrics, in floating point throughout.

Every function takes the found and the true body (batch shape ...) in one frame and returns (...).
Source: "The Sum of Its Parts", section V-B, whose code truncates the centre-of-mass score to whole percents
and takes the box of a thickened shape; here nothing is truncated and the box is the true one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from steelyard import check
from steelyard.check import Array, Mask
from steelyard.inertia import InertialParameters, forms


@dataclass(frozen=True)
class Scores:
    """How far one estimate is from the truth.

    mass_pct     mass error [% of the true mass]
    com_mm       length of the centre-of-mass error [mm]
    com_pct      mean over the axes of S of the centre-of-mass error [% of the bounding box's edge]
    inertia_pct  mean error of the six entries about the S origin [% of `inertia_scale`]
    riemannian   affine-invariant distance of the pseudo-inertias; None where the estimate is not consistent
    consistent   whether the pseudo-inertia of the estimate is positive definite
    """

    mass_pct: float
    com_mm: float
    com_pct: float
    inertia_pct: float
    riemannian: float | None
    consistent: bool


def score(found: InertialParameters, true: InertialParameters, bounds: ArrayLike) -> Scores:
    """Score one body; `bounds` (2, 3) [m] are the corners of its true bounding box in S, lower first."""
    edges = box_edges(bounds)
    distance = float(riemannian(found, true))
    return Scores(
        mass_pct=float(mass_pct(found, true)),
        com_mm=float(com_mm(found, true)),
        com_pct=float(com_pct(found, true, edges)),
        inertia_pct=float(inertia_pct(found, true, edges)),
        riemannian=distance if np.isfinite(distance) else None,
        consistent=bool(consistent(found)) and bool(np.isfinite(distance)),
    )


def box_edges(bounds: ArrayLike) -> Array:
    """Return the edges (3,) [m] of the box between two corners (2, 3)."""
    corners = check.matrices("bounds", bounds, 2, 3)
    return np.asarray(corners[1] - corners[0])


def mass_pct(found: InertialParameters, true: InertialParameters) -> Array:
    """Return 100 |m - m*| / m*, of the bodies' batch shape."""
    return np.asarray(100 * np.abs(found.mass - true.mass) / true.mass)


def com_mm(found: InertialParameters, true: InertialParameters) -> Array:
    """Return 1000 |c - c*| [mm], of the bodies' batch shape; c in S."""
    return np.asarray(1000 * np.linalg.norm(found.com - true.com, axis=-1))


def com_pct(found: InertialParameters, true: InertialParameters, edges: ArrayLike) -> Array:
    """Return the mean over axes of 100 |c_i - c*_i| / a_i, with a (3,) the `edges` of the true box [m]."""
    return np.asarray(100 * np.mean(np.abs(found.com - true.com) / check.vectors("edges", edges), axis=-1))


def inertia_scale(mass: ArrayLike, edges: ArrayLike) -> Array:
    """Return D_ij = m/12 (delta_ij |a|^2 - a_i a_j) as (..., 6), entries xx xy xz yy yz zz [kg m^2].

    The diagonal is the inertia of a homogeneous box of that mass; the rest scales products of inertia alike.
    """
    a = check.vectors("edges", edges)
    scale = np.eye(3) * (a @ a) - np.outer(a, a)
    return np.asarray(np.asarray(mass)[..., None] / 12 * forms.upper(scale))


def inertia_pct(found: InertialParameters, true: InertialParameters, edges: ArrayLike) -> Array:
    """Return the mean of the six 100 |(J_ij - J*_ij) / D_ij|, J about the S origin, D of `inertia_scale`.

    edges  (3,) of the true box [m]; the answer has the bodies' batch shape
    """
    scale = inertia_scale(true.mass, edges)
    return np.asarray(100 * np.mean(np.abs((found.vector[..., 4:] - true.vector[..., 4:]) / scale), axis=-1))


def consistent(found: InertialParameters) -> Mask:
    """Return whether the pseudo-inertia is positive definite."""
    return np.asarray(np.linalg.eigvalsh(found.pseudo_inertia)[..., 0] > 0)


def riemannian(found: InertialParameters, true: InertialParameters) -> Array:
    """Return sqrt(1/2 sum_i log^2 lambda_i(P^-1 P*)); infinite where P is not positive definite.

    It does not depend on frame or units. Source: Lee, Wensing, Park 2019, eq. 16.
    """
    whiten = np.linalg.inv(np.linalg.cholesky(true.pseudo_inertia))
    values = np.linalg.eigvalsh(whiten @ found.pseudo_inertia @ np.swapaxes(whiten, -1, -2))
    good = values[..., 0] > 0
    logs = np.log(np.where(good[..., None], values, 1.0))
    return np.asarray(np.where(good, np.sqrt(0.5 * np.sum(logs**2, axis=-1)), np.inf))


def score_as_published(found: InertialParameters, true: InertialParameters, edges: ArrayLike) -> Scores:
    """Score one body as the published code does, by the box `edges` (3,) [m]: for the table only, never to judge by.

    It keeps the centre-of-mass error in an array of integers, so that each axis loses what is behind the decimal point,
    and divides by the box of its own estimated shape, which is thicker than the object. Edges are |R (max - min)| of
    the estimated points, R turning O into S: those of a box along the axes of S only where R swaps axes.
    """
    box = check.vectors("edges", edges)
    floored = np.floor(100 * np.abs(found.com - true.com) / box)
    right = score(found, true, np.stack([np.zeros(3), box]))
    return replace(right, com_pct=float(floored.mean()))
