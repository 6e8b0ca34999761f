"""A payload with its grasps, and what each grasp does and bears while the payload moves.

C is fixed to the payload (its first body, where there is a hinge) with the origin at that body's centre of mass; at
rest it is W.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from steelyard.check import Array, Mask
from steelyard.errors import BadValue
from steelyard.inertia import InertialParameters
from steelyard.simulate.motions import Kinematics, minimum_jerk, needed
from steelyard.simulate.team_cases import DOWN, MASS, MOMENTS, RING, RING_CENTRE, Slip
from steelyard.spatial import Pose, Rotation, Wrench, cross, cross_matrix

_UNBORNE = 1e-8  # of the wrench asked for: more is not rounding


@dataclass(frozen=True, eq=False)
class TeamPayload:
    """The first body in C, and the grasps X_CG (N,) at rest."""

    body: InertialParameters
    grasps: Pose

    @classmethod
    def draw(cls, rng: np.random.Generator, robots: int) -> TeamPayload:
        """Return the payload and the ring of grasps that one seed draws."""
        axes = Rotation.exp(rng.normal(0.0, 0.2, 3)).matrix
        body = InertialParameters.from_com(MASS, np.zeros(3), axes @ np.diag(MOMENTS) @ axes.T)
        a = 2 * np.pi * np.arange(robots) / robots + 0.3
        ring = np.column_stack([RING[0] * np.cos(a), RING[1] * np.sin(a), rng.normal(0.0, 0.05, robots)])
        yaw, pitch, roll = a + rng.normal(0.0, 0.3, robots), *rng.normal(0.0, 0.1, (2, robots))
        turned = Rotation.from_rpy(np.column_stack([roll, pitch, yaw]))
        return cls(body, Pose(turned, ring + np.array(RING_CENTRE)))


@dataclass(frozen=True, eq=False)
class Carried:
    """What happens at the grasps, in their own axes.

    rotation, position  poses X_WG (N, T, 3, 3), (N, T, 3) [m]
    twist, wrench       (N, T, 6)
    gravity             (N, T, 3) [m/s^2]
    """

    rotation: Array
    position: Array
    twist: Array
    wrench: Array
    gravity: Array

    def yielded(self, robot: int, stiffness: tuple[float, float]) -> tuple[Pose, Array]:
        """Return the poses (T,) and wrenches (T, 6) of one robot's gripper, where its grasp yields to what it pushes.

        stiffness  [N/m] and [N m/rad], the same along all axes of the grasp
        """
        wrench = Wrench.from_array(self.wrench[robot])
        off = Pose(Rotation.exp(wrench.torque / stiffness[1]), wrench.force / stiffness[0])
        pose = Pose(Rotation(self.rotation[robot]), self.position[robot]) @ off
        return pose, (off.inverse() @ wrench).array()


@dataclass(frozen=True, eq=False)
class Squeeze:
    """Sines of one amplitude [N] along every direction in which grasp forces balance each other."""

    amplitude: float
    rate: Array
    phase: Array

    @classmethod
    def draw(cls, rng: np.random.Generator, amplitude: float, columns: int) -> Squeeze:
        """Return sines of 0.1 to 0.5 Hz for up to `columns` directions."""
        return cls(amplitude, 2 * np.pi * rng.uniform(0.1, 0.5, columns), rng.uniform(0, 2 * np.pi, columns))

    def at(self, time: Array, directions: int) -> Array:
        """Return the sines (T, directions) at `time` (T,)."""
        return self.amplitude * np.sin(time[:, None] * self.rate[:directions] + self.phase[:directions])


@dataclass(frozen=True, eq=False)
class Load:
    """Where the grasps are and what they must bear at T times, in C axes.

    rotation, position  of the grasps in C (T or 1, N, 3, 3), (T or 1, N, 3)
    twist               of C's axes at each grasp (T, N, 6)
    maps                (T or 1, K, columns) from grasp forces, then the moments of six-axis wrists, to demands
    demand              (T, K)
    """

    rotation: Array
    position: Array
    twist: Array
    maps: Array
    demand: Array

    def placed(self, motion: Kinematics) -> Array:
        """Return the places (T, N, 3) of the grasps in W [m], where C moves by `motion` (T,)."""
        position = np.broadcast_to(self.position, (len(motion.time), *self.position.shape[1:]))
        return np.asarray(motion.position[:, None] + np.einsum("tij,tnj->tni", motion.rotation.matrix, position))


def grasp_load(payload: TeamPayload, motion: Kinematics, six_axis: list[int], slip: Slip | None = None) -> Load:
    """Return what the grasps must do and bear along `motion` (T,) of C in W."""
    position, drift = _places(payload, motion.time, slip)
    omega = np.repeat(motion.angular_velocity[:, None], position.shape[1], 1)
    velocity = motion.velocity[:, None] + cross(omega, np.broadcast_to(position, omega.shape)) + drift
    twist = np.concatenate([omega, velocity], -1)
    maps = grasp_map(position, six_axis)
    return Load(payload.grasps.rotation.matrix[None], position, twist, maps, needed(payload.body, motion, DOWN))


def carry(
    loaded: Load,
    motion: Kinematics,
    time: Array,
    squeeze: Squeeze,
    holds: Mask,
    six_axis: list[int],
) -> Carried:
    """Return the grasps' motion and their wrenches: the least forces that carry the load, and the squeeze.

    holds  (T, N) which robots hold the payload
    Raises BadValue where those that hold it cannot bear the wrench it needs.
    """
    robots = holds.shape[1]
    forces = np.zeros((len(motion.time), loaded.maps.shape[2]))
    patterns, which = np.unique(holds, axis=0, return_inverse=True)
    for k, pattern in enumerate(patterns):
        rows = which.ravel() == k
        columns = np.concatenate([np.repeat(pattern, 3), np.repeat(pattern[six_axis], 3)])
        maps = loaded.maps[rows] if len(loaded.maps) > 1 else loaded.maps
        forces[np.ix_(rows, columns)] = _shared(maps[..., columns], loaded.demand[rows], squeeze, time[rows])
    wrench = np.zeros((len(forces), robots, 6))
    wrench[..., 3:] = forces[:, : 3 * robots].reshape(len(forces), robots, 3)
    wrench[:, six_axis, :3] = forces[:, 3 * robots :].reshape(len(forces), len(six_axis), 3)
    into = np.swapaxes(loaded.rotation, -1, -2)
    turned = motion.rotation.matrix[:, None] @ loaded.rotation
    placed = loaded.placed(motion)
    down = np.swapaxes(turned, -1, -2) @ DOWN
    parts = (turned, placed, _turned(into, loaded.twist), _turned(into, wrench), down)
    return Carried(*(np.ascontiguousarray(np.swapaxes(part, 0, 1)) for part in parts))


def _shared(maps: Array, demand: Array, squeeze: Squeeze, time: Array) -> Array:
    """Return forces (T, columns): minimum norm for the demand, plus the squeeze projected to where it balances."""
    inverse = np.asarray(np.linalg.pinv(maps), dtype=np.float64)
    forces = _each(inverse, demand)
    short = float(np.abs(_each(maps, forces) - demand).max(initial=0.0))
    if short > _UNBORNE * float(np.abs(demand).max(initial=0.0)):
        raise BadValue(
            f"these grasps must be able to bear the payload; they fall short by {short:.3g} (N or N m). Two passive "
            "gimbals bear no moment about the line that joins them: add a robot or a six-axis wrist."
        )
    directions = maps.shape[2] - int(np.linalg.matrix_rank(maps[0]))
    if directions == 0:
        return forces
    push = squeeze.at(time, directions) @ np.linalg.svd(maps[0])[2][-directions:]
    return np.asarray(forces + push - _each(inverse, _each(maps, push)))


def _each(matrix: Array, vector: Array) -> Array:
    """Return matrix (T or 1, k, n) times vector (T, n)."""
    return np.asarray(vector @ matrix[0].T if len(matrix) == 1 else np.einsum("tij,tj->ti", matrix, vector))


def _places(payload: TeamPayload, time: Array, slip: Slip | None) -> tuple[Array, Array]:
    """Return the grasps' places in C (T or 1, N, 3) and how fast they slip there, all in C axes."""
    places = payload.grasps.position[None]
    if slip is None:
        return places, np.zeros_like(places)
    value, slope, _ = minimum_jerk((time - slip.start) / slip.duration)
    change = payload.grasps.rotation.matrix[slip.robot] @ slip.change
    moved, drift = np.repeat(places, len(time), 0), np.zeros((len(time), *places.shape[1:]))
    moved[:, slip.robot] += value[:, None] * change
    drift[:, slip.robot] = slope[:, None] / slip.duration * change
    return moved, drift


def grasp_map(position: Array, six_axis: list[int]) -> Array:
    """Return (T or 1, 6, columns): moment about C's origin and force from grasp forces, then six-axis moments."""
    rows, robots = position.shape[:2]
    maps = np.zeros((rows, 6, 3 * (robots + len(six_axis))))
    maps[:, :3, : 3 * robots] = np.moveaxis(cross_matrix(position), 1, 2).reshape(rows, 3, 3 * robots)
    maps[:, 3:, : 3 * robots] = np.tile(np.eye(3), robots)
    maps[:, :3, 3 * robots :] = np.tile(np.eye(3), len(six_axis))
    return maps


def _turned(into: Array, six: Array) -> Array:
    """Return six-vectors (T, N, 6) with both parts turned by (T or 1, N, 3, 3)."""
    pairs = six.reshape(*six.shape[:-1], 2, 3)
    return np.asarray(np.einsum("...ij,...kj->...ki", into, pairs).reshape(six.shape))
