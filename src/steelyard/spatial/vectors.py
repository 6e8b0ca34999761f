"""Vectors, batch-first: products, areas and sums of them; Twist, Acceleration and Wrench, the angular part first."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations, product
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from steelyard import check
from steelyard.check import Array, Integers
from steelyard.errors import BadValue


def cross(a: Array, b: Array) -> Array:
    """Return a x b (..., 3) of broadcast shapes; np.cross at a fifth of its overhead."""
    a0, a1, a2 = a[..., 0], a[..., 1], a[..., 2]
    b0, b1, b2 = b[..., 0], b[..., 1], b[..., 2]
    first = a1 * b2 - a2 * b1
    out = np.empty((*first.shape, 3), first.dtype)
    out[..., 0], out[..., 1], out[..., 2] = first, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0
    return out


def lever_acceleration(omega: Array, alpha: Array, p: Array) -> Array:
    """Return alpha x p + omega x (omega x p): how much more a body's point at p (..., 3) accelerates than its origin.

    omega [rad/s], alpha [rad/s^2] and p [m] are of broadcast shapes (..., 3) and in the same axes.
    """
    return np.asarray(cross(alpha, p) + cross(omega, cross(omega, p)))


def lever_matrix(omega: Array, alpha: Array) -> Array:
    """Return [alpha]x + [omega]x [omega]x (N, 3, 3): what turning adds to the acceleration of a point per metre."""
    across = cross_matrix(omega)
    return np.asarray(cross_matrix(alpha) + across @ across)


def classical_acceleration(derivative: Array, twist: Array) -> Array:
    """Return that of the origin (..., 3) [m/s^2] from the component-wise derivative (..., 6) of a body twist (..., 6).

    a = dv/dt + omega x v, all in body axes.
    Source: "Cooperative Payload Estimation by a Team of Mocobots", IV-B, differentiates the components;
    Newton-Euler about a point needs the classical acceleration.
    """
    return np.asarray(derivative[..., 3:] + cross(twist[..., :3], twist[..., 3:]))


def unit_vectors(vectors: Array) -> Array:
    """Return vectors (..., n) made one long; zero stays zero."""
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300))


def area_vectors(corners: Array) -> Array:
    """Return normals (..., 3) of triangles (..., 3, 3) as long as their area; from there they are counter-clockwise."""
    a = corners[..., 0, :]
    return cross(corners[..., 1, :] - a, corners[..., 2, :] - a) / 2


def summed(group: Integers, vectors: Array | np.ndarray[Any, np.dtype[np.uint8]], count: int = 0) -> Array:
    """Return the sums (G, n) of vectors (N, n) over the groups 0..G-1 of `group` (N,); at least `count` groups."""
    return np.stack([np.bincount(group, vectors[:, k], count) for k in range(vectors.shape[1])], axis=1)


def cross_matrix(vector: ArrayLike) -> Array:
    """Return [v]x of shape (..., 3, 3), so that [v]x u = v x u."""
    v = np.asarray(vector, dtype=np.float64)
    out = np.zeros((*v.shape[:-1], 3, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    out[..., 1, 0], out[..., 2, 0], out[..., 2, 1] = v[..., 2], -v[..., 1], v[..., 0]
    return out


def signed_axes() -> Array:
    """Return every order and sign of three axes (48, 3, 3), first as they are: 24 rotations, 24 reflections."""
    orders, signs = permutations(range(3)), tuple(product((1.0, -1.0), repeat=3))
    return np.stack([np.eye(3)[list(order)] * np.array(sign) for order in orders for sign in signs])


def signed_columns(axes: Array, letter: str = "") -> list[str]:
    """Return which of three columns, with its sign, each row of `signed_axes` takes: "-y", or "-Fy" with a letter."""
    largest = np.abs(axes).argmax(1)
    return [f"{'-' if axes[i, k] < 0 else ''}{letter}{'xyz'[k]}" for i, k in enumerate(largest)]


def axial_vector(matrix: Array) -> Array:
    """Return the vector (3,) of which [v]x is M - M^T, of a matrix M (3, 3): of a rotation, 2 sin(angle) axis."""
    return np.array([matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]])


@dataclass(frozen=True, eq=False)
class _SixVector:
    """Two three-vectors of one batch shape; only vectors of one kind add."""

    _first: Array
    _second: Array

    def __post_init__(self) -> None:
        name = type(self).__name__.lower()
        first = check.vectors(f"{name} (first part)", self._first)
        second = check.vectors(f"{name} (second part)", self._second)
        if first.shape != second.shape:
            raise BadValue(f"{name}: both parts must have one shape; got {first.shape} and {second.shape}.")
        object.__setattr__(self, "_first", first)
        object.__setattr__(self, "_second", second)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._first!r}, {self._second!r})"

    @classmethod
    def from_array(cls, array: ArrayLike) -> Self:
        """Return the value from (..., 6), angular part first."""
        a = check.vectors(cls.__name__.lower(), array, 6)
        return cls(a[..., :3], a[..., 3:])

    def array(self) -> Array:
        """Return (..., 6), angular part first."""
        return np.concatenate([self._first, self._second], axis=-1)

    def __add__(self, other: Self) -> Self:
        if type(other) is not type(self):
            return NotImplemented
        return type(self)(self._first + other._first, self._second + other._second)

    def __neg__(self) -> Self:
        return type(self)(-self._first, -self._second)

    def __getitem__(self, index: Any) -> Self:
        return type(self)(self._first[index], self._second[index])

    @property
    def batch(self) -> tuple[int, ...]:
        """The batch shape."""
        return self._first.shape[:-1]


class Twist(_SixVector):
    """Angular velocity [rad/s] and velocity of the frame origin [m/s], each (..., 3) in the frame's axes."""

    @property
    def angular(self) -> Array:
        """Angular velocity (..., 3) [rad/s]."""
        return self._first

    @property
    def linear(self) -> Array:
        """Velocity of the frame origin (..., 3) [m/s]."""
        return self._second


class Acceleration(_SixVector):
    """Angular acceleration [rad/s^2] and classical acceleration of the frame origin [m/s^2], each (..., 3).

    Gravity is not included: a sensor at rest has zero.
    """

    @property
    def angular(self) -> Array:
        """Angular acceleration (..., 3) [rad/s^2]."""
        return self._first

    @property
    def linear(self) -> Array:
        """Classical acceleration of the frame origin (..., 3) [m/s^2]."""
        return self._second

    @classmethod
    def from_twist_derivative(cls, derivative: ArrayLike, twist: Twist) -> Acceleration:
        """Return the classical acceleration from the component-wise derivative (..., 6) of a body twist."""
        d = check.vectors("twist derivative", derivative, 6)
        return cls(d[..., :3], classical_acceleration(d, twist.array()))


class Wrench(_SixVector):
    """Moment about the frame origin [N m] and force [N] (..., 3) that the robot applies to the object."""

    @property
    def torque(self) -> Array:
        """Moment about the frame origin (..., 3) [N m]."""
        return self._first

    @property
    def force(self) -> Array:
        """Force (..., 3) [N]."""
        return self._second
