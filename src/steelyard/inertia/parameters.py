"""InertialParameters: mass, centre of mass and inertia of a rigid body in a named frame's axes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from steelyard import check
from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.inertia import forms
from steelyard.spatial import Pose, Rotation, cross_matrix


@dataclass(frozen=True)
class ValidityReport:
    """Which laws of rigid bodies hold; `problems` names each broken one with its numbers."""

    problems: tuple[str, ...]

    @property
    def consistent(self) -> bool:
        """Whether a body with positive mass everywhere can have these parameters."""
        return not self.problems

    def __str__(self) -> str:
        return "physically consistent" if self.consistent else "; ".join(self.problems)


@dataclass(frozen=True, eq=False)
class InertialParameters:
    """Ten parameters (..., 10) about the frame origin: m, h (3), I xx xy xz yy yz zz.

    Any finite numbers are accepted, consistent or not: `validity()` judges them, `require_consistent()` refuses.
    """

    vector: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "vector", check.vectors("inertial parameters", self.vector, 10))

    @classmethod
    def from_com(cls, mass: ArrayLike, com: ArrayLike, inertia_com: ArrayLike) -> InertialParameters:
        """Return the body of `mass` (...) [kg], `com` (..., 3) [m], inertia about the CoM (..., 3, 3) [kg m^2]."""
        m = check.finite("mass", mass)[..., None]
        c = check.vectors("centre of mass", com)
        central = check.matrices("inertia about the centre of mass", inertia_com)
        asymmetry = float(np.abs(central - np.swapaxes(central, -1, -2)).max(initial=0.0))
        if asymmetry > 1e-9 * float(np.abs(central).max(initial=0.0)) + 1e-15:
            raise BadValue(f"inertia must be symmetric; it differs from its transpose by {asymmetry:.3g} kg m^2.")
        k = cross_matrix(c)
        inertia = central - m[..., None] * (k @ k)
        return cls(np.concatenate([m, m * c, forms.upper(inertia)], axis=-1))

    @classmethod
    def from_pseudo_inertia(cls, pseudo: ArrayLike) -> InertialParameters:
        """Return the body of the pseudo-inertia (..., 4, 4)."""
        return cls(forms.from_pseudo_inertia(check.matrices("pseudo-inertia", pseudo, 4, 4)))

    @classmethod
    def from_log_cholesky(cls, theta: ArrayLike) -> InertialParameters:
        """Return the body of log-Cholesky coordinates (..., 10); always consistent."""
        return cls(forms.from_log_cholesky(check.vectors("log-Cholesky coordinates", theta, 10)))

    @classmethod
    def from_point_masses(cls, masses: ArrayLike, points: ArrayLike) -> InertialParameters:
        """Return the body of point masses (n,) [kg] at points (n, 3) [m]."""
        m, p = check.vectors("masses", masses, np.size(masses)), check.vectors("points", points)
        homogeneous = np.column_stack([p, np.ones(len(p))])
        return cls.from_pseudo_inertia(np.einsum("n,ni,nj->ij", m, homogeneous, homogeneous))

    @property
    def mass(self) -> Array:
        """Mass (...) [kg]."""
        return self.vector[..., 0]

    @property
    def first_moment(self) -> Array:
        """First moment of mass h = m c (..., 3) [kg m]."""
        return self.vector[..., 1:4]

    @property
    def com(self) -> Array:
        """Centre of mass (..., 3) [m]; NaN where the mass is zero."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(self.first_moment / self.mass[..., None])

    @property
    def inertia(self) -> Array:
        """Inertia about the frame origin (..., 3, 3) [kg m^2]."""
        return forms.inertia_matrix(self.vector)

    @property
    def inertia_com(self) -> Array:
        """Inertia about the centre of mass in the axes of the frame (..., 3, 3) [kg m^2]."""
        k = cross_matrix(self.com)
        return np.asarray(self.inertia + self.mass[..., None, None] * (k @ k))

    @property
    def pseudo_inertia(self) -> Array:
        """Pseudo-inertia (..., 4, 4)."""
        return forms.pseudo_inertia(self.vector)

    def log_cholesky(self) -> Array:
        """Return log-Cholesky coordinates (..., 10); raises BadValue where the body is not consistent."""
        self.require_consistent()
        return forms.log_cholesky(self.pseudo_inertia)

    def principal(self) -> tuple[Array, Pose]:
        """Return principal moments (..., 3), rising [kg m^2], and the pose of the principal frame.

        The frame sits at the centre of mass, is right-handed, and each axis has its largest component positive where
        handedness allows, so that the answer does not jump between runs.
        """
        moments, axes = np.linalg.eigh(self.inertia_com)
        biggest = np.take_along_axis(axes, np.abs(axes).argmax(-2)[..., None, :], -2)
        axes = axes * np.where(biggest < 0, -1.0, 1.0)
        axes[..., :, 2] *= np.sign(np.linalg.det(axes))[..., None]
        return moments, Pose(Rotation(axes), self.com)

    def in_frame(self, X_AB: Pose) -> InertialParameters:
        """Return the same body, given in B, seen from frame A."""
        return InertialParameters.from_pseudo_inertia(
            X_AB.matrix() @ self.pseudo_inertia @ np.swapaxes(X_AB.matrix(), -1, -2)
        )

    def __add__(self, other: InertialParameters) -> InertialParameters:
        """Join two bodies given in one frame (gripper + object)."""
        return InertialParameters(self.vector + other.vector)

    def __sub__(self, other: InertialParameters) -> InertialParameters:
        """Take a known body away (load - gripper); the result may be inconsistent, so check it."""
        return InertialParameters(self.vector - other.vector)

    def __getitem__(self, index: Any) -> InertialParameters:
        return InertialParameters(self.vector[index])

    def validity(self) -> ValidityReport:
        """Say which laws of rigid bodies are broken, with the numbers (of the worst one in a batch)."""
        worst = min((self[i] for i in np.ndindex(*self.vector.shape[:-1])), key=_margin, default=self)
        return ValidityReport(tuple(_problems(worst)))

    def require_consistent(self) -> InertialParameters:
        """Return self, or raise BadValue with the validity report."""
        report = self.validity()
        if not report.consistent:
            raise BadValue(f"These inertial parameters are not those of a rigid body: {report}.")
        return self


def _margin(body: InertialParameters) -> float:
    """Return the least eigenvalue of the pseudo-inertia relative to its largest."""
    values = np.linalg.eigvalsh(body.pseudo_inertia)
    return float(values[0] / max(abs(values[-1]), 1e-300))


def _problems(body: InertialParameters) -> list[str]:
    """List the laws that one body breaks."""
    mass = float(body.mass)
    if mass <= 0:
        return [f"mass must be above zero, it is {mass:.6g} kg"]
    moments = np.linalg.eigvalsh(body.inertia_com)
    shown = ", ".join(f"{m:.6g}" for m in moments)
    if moments[0] <= 0:
        return [f"principal moments must be above zero, they are {shown} kg m^2"]
    if moments[0] + moments[1] <= moments[2]:
        return [
            "the triangle inequality is broken: the largest principal moment must be below the sum of the "
            f"other two, they are {shown} kg m^2 ({moments[2]:.6g} >= {moments[0] + moments[1]:.6g})"
        ]
    return []
