"""Grasp kinematics: the pose of one robot's grasp in another's from the twists of both.

The twists of one rigid body obey V_i = Ad(T_ij) V_j, that is w_i = R w_j and v_i = R v_j + p x (R w_j).
Source: "Cooperative Payload Estimation by a Team of Mocobots", III-B1 and III-B2, eq. 1-8. It asks for three pairs and
a matrix of full rank; two directions of turning that are not parallel suffice, since the determinant fixes the third
axis.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from steelyard import check
from steelyard.check import Array, Mask
from steelyard.errors import CannotAnswer
from steelyard.spatial import Pose, Rotation, Twist, cross, cross_matrix

# Second singular value of the angular velocities over the first: below it they are about one axis.
ONE_AXIS = 1e-4


@dataclass(frozen=True, eq=False)
class Pair:
    """The pose X_ij of grasp j in grasp i, as one pair of robots tells it.

    covariance  (6, 6) of rotation vector in i's axes [rad] and position [m], formal: white residuals
    spread      singular values (3,) of the angular velocities that were used, over the first
    residual    (6,) rms per axis of V_i - Ad V_j [rad/s, m/s]
    samples     rows used
    """

    pose: Pose
    covariance: Array
    spread: Array
    residual: Array
    samples: int


def rotation(omega_i: Array, omega_j: Array) -> tuple[Rotation, Array]:
    """Return R_ij from angular velocities (T, 3) of both, and the singular values (3,) of sum w_i w_j^T (eq. 3-5).

    Raises CannotAnswer where all of them are about one axis.
    """
    omega_i = check.rows("omega_i", omega_i)
    omega_j = check.rows("omega_j", omega_j, of=("omega_i", omega_i))
    match = omega_i.T @ omega_j
    s = np.asarray(np.linalg.svd(match, compute_uv=False), np.float64)
    if not s[1] > ONE_AXIS**2 * s[0]:
        raise CannotAnswer(
            "the angular velocities must be about two axes or more to tell how one grasp is turned against another; "
            f"they are about one (second singular value {s[1]:.2g} of {s[0]:.2g}). Tilt the payload about another axis."
        )
    return Rotation.aligning(match), s


def position(twist_i: Array, twist_j: Array, turn: Rotation) -> tuple[Array, Array]:
    """Return p_ij (3,) [m] from body twists (T, 6) and R_ij, and its normal matrix (3, 3) [rad^2/s^2] (eq. 6-8).

    Raises CannotAnswer where all turning is about one axis.
    """
    twist_i, twist_j = _twists(twist_i, twist_j)
    turned = turn.apply(twist_j[:, :3])
    gap = twist_i[:, 3:] - turn.apply(twist_j[:, 3:])
    normal = (turned * turned).sum() * np.eye(3) - turned.T @ turned
    least, _, most = np.linalg.eigvalsh(normal)
    if not least > ONE_AXIS**2 * most:
        raise CannotAnswer(
            "the payload must turn about two axes or more to tell how far apart two grasps are; it turns about one. "
            "Tilt the payload about a second axis."
        )
    return np.linalg.solve(normal, cross(turned, gap).sum(0)), normal


def pair(twist_i: Array, twist_j: Array) -> Pair:
    """Return the pose of grasp j in grasp i from their body twists (T, 6), first the rotation, then the position.

    Raises CannotAnswer for fewer than three rows, or where all turning is about one axis.
    """
    twist_i, twist_j = _twists(twist_i, twist_j)
    if len(twist_i) < 3:
        raise CannotAnswer(f"two robots must share at least three rows with twists; they share {len(twist_i)}.")
    turn, singular = rotation(twist_i[:, :3], twist_j[:, :3])
    place, normal = position(twist_i, twist_j, turn)
    pose = Pose(turn, place)
    gap = twist_i - (pose @ Twist.from_array(twist_j)).array()
    variance = (gap**2).sum(0) / (len(gap) - 1)
    covariance = _covariance(turn, place, normal, twist_j, variance)
    return Pair(pose, covariance, np.sqrt(singular / singular[0]), np.sqrt(variance), len(gap))


def star(names: Sequence[str], twists: Array, measured: Mask, reference: str) -> dict[str, Pair]:
    """Return the pair of the reference with every other robot, by name.

    names     of the robots (N,)
    twists    (N, T, 6) at the grasps; measured (N, T) which rows are true
    Raises CannotAnswer, naming the robot, where a pair does not tell its pose.
    """
    found = {}
    hub = names.index(reference)
    for i, name in enumerate(names):
        if i == hub:
            continue
        rows = measured[hub] & measured[i]
        try:
            found[name] = pair(twists[hub, rows], twists[i, rows])
        except CannotAnswer as error:
            raise CannotAnswer(f"Grasp of '{name}' seen from '{reference}': {error}") from None
    return found


def from_star(names: Sequence[str], pairs: Mapping[str, Pair]) -> Pose:
    """Return the poses (N,) of all grasps in that of the reference, which has no pair: its own is the identity."""
    return Pose.stacked([pairs[name].pose if name in pairs else Pose.identity() for name in names])


def total_wrench(grasps: Pose, wrench: Array) -> Array:
    """Return the sum (T, 6) [N m, N] over the team of wrenches (N, T, 6) given at the grasps (N,), at R's origin."""
    turn, place = grasps.rotation.matrix, grasps.position
    force = np.einsum("nij,ntj->nti", turn, wrench[..., 3:])
    moment = np.einsum("nij,ntj->nti", turn, wrench[..., :3])
    levers = cross(np.broadcast_to(place[:, None], force.shape), force)
    return np.asarray(np.concatenate([moment + levers, force], -1).sum(0))


def _twists(twist_i: Array, twist_j: Array) -> tuple[Array, Array]:
    """Return the body twists of two robots, checked: (T, 6) each; raises BadValue."""
    twist_i = check.rows("twist_i", twist_i, 6)
    return twist_i, check.rows("twist_j", twist_j, 6, of=("twist_i", twist_i))


def _covariance(turn: Rotation, place: Array, normal: Array, twist_j: Array, variance: Array) -> Array:
    """Return the formal covariance (6, 6) of a pair: white residuals, equal on the three axes of each kind.

    With q = R w_j and u = R v_j, an error e of the rotation moves the position by N^-1 sum [q]([u] + [p][q]) e.
    """
    q, u = turn.apply(twist_j[:, :3]), turn.apply(twist_j[:, 3:])
    products = u.T @ q - (q * u).sum() * np.eye(3) - cross_matrix(q.T @ (q @ place))
    inverse = np.linalg.inv(normal)
    lever = inverse @ products
    turned = float(variance[:3].mean()) * inverse
    shared = lever @ turned
    moved = shared @ lever.T + float(variance[3:].mean()) * inverse
    return np.block([[turned, shared.T], [shared, moved]])
