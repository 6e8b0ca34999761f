"""How rotations are commonly misread, and what undoes each mistake.

Only matrices are left of what a file said; the numbers as they were read can be had back from them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array, Integers, Mask
from steelyard.findings import Finding
from steelyard.logs.two_states import cheapest_path
from steelyard.spatial import Rotation

# Half a turn [rad], but for rounding: no rotation vector is longer, no roll or yaw. One that is costs so many leaps.
LONGEST, TOO_LONG = np.pi + 0.01, 3.0
# A leap between rows is so many times the step [rad] that few exceed, and so much beyond.
LEAP, LEAST_LEAP = 5.0, np.radians(1.0)


@dataclass(frozen=True)
class Misread:
    """A mistake: the code and words of what is wrong, what to do, and what turns matrices (N, 3, 3) into those meant.

    `right` returns None where these matrices cannot come from this mistake. `whole`: positions beside them are of the
    other way round, too.
    """

    code: str
    words: str
    remedy: str | None
    right: Callable[[Array], Array | None]
    whole: bool = False

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

    Two triples of angles give every matrix. A vector is written no longer than half a turn; where both are, the rows
    before and after tell: what is no vector's leaps where an angle goes round. The shorter is taken where both do well.
    """
    near = _angles(rotation)
    far = near - np.copysign(np.pi, near)
    far[:, 1] = np.copysign(np.pi, near[:, 1]) - near[:, 1]
    vectors = np.stack([near, far], 1)
    length = np.linalg.norm(vectors, axis=2)
    return _likelier(Rotation.exp(vectors).matrix, length, length > LONGEST)


def _rpy(rotation: Array) -> Array:
    """Undo roll, pitch, yaw read as a rotation vector: three angles may be longer than half a turn, a pitch no quarter.

    Beyond half a turn the vector of a matrix is the other way round, and what it lacks of a whole turn longer.
    """
    near = Rotation.nearest(rotation).log()
    length = np.linalg.norm(near, axis=1, keepdims=True)
    far = near - 2 * np.pi * near / np.maximum(length, np.finfo(np.float64).tiny)
    angles = np.stack([near, far], 1)
    beyond = (np.abs(angles) > [LONGEST, LONGEST - np.pi / 2, LONGEST]).any(2)
    return _likelier(Rotation.from_rpy(angles).matrix, np.linalg.norm(angles, axis=2), beyond)


def _likelier(meant: Array, length: Array, beyond: Mask) -> Array:
    """Return of two rotations of each row (N, 2, 3, 3) the likelier: rows leap little, and few numbers are `beyond`.

    length  (N, 2) [rad] of the numbers that each is written in: what they cost of all rows together is below a leap
    """
    cost = TOO_LONG * beyond + 0.1 * length / (np.pi * max(len(length), 1))
    return np.asarray(meant[np.arange(len(meant)), _smoothest(meant, cost)])


def _smoothest(rotation: Array, cost: Array) -> Integers:
    """Return which of two rotations to take of each row (N, 2, 3, 3), so that few leap: the cheapest path (N,).

    cost  (N, 2) of taking one, where a leap costs one
    """
    rows = len(rotation)
    traces = np.einsum("naij,nbij->nab", rotation[:-1], rotation[1:])
    steps = np.arccos(np.clip((traces - 1) / 2, -1.0, 1.0))
    least = steps.reshape(-1, 4).min(1)
    leaps = steps > LEAP * np.quantile(least, 0.9) + LEAST_LEAP if rows > 1 else steps > np.inf
    return cheapest_path(leaps.astype(np.float64), cost)


def _angles(rotation: Array) -> Array:
    return Rotation.nearest(rotation).rpy()


TURNED_ROUND = Misread("gravity-frame", "rotation turns W into S, not S into W", None, lambda R: np.swapaxes(R, 1, 2))
# The same of a pose: its position is that of the origin of W in S.
INVERTED = replace(
    TURNED_ROUND,
    words="poses are of W in S, not of S in W: rotations and positions",
    remedy="Give the inverse of each pose, that of the sensor in the world.",
    whole=True,
)
MISREAD = (
    TURNED_ROUND,
    Misread(
        "quaternion-order",
        "the four numbers of each quaternion are in the order x, y, z, w, not w, x, y, z as was said or assumed",
        None,
        lambda R: rolled(R, 1),
    ),
    Misread(
        "quaternion-order",
        "the four numbers of each quaternion are in the order w, x, y, z, not x, y, z, w as was said or assumed",
        None,
        lambda R: rolled(R, -1),
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
        "the three numbers of the rotation are roll, pitch, yaw, not a rotation vector",
        'Set form = "rpy" in the rotation of this stream.',
        _rpy,
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
