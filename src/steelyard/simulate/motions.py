"""Motions of S in W with exact derivatives: rest, stop-and-go between Euler keys, and finite Fourier series.

Rotations are extrinsic xyz Euler angles q = (roll, pitch, yaw), R_WS = Rz(yaw) Ry(pitch) Rx(roll). Every
derivative is in closed form; nothing is differenced.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from steelyard.check import Array, Integers, Mask
from steelyard.inertia import InertialParameters
from steelyard.inertia.regressor import newton_euler
from steelyard.spatial import Rotation


@dataclass(frozen=True, eq=False)
class Kinematics:
    """What S does at N times.

    time                  (N,) [s]
    rotation              (N,) R_WS
    position              (N, 3) [m] of the S origin in W
    velocity              (N, 3) [m/s] of the S origin, in S axes
    acceleration          (N, 3) [m/s^2] classical, of the S origin, gravity not included, in S axes
    angular_velocity      (N, 3) [rad/s] of S in W, in S axes
    angular_acceleration  (N, 3) [rad/s^2] in S axes
    pose                  (N,) number of the pose a stop-and-go motion is nearest to; zeros for others
    """

    time: Array
    rotation: Rotation
    position: Array
    velocity: Array
    acceleration: Array
    angular_velocity: Array
    angular_acceleration: Array
    pose: Integers

    def at_rest(self, speed: float, angular_speed: float) -> Mask:
        """Return rows (N,) whose true speeds are below `speed` [m/s] and `angular_speed` [rad/s]."""
        slow = np.linalg.norm(self.velocity, axis=1) < speed
        return np.asarray(slow & (np.linalg.norm(self.angular_velocity, axis=1) < angular_speed))


class Motion(Protocol):
    """Anything that can say where S is and how it moves."""

    def at(self, time: Array) -> Kinematics:
        """Return the kinematics at `time` (N,) [s]."""
        ...


def minimum_jerk(s: Array) -> tuple[Array, Array, Array]:
    """Return 10 s^3 - 15 s^4 + 6 s^5 and its first two derivatives in s (N,), s clipped to 0..1."""
    s = np.clip(s, 0.0, 1.0)
    value = s**3 * (10 + s * (-15 + 6 * s))
    slope = 30 * s**2 * (1 - s) ** 2
    curvature = 60 * s * (1 - s) * (1 - 2 * s)
    return value, slope, curvature


def euler_rates(q: Array, dq: Array, ddq: Array) -> tuple[Array, Array]:
    """Return angular velocity and acceleration (N, 3) in S from extrinsic xyz angles and derivatives, (N, 3).

    With q = (a, b, c), omega_S = E dq and alpha_S = E ddq + dE dq, where
    E = [[1, 0, -sin b], [0, cos a, sin a cos b], [0, -sin a, cos a cos b]].
    """
    (a, b, _), (da, db, dc) = q.T, dq.T
    sin_a, cos_a, sin_b, cos_b = np.sin(a), np.cos(a), np.sin(b), np.cos(b)
    zero, one = np.zeros_like(a), np.ones_like(a)
    rows = [[one, zero, -sin_b], [zero, cos_a, sin_a * cos_b], [zero, -sin_a, cos_a * cos_b]]
    turned = np.moveaxis(np.array(rows), 2, 0)
    change = np.stack(
        [
            -cos_b * db * dc,
            -sin_a * da * db + (cos_a * cos_b * da - sin_a * sin_b * db) * dc,
            -cos_a * da * db - (sin_a * cos_b * da + cos_a * sin_b * db) * dc,
        ],
        axis=1,
    )
    omega = np.einsum("nij,nj->ni", turned, dq)
    alpha = np.einsum("nij,nj->ni", turned, ddq) + change
    return omega, alpha


def needed(body: InertialParameters, motion: Kinematics, gravity: Array) -> Array:
    """Return the wrench (N, 6) [tau, f] that `body`, in the frame that moves, needs at that frame's origin.

    gravity  (3,) [m/s^2] in W
    """
    felt = motion.acceleration - motion.rotation.inverse().apply(gravity)
    return newton_euler(body.vector, felt, motion.angular_velocity, motion.angular_acceleration)


def _kinematics(
    time: Array,
    angles: tuple[Array, Array, Array],
    position: tuple[Array, Array, Array],
    pose: Integers,
) -> Kinematics:
    """Assemble kinematics from angles and position (value, first and second derivative; W axes)."""
    rotation = Rotation.from_rpy(angles[0])
    omega, alpha = euler_rates(*angles)
    into_sensor = rotation.inverse()
    return Kinematics(
        time=time,
        rotation=rotation,
        position=position[0],
        velocity=into_sensor.apply(position[1]),
        acceleration=into_sensor.apply(position[2]),
        angular_velocity=omega,
        angular_acceleration=alpha,
        pose=pose,
    )


@dataclass(frozen=True, eq=False)
class Held:
    """Rest at one rotation (K,) after another, each for `interval` [s]; the ways between are left out."""

    rotation: Rotation
    interval: float = np.inf

    def at(self, time: Array) -> Kinematics:
        """Return the kinematics at `time` (N,) [s]."""
        last = len(self.rotation.matrix) - 1
        pose = np.clip(np.floor(time / self.interval), 0, last).astype(np.int64)
        zero = np.zeros((len(time), 3))
        return Kinematics(time, self.rotation[pose], zero, zero, zero, zero, zero, pose)


@dataclass(frozen=True, eq=False)
class Step:
    """A minimum-jerk change by `change` (3,), beginning at `start` [s] and lasting `duration` [s]."""

    start: float
    duration: float
    change: Array

    def at(self, time: Array) -> tuple[Array, Array, Array]:
        """Return the change so far and its two derivatives, each (N, 3)."""
        value, slope, curvature = minimum_jerk((time - self.start) / self.duration)
        d = self.duration
        return tuple(np.multiply.outer(v, self.change) for v in (value, slope / d, curvature / d**2))  # type: ignore[return-value]


def _sum(steps: tuple[Step, ...], start: Array, time: Array) -> tuple[Array, Array, Array]:
    """Add the steps to the constant `start` (3,)."""
    total = np.zeros((3, len(time), 3))
    total[0] = start
    for step in steps:
        total += np.array(step.at(time))
    return total[0], total[1], total[2]


@dataclass(frozen=True, eq=False)
class StopAndGo:
    """Minimum-jerk steps between Euler keys (K, 3) [rad], key k being left for at k * `interval` [s].

    `moves` are the steps of the position in W [m], from the origin.
    """

    keys: Array
    interval: float
    duration: float
    moves: tuple[Step, ...] = ()

    def at(self, time: Array) -> Kinematics:
        """Return the kinematics at `time` (N,) [s]; `pose` is the key that is nearest."""
        turns = tuple(
            Step(k * self.interval, self.duration, change)
            for k, change in enumerate(np.diff(self.keys, axis=0), start=1)
        )
        pose = np.clip(np.floor((time - self.duration / 2) / self.interval), 0, len(self.keys) - 1).astype(np.int64)
        return _kinematics(time, _sum(turns, self.keys[0], time), _sum(self.moves, np.zeros(3), time), pose)


@dataclass(frozen=True, eq=False)
class Fourier:
    """x_i(t) = sum_k amplitude / k (cos_ik cos(k w t) + sin_ik sin(k w t)), k = 1..K, w = 2 pi frequency.

    Coefficients are (3, K) without unit; amplitudes in rad (Euler angles) and m (position in W).
    """

    frequency: float
    rotation_amplitude: float
    rotation_cos: Array
    rotation_sin: Array
    position_amplitude: float
    position_cos: Array
    position_sin: Array

    def at(self, time: Array) -> Kinematics:
        """Return the kinematics at `time` (N,) [s]."""
        angles = self._series(time, self.rotation_amplitude, self.rotation_cos, self.rotation_sin)
        position = self._series(time, self.position_amplitude, self.position_cos, self.position_sin)
        return _kinematics(time, angles, position, np.zeros(len(time), np.int64))

    def _series(self, time: Array, amplitude: float, cos: Array, sin: Array) -> tuple[Array, Array, Array]:
        k = np.arange(1, cos.shape[1] + 1)
        rate = 2 * np.pi * self.frequency * k
        c, s = np.cos(np.multiply.outer(time, rate)), np.sin(np.multiply.outer(time, rate))
        size = amplitude / k
        value = (c * size) @ cos.T + (s * size) @ sin.T
        slope = (c * size * rate) @ sin.T - (s * size * rate) @ cos.T
        curvature = -(c * size * rate**2) @ cos.T - (s * size * rate**2) @ sin.T
        return value, slope, curvature
