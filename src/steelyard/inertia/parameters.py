"""InertialParameters: mass, centre of mass and inertia of a rigid body in a named frame's axes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from steelyard import check
from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.inertia import forms, validity
from steelyard.inertia.regressor import newton_euler
from steelyard.inertia.validity import ValidityReport
from steelyard.spatial import Pose, Rotation, Wrench


@dataclass(frozen=True, eq=False)
class InertialParameters:
    """Ten parameters (..., 10) about the frame origin: m, h (3), I xx xy xz yy yz zz (see `forms`).

    Any finite numbers are accepted: `validity()` judges them, `require_consistent()` refuses bad ones.
    """

    vector: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "vector", check.vectors("inertial parameters", self.vector, 10))

    @classmethod
    def from_com(cls, mass: ArrayLike, com: ArrayLike, inertia_com: ArrayLike) -> InertialParameters:
        """Return the body with the values people read; the batch shapes broadcast.

        mass         (...) [kg]
        com          (..., 3) centre of mass in the frame [m]
        inertia_com  (..., 3, 3) about the centre of mass in the frame's axes [kg m^2], symmetric

        Raises BadValue where they are not finite, not symmetric or do not broadcast; the body need not be consistent.
        """
        m = check.finite("mass", mass)[..., None]
        c = check.vectors("centre of mass", com)
        central = _symmetric("inertia about the centre of mass", inertia_com)
        try:
            batch = np.broadcast_shapes(m.shape[:-1], c.shape[:-1], central.shape[:-2])
        except ValueError:
            raise BadValue(
                "mass, centre of mass and inertia must have batch shapes that broadcast; "
                f"got {m.shape[:-1]}, {c.shape[:-1]} and {central.shape[:-2]}."
            ) from None
        phi = np.empty((*batch, 10))
        phi[..., :1], phi[..., 1:4] = m, m * c
        phi[..., 4:] = forms.upper(central) + m * forms.upper(forms.point_inertia(c))
        return cls(phi)

    @classmethod
    def from_pseudo_inertia(cls, pseudo: ArrayLike) -> InertialParameters:
        """Return the body of the symmetric pseudo-inertia (..., 4, 4) [kg m^2, kg m, kg]."""
        return cls(forms.from_pseudo_inertia(_symmetric("pseudo-inertia", pseudo, 4)))

    @classmethod
    def from_log_cholesky(cls, theta: ArrayLike) -> InertialParameters:
        """Return the body of log-Cholesky coordinates (..., 10); always consistent."""
        return cls(forms.from_log_cholesky(check.vectors("log-Cholesky coordinates", theta, 10)))

    @classmethod
    def from_point_masses(cls, masses: ArrayLike, points: ArrayLike) -> InertialParameters:
        """Return the body of point masses (n,) [kg] at points (n, 3) [m] in the frame; raises BadValue."""
        m, p = check.finite("masses", masses), check.vectors("points", points)
        if m.ndim != 1 or p.shape != (*m.shape, 3):
            raise BadValue(f"masses and points must have shapes (n,) and (n, 3); got {m.shape} and {p.shape}.")
        homogeneous = np.column_stack([p, np.ones(len(p))])
        return cls(forms.from_pseudo_inertia((m * homogeneous.T) @ homogeneous))

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
        """Centre of mass (..., 3) in the frame [m]; NaN where the mass is zero."""
        return forms.com(self.vector)

    @property
    def inertia(self) -> Array:
        """Inertia about the frame origin (..., 3, 3) [kg m^2]."""
        return forms.inertia_matrix(self.vector)

    @property
    def inertia_com(self) -> Array:
        """Inertia about the centre of mass (..., 3, 3) [kg m^2] in the frame's axes; NaN for mass zero."""
        return forms.inertia_com(self.vector)

    @property
    def people(self) -> Array:
        """The numbers people read (..., 10): mass [kg], com [m], inertia about it xx xy xz yy yz zz [kg m^2]."""
        return forms.people(self.vector)

    @property
    def pseudo_inertia(self) -> Array:
        """Pseudo-inertia (..., 4, 4)."""
        return forms.pseudo_inertia(self.vector)

    def log_cholesky(self) -> Array:
        """Return log-Cholesky coordinates (..., 10); raises BadValue where the body is not consistent."""
        self.require_consistent()
        try:
            return forms.log_cholesky(self.pseudo_inertia)
        except np.linalg.LinAlgError:
            raise BadValue(
                "This body is flat to the last digit: its pseudo-inertia is not positive definite, "
                "so it has no log-Cholesky coordinates."
            ) from None

    def principal(self) -> tuple[Array, Pose]:
        """Return principal moments (..., 3), rising [kg m^2], and the principal frame's pose in this one.

        The frame sits at the centre of mass, is right-handed, and each axis has its largest component
        positive where handedness allows, so that the answer does not jump between runs. Axes of equal moments
        are arbitrary.
        Raises BadValue where the mass is zero.
        """
        if (self.mass == 0).any():
            raise BadValue("A body of mass zero has no centre of mass and so no principal frame.")
        moments, axes = np.linalg.eigh(self.inertia_com)
        biggest = np.take_along_axis(axes, np.abs(axes).argmax(-2)[..., None, :], -2)
        axes = axes * np.where(biggest < 0, -1.0, 1.0)
        axes[..., :, 2] *= np.sign(np.linalg.det(axes))[..., None]
        return moments, Pose(Rotation(axes), self.com)

    def wrench(
        self, gravity: ArrayLike, acceleration: ArrayLike = (0, 0, 0), angular_velocity: ArrayLike = (0, 0, 0),
        angular_acceleration: ArrayLike = (0, 0, 0),
    ) -> Wrench:  # fmt: skip
        """Return what a robot must apply to the body in a motion, about the frame's origin; at rest with gravity alone.

        All in the frame's axes, batches broadcast:
        gravity               (..., 3) [m/s^2], pointing down
        acceleration          (..., 3) [m/s^2] classical, of the frame's origin, gravity not included
        angular_velocity      (..., 3) [rad/s]
        angular_acceleration  (..., 3) [rad/s^2]

        A sensor shows its bias, too; one that reports the reaction shows the negative. Raises BadValue.
        """
        named = {"acceleration": acceleration, "gravity": gravity, "angular_velocity": angular_velocity}
        a, g, omega, alpha = (
            check.vectors(name, given)
            for name, given in (named | {"angular_acceleration": angular_acceleration}).items()
        )
        try:
            batch = np.broadcast_shapes(self.vector.shape[:-1], *(v.shape[:-1] for v in (a, g, omega, alpha)))
        except ValueError:
            raise BadValue(
                f"bodies and motion must have batch shapes that broadcast; got {self.vector.shape[:-1]} bodies and "
                f"{[v.shape for v in (g, a, omega, alpha)]}."
            ) from None
        felt, omega, alpha = (np.broadcast_to(v, (*batch, 3)) for v in (a - g, omega, alpha))
        return Wrench.from_array(newton_euler(self.vector, felt, omega, alpha))

    def in_frame(self, X_AB: Pose) -> InertialParameters:
        """Return the same body, given in B, seen from frame A: P_A = X P_B X^T."""
        X = X_AB.matrix()
        return InertialParameters(forms.from_pseudo_inertia(X @ self.pseudo_inertia @ np.swapaxes(X, -1, -2)))

    def __add__(self, other: InertialParameters) -> InertialParameters:
        """Join two bodies given in one frame (gripper + object)."""
        return InertialParameters(self.vector + other.vector)

    def __sub__(self, other: InertialParameters) -> InertialParameters:
        """Take a known body away (load - gripper); the result may be inconsistent, so check it."""
        return InertialParameters(self.vector - other.vector)

    def __getitem__(self, index: Any) -> InertialParameters:
        return InertialParameters(self.vector[index])

    def validity(self) -> ValidityReport:
        """Say which law of rigid bodies is broken, with the numbers (of the worst body in a batch)."""
        return validity.report(self.vector)

    def require_consistent(self) -> InertialParameters:
        """Return self, or raise BadValue with the validity report."""
        report = self.validity()
        if not report.consistent:
            raise BadValue(f"These inertial parameters are not those of a rigid body: {report}.")
        return self


def _symmetric(name: str, matrix: ArrayLike, size: int = 3) -> Array:
    """Return symmetric matrices (..., size, size), or say by how much they differ from their transpose."""
    array = check.matrices(name, matrix, size, size)
    asymmetry = np.abs(array - np.swapaxes(array, -1, -2)).max(initial=0.0)
    if asymmetry > 1e-9 * np.abs(array).max(initial=0.0):
        raise BadValue(f"{name} must be symmetric; it differs from its transpose by {asymmetry:.3g}.")
    return array


def frame_change(X_AB: Pose) -> Array:
    """Return the map (10, 10) from the ten parameters of a body seen from B to those seen from A."""
    return np.asarray(InertialParameters(np.eye(10)).in_frame(X_AB).vector.T)
