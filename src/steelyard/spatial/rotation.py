"""Rotation: frozen, batch-first, a matrix inside.

Monograms as in Drake: `R_AB` turns coordinates in B into coordinates in A, and neighbouring letters cancel,
`R_AB @ R_BC = R_AC`. A log of N orientations is one Rotation with batch shape (N,).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from steelyard import check
from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.spatial.vectors import cross, cross_matrix

_SMALL_SINE = 1e-6  # below it 2 asin(s)/s is 2 to within 1e-12
_ZERO_NORM = 1e-12  # quaternions this short carry no direction
_EXACT = 1e-14  # what is a rotation to the last digits


@dataclass(frozen=True, eq=False)
class Rotation:
    """Rotations R_AB as matrices (..., 3, 3); raises BadValue where one is not orthonormal to 1e-6."""

    matrix: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "matrix", check.rotations("rotation matrix", self.matrix))

    @classmethod
    def trusted(cls, matrix: Array) -> Rotation:
        """Wrap a matrix that is a rotation by construction.

        Products of accepted rotations are not judged anew: their errors add up, and an input just within the
        tolerance must not fail later, far from where it came in.
        """
        rotation = object.__new__(cls)
        matrix = np.asarray(matrix, order="C")
        matrix.flags.writeable = False
        object.__setattr__(rotation, "matrix", matrix)
        return rotation

    @classmethod
    def identity(cls, *batch: int) -> Rotation:
        """Return the identity, repeated over the batch shape."""
        return cls.trusted(np.broadcast_to(np.eye(3), (*batch, 3, 3)))

    @classmethod
    def nearest(cls, matrix: ArrayLike) -> Rotation:
        """Return the rotation nearest to each (..., 3, 3) matrix in the Frobenius norm (SVD).

        Raises BadValue where no single rotation is nearest (rank one or zero, as in an empty row).
        """
        given = check.matrices("matrix", matrix)
        if _is_rotation(given):
            return cls.trusted(given)
        u, s, vt = np.linalg.svd(given)
        sign = np.linalg.det(u @ vt)
        loose = s[..., 1] + sign * s[..., 2] <= _ZERO_NORM * s[..., 0]
        if loose.any():
            raise BadValue(f"matrix must have one nearest rotation; {int(loose.sum())} of {loose.size} do not.")
        return cls._right_handed(u, vt, sign)

    @classmethod
    def aligning(cls, match: ArrayLike) -> Rotation:
        """Return R_AB that turns vectors b in B onto the same ones a in A best: it minimises sum |a - R_AB b|^2.

        match  (..., 3, 3), sum of a b^T over the pairs; its scale does not matter

        Vectors in one plane are enough: handedness completes rank two. Where they are about one axis (rank one, or
        zero) many rotations do as well and one of them is returned without a word, as where two singular values tie
        under a reflection; `nearest` refuses these. Source: Wahba 1965, by singular values (Kabsch 1976).
        """
        u, _, vt = np.linalg.svd(check.matrices("match", match))
        return cls._right_handed(u, vt, np.linalg.det(u @ vt))

    @classmethod
    def _right_handed(cls, u: Array, vt: Array, sign: Array) -> Rotation:
        """Return u vt, its least singular direction turned where `sign`, the determinant, is -1."""
        u[..., :, 2] *= sign[..., None]
        return cls.trusted(u @ vt)

    @classmethod
    def from_quaternion_wxyz(cls, quaternion: ArrayLike) -> Rotation:
        """Return rotations from quaternions (..., 4), scalar first; any length but zero is accepted."""
        q = check.vectors("quaternion", quaternion, 4)
        norm = np.linalg.norm(q, axis=-1, keepdims=True)
        zero = norm < _ZERO_NORM
        if zero.any():
            raise BadValue(f"quaternion must not be zero; {int(zero.sum())} of {zero.size} have norm zero.")
        w, x, y, z = np.moveaxis(q / norm, -1, 0)
        rows = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
        return cls.trusted(np.moveaxis(np.array(rows), (0, 1), (-2, -1)))

    @classmethod
    def from_quaternion_xyzw(cls, quaternion: ArrayLike) -> Rotation:
        """Return rotations from quaternions (..., 4), scalar last (ROS, SciPy)."""
        return cls.from_quaternion_wxyz(np.roll(check.vectors("quaternion", quaternion, 4), 1, axis=-1))

    @classmethod
    def from_rpy(cls, rpy: ArrayLike) -> Rotation:
        """Return R = Rz(yaw) Ry(pitch) Rx(roll) from (..., 3) roll, pitch, yaw [rad] (URDF, ROS)."""
        about = check.vectors("rpy", rpy)[..., None] * np.eye(3)  # one rotation vector per axis
        return cls.exp(about[..., 2, :]) @ cls.exp(about[..., 1, :]) @ cls.exp(about[..., 0, :])

    @classmethod
    def from_zyz(cls, angles: ArrayLike) -> Rotation:
        """Return R = Rz(a) Ry(b) Rz(c) from (..., 3) a, b, c [rad] (Doosan, Kawasaki)."""
        about = check.vectors("zyz", angles)
        z, y = np.eye(3)[2], np.eye(3)[1]
        return cls.exp(about[..., :1] * z) @ cls.exp(about[..., 1:2] * y) @ cls.exp(about[..., 2:] * z)

    @classmethod
    def exp(cls, vector: ArrayLike) -> Rotation:
        """Return rotations about `vector` (..., 3) by its length [rad].

        R = 1 + sinc(t) [v]x + sinc(t/2)^2 / 2 [v]x [v]x with t = |v| (Rodrigues; the half angle keeps the
        digits that 1 - cos t loses near zero).
        """
        v = check.vectors("rotation vector", vector)
        turns = np.linalg.norm(v, axis=-1)[..., None, None] / np.pi
        k = cross_matrix(v)
        return cls.trusted(np.eye(3) + np.sinc(turns) * k + 0.5 * np.sinc(turns / 2) ** 2 * (k @ k))

    def log(self) -> Array:
        """Return rotation vectors (..., 3) [rad], length at most pi."""
        q = self.quaternion_wxyz()
        w, v = q[..., 0], q[..., 1:]
        sine = np.linalg.norm(v, axis=-1)
        small = sine < _SMALL_SINE
        scale = np.where(small, 2.0, 2 * np.arctan2(sine, w) / np.where(small, 1.0, sine))
        return np.asarray(scale[..., None] * v)

    def rpy(self) -> Array:
        """Return roll, pitch, yaw (..., 3) [rad], pitch within a quarter turn: R = Rz(yaw) Ry(pitch) Rx(roll)."""
        m = self.matrix
        level = np.hypot(m[..., 2, 1], m[..., 2, 2])
        roll, yaw = np.arctan2(m[..., 2, 1], m[..., 2, 2]), np.arctan2(m[..., 1, 0], m[..., 0, 0])
        return np.stack([roll, np.arctan2(-m[..., 2, 0], level), yaw], -1)

    def quaternion_wxyz(self) -> Array:
        """Return unit quaternions (..., 4), scalar first and never negative."""
        diagonal = np.einsum("...ii->...i", self.matrix)
        trace = diagonal.sum(-1, keepdims=True)
        squares = 1 + np.concatenate([trace, 2 * diagonal - trace], -1)
        biggest = np.argmax(squares, -1)[..., None, None]
        row = np.take_along_axis(_quaternion_products(self.matrix, squares), biggest, -2)[..., 0, :]
        q = row / np.linalg.norm(row, axis=-1, keepdims=True)
        return np.asarray(np.where(q[..., :1] < 0, -q, q))

    @classmethod
    def joined(cls, parts: Sequence[Rotation], axis: int = 0) -> Rotation:
        """Return rotations one after the other along an axis of the batch, `axis` counted from the front."""
        return cls.trusted(np.concatenate([part.matrix for part in parts], axis=axis))

    def inverse(self) -> Rotation:
        """Return R_BA."""
        return Rotation.trusted(np.swapaxes(self.matrix, -1, -2))

    def apply(self, vector: ArrayLike) -> Array:
        """Return vectors (..., 3) given in B expressed in A; the batch shapes broadcast."""
        return self.turned(check.vectors("vector", vector))

    def turned(self, vector: Array) -> Array:
        """Return what `apply` does of vectors (..., 3) that are known to be finite: they are not judged anew."""
        return np.asarray(np.einsum("...ij,...j->...i", self.matrix, vector))

    def angle(self) -> Array:
        """Return the rotation angle (...) [rad], 0 to pi."""
        return np.asarray(np.linalg.norm(self.log(), axis=-1))

    def __matmul__(self, other: Rotation) -> Rotation:
        if not isinstance(other, Rotation):
            return NotImplemented
        return Rotation.trusted(self.matrix @ other.matrix)

    def __getitem__(self, index: Any) -> Rotation:
        chosen = self.matrix[index]
        if chosen.shape[-2:] != (3, 3):
            raise BadValue(f"an index must choose among the batch {self.batch}; {index!r} cuts into the matrices.")
        return Rotation.trusted(chosen)

    @property
    def batch(self) -> tuple[int, ...]:
        """The batch shape."""
        return self.matrix.shape[:-2]


def _is_rotation(matrix: Array) -> bool:
    """Tell whether matrices (..., 3, 3) are rotations all, to the last digits: then a decomposition adds nothing."""
    x, y, z = np.moveaxis(matrix, -1, 0)
    square = np.swapaxes(matrix, -1, -2) @ matrix
    return bool((np.abs(square - np.eye(3)) < _EXACT).all() and (np.abs(cross(x, y) - z) < _EXACT).all())


def _quaternion_products(m: Array, squares: Array) -> Array:
    """Return the (..., 4, 4) outer products 4 q q^T, from which the best-conditioned row is taken."""
    outer = np.empty((*m.shape[:-2], 4, 4))
    for i in range(4):
        outer[..., i, i] = squares[..., i]
    for i, (j, k) in enumerate(((2, 1), (0, 2), (1, 0))):
        outer[..., 0, i + 1] = outer[..., i + 1, 0] = m[..., j, k] - m[..., k, j]
    for i, j in ((0, 1), (0, 2), (1, 2)):
        outer[..., i + 1, j + 1] = outer[..., j + 1, i + 1] = m[..., i, j] + m[..., j, i]
    return outer
