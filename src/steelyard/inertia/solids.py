"""Closed-form homogeneous solids, each about its own centroid with its own axes.

Every function takes sizes in metres and `density` in kg/m^3, all above zero (BadValue otherwise), and returns
InertialParameters. Place a solid elsewhere with `in_frame`, join solids with `+`, cut a hollow with `-`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from steelyard import check
from steelyard.errors import BadValue
from steelyard.inertia.parameters import InertialParameters


def _from_second_moment(mass: float, per_mass: tuple[float, float, float]) -> InertialParameters:
    """Return the body with second moment of mass diag(per_mass) * mass about its centroid."""
    return InertialParameters.from_pseudo_inertia(mass * np.diag([*per_mass, 1.0]))


def box(x: float, y: float, z: float, density: float) -> InertialParameters:
    """Return a box with edges x, y, z."""
    x, y, z = (check.positive(f"box edge {n}", v) for n, v in zip("xyz", (x, y, z), strict=True))
    mass = check.positive("density", density) * x * y * z
    return _from_second_moment(mass, (x * x / 12, y * y / 12, z * z / 12))


def ellipsoid(a: float, b: float, c: float, density: float) -> InertialParameters:
    """Return an ellipsoid with semi-axes a, b, c along x, y, z."""
    a, b, c = (check.positive(f"semi-axis {n}", v) for n, v in zip("abc", (a, b, c), strict=True))
    mass = check.positive("density", density) * 4 / 3 * np.pi * a * b * c
    return _from_second_moment(mass, (a * a / 5, b * b / 5, c * c / 5))


def sphere(radius: float, density: float) -> InertialParameters:
    """Return a ball."""
    return ellipsoid(radius, radius, radius, density)


def cylinder(radius: float, length: float, density: float) -> InertialParameters:
    """Return a cylinder with its axis along z."""
    r, length = check.positive("radius", radius), check.positive("length", length)
    mass = check.positive("density", density) * np.pi * r * r * length
    return _from_second_moment(mass, (r * r / 4, r * r / 4, length * length / 12))


def tube(outer: float, inner: float, length: float, density: float) -> InertialParameters:
    """Return a tube with its axis along z, between the radii `inner` < `outer`."""
    if not inner < outer:
        raise BadValue(f"inner radius must be below the outer one; got {inner:g} and {outer:g} m.")
    return cylinder(outer, length, density) - cylinder(inner, length, density)


def cone(radius: float, height: float, density: float) -> InertialParameters:
    """Return a cone with its axis along z and apex at +z, about its centroid (height/4 above the base)."""
    r, height = check.positive("radius", radius), check.positive("height", height)
    mass = check.positive("density", density) * np.pi * r * r * height / 3
    return _from_second_moment(mass, (3 * r * r / 20, 3 * r * r / 20, 3 * height * height / 80))


def capsule(radius: float, length: float, density: float) -> InertialParameters:
    """Return a cylinder of `length` along z with half balls on both ends (2 * radius longer in all)."""
    r, length = check.positive("radius", radius), check.positive("length", length)
    density = check.positive("density", density)
    tube_mass, ball_mass = np.pi * r * r * length * density, 4 / 3 * np.pi * r**3 * density
    across = tube_mass * r * r / 4 + ball_mass * r * r / 5
    # A half ball's second moment about its flat centre is that of the ball; its centroid is 3r/8 above it.
    along = tube_mass * length**2 / 12 + ball_mass * (r * r / 5 + length * length / 4 + 3 * r * length / 8)
    mass = tube_mass + ball_mass
    return _from_second_moment(mass, (across / mass, across / mass, along / mass))


def tetrahedron(vertices: ArrayLike, density: float) -> InertialParameters:
    """Return the tetrahedron with `vertices` (4, 3) [m] in any order, in the frame of these numbers.

    The second moment of mass is m/20 (sum v v^T + s s^T) with s the sum of the four vertices.
    """
    v = check.matrices("vertices", vertices, 4, 3)
    if v.ndim != 2:
        raise BadValue(f"vertices must have shape (4, 3); got {v.shape}.")
    volume = abs(float(np.linalg.det(v[1:] - v[0]))) / 6
    mass = check.positive("density", density) * check.positive("tetrahedron volume", volume)
    total = v.sum(0)
    second = mass / 20 * (v.T @ v + np.outer(total, total))
    first = mass / 4 * total[:, None]
    return InertialParameters.from_pseudo_inertia(np.block([[second, first], [first.T, np.array([[mass]])]]))
