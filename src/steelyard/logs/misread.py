"""How rotations are commonly misread, and what undoes each mistake.

Only matrices are left of what a file said; the numbers as they were read can be had back from them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding
from steelyard.spatial import Rotation


@dataclass(frozen=True)
class Misread:
    """A mistake: the code and words of what is wrong, what to do, and what turns matrices (N, 3, 3) into those meant.

    `right` returns None where these matrices cannot come from this mistake.
    """

    code: str
    words: str
    remedy: str | None
    right: Callable[[Array], Array | None]

    def finding(self, message: str) -> Finding:
        """Return the finding with the remedy of this mistake."""
        return Finding.of(self.code, message) if self.remedy is None else Finding(self.code, message, self.remedy)


def rolled(rotation: Array, places: int) -> Array:
    """Return rotations (N, 3, 3) whose quaternions had their four numbers read `places` further on."""
    quaternion = Rotation.nearest(rotation).quaternion_wxyz()
    return Rotation.from_quaternion_wxyz(np.roll(quaternion, places, -1)).matrix


def _in_degrees(rotation: Array) -> Array | None:
    """Undo radians read as degrees: hardly any is then beyond pi degrees."""
    angles = _angles(rotation)
    if np.quantile(np.abs(angles), 0.99) > np.radians(1.01 * np.pi):
        return None
    return Rotation.from_rpy(np.degrees(angles)).matrix


def _vector_in_degrees(rotation: Array) -> Array | None:
    """Undo a rotation vector in radians read as degrees: hardly any is then longer than pi degrees."""
    vector = Rotation.nearest(rotation).log()
    if np.quantile(np.linalg.norm(vector, axis=1), 0.99) > np.radians(1.01 * np.pi):
        return None
    return Rotation.exp(np.degrees(vector)).matrix


def _vector(rotation: Array) -> Array:
    """Undo a rotation vector read as roll, pitch, yaw.

    Two triples of angles give every matrix; a vector is written no longer than half a turn, so the shorter was.
    """
    near = _angles(rotation)
    far = near - np.copysign(np.pi, near)
    far[:, 1] = np.copysign(np.pi, near[:, 1]) - near[:, 1]
    shorter = np.linalg.norm(near, axis=1) <= np.linalg.norm(far, axis=1)
    return Rotation.exp(np.where(shorter[:, None], near, far)).matrix


def _angles(rotation: Array) -> Array:
    return Rotation.nearest(rotation).rpy()


MISREAD = (
    Misread("gravity-frame", "rotation turns W into S, not S into W", None, lambda R: np.swapaxes(R, 1, 2)),
    *(
        Misread(
            "quaternion-order",
            f"the four numbers of each quaternion were read with {order}",
            None,
            lambda R, places=places: rolled(R, places),  # type: ignore[misc]
        )
        for places, order in ((-1, "w first where it is last"), (1, "w last where it is first"))
    ),
    Misread(
        "gravity-frame",
        "the angles of the rotation are in radians, not in degrees",
        'Set unit = "rad" in the rotation of this stream.',
        _in_degrees,
    ),
    Misread(
        "gravity-frame",
        "the numbers of the rotation are a rotation vector in radians, not in degrees",
        'Set form = "rotation-vector" and unit = "rad" in the rotation of this stream.',
        _vector_in_degrees,
    ),
    Misread(
        "gravity-frame",
        "the three numbers of the rotation are a rotation vector, not roll, pitch, yaw",
        'Set form = "rotation-vector" in the rotation of this stream.',
        _vector,
    ),
    Misread(
        "gravity-frame",
        "the three angles of the rotation are yaw, pitch, roll, as KUKA's A, B, C, not roll, pitch, yaw",
        'Name the columns the other way round: form = "rpy" is roll, pitch, yaw, so C, B, A.',
        lambda R: Rotation.from_rpy(_angles(R)[:, ::-1]).matrix,
    ),
    Misread(
        "gravity-frame",
        "the three angles turn about moving axes x, y, z, R = Rx Ry Rz, not about fixed ones, R = Rz Ry Rx",
        "Write the rotation as a quaternion or a matrix: no form has angles in this order.",
        lambda R: Rotation.from_rpy(-_angles(R)).inverse().matrix,
    ),
)
