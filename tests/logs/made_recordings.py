"""Recordings made from a known body, motion, clocks and mount."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import CubicSpline

from steelyard.inertia import solids
from steelyard.logs.log import MotionLog
from steelyard.logs.recording import Recording, Stream
from steelyard.spatial import Pose, Rotation

GRAVITY = np.array([0.0, 0.0, -9.81])
BODY = solids.box(0.08, 0.06, 0.2, 1000).in_frame(Pose(Rotation.exp([0.1, 0.2, 0.3]), np.array([0.01, -0.02, 0.07])))
BIAS = np.array([0.4, -0.7, -0.15, 9.0, -1.0, 10.0])


@dataclass(frozen=True, eq=False)
class Swing:
    """Random smooth motion: rotations from rotation-vector sines, position from sines; exact derivatives by splines."""

    seed: int = 0
    duration: float = 12.0
    angle: float = 0.9
    travel: float = 0.15
    axes: tuple[float, float, float] = (1.0, 1.0, 1.0)
    shake: tuple[float, float] = (0.0, 1.0)  # [rad] and [Hz] of what joints ripple by
    fine: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        rng = np.random.default_rng(self.seed)
        t = np.arange(-0.5, self.duration + 0.5, 0.002)
        turn, move = np.zeros((len(t), 3)), np.zeros((len(t), 3))
        for _ in range(4):
            f = rng.uniform(0.15, 1.2, 3)
            turn += np.sin(2 * np.pi * f * t[:, None] + rng.uniform(0, 6, 3)) / (1 + 2 * f)
            move += np.sin(2 * np.pi * f * t[:, None] + rng.uniform(0, 6, 3)) / (1 + 4 * f)
        turn *= self.angle * np.array(self.axes)
        turn += self.shake[0] * np.sin(2 * np.pi * self.shake[1] * t[:, None] + np.arange(3))
        object.__setattr__(self, "fine", t)
        object.__setattr__(self, "_matrix", CubicSpline(t, Rotation.exp(turn).matrix.reshape(-1, 9)))
        object.__setattr__(self, "_position", CubicSpline(t, self.travel * move))

    def at(self, t):
        """Return rotation matrices, omega, alpha (in S), and position, velocity, acceleration in W."""
        R, dR, ddR = (self._matrix(t, k).reshape(-1, 3, 3) for k in range(3))
        spin, turn = np.swapaxes(R, 1, 2) @ dR, np.swapaxes(R, 1, 2) @ ddR
        omega = _vee(spin)
        alpha = _vee(turn)
        return R, omega, alpha, self._position(t), self._position(t, 1), self._position(t, 2)

    def log(self, t):
        """Return the exact log at times t."""
        R, omega, alpha, _, _, a = self.at(t)
        back = np.swapaxes(R, 1, 2)
        zero = np.zeros((len(t), 6))
        log = MotionLog(zero, back @ GRAVITY, np.einsum("nij,nj->ni", back, a), omega, alpha, time=t)
        return MotionLog(
            log.predicted(BODY.vector), log.gravity, log.acceleration, omega, alpha, time=t
        )  # fmt: skip


def _vee(m):
    return np.stack([m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]], 1) / 2


def recording(
    swing, *, seed=1, wrench_hz=500.0, pose_hz=100.0, imu_hz=250.0, imu_delay=0.0, pose_delay=0.0, mount=None,
    lever=(0.0, 0.0, 0.0), imu_bias=(0.1, -0.2, 0.15), position=False, imu=True, force_std=0.05, torque_std=0.005,
    imu_std=0.05, angle_std=2e-4, sign=1, taps=(), quiet=False,
):  # fmt: skip
    """Return a Recording of up to three streams with their own clocks; mount = R_SI."""
    rng = np.random.default_rng(seed)
    scale = 0.0 if quiet else 1.0

    def clock(rate):
        t = np.arange(0, swing.duration, 1 / rate) + rng.uniform(0, 1 / rate)
        return t + scale * rng.uniform(-0.1, 0.1, len(t)) / rate

    t = clock(wrench_hz)
    wrench = swing.log(t).wrench + BIAS
    wrench = wrench + scale * rng.normal(size=wrench.shape) * np.repeat([torque_std, force_std], 3)
    for at in taps:
        ring = np.where(t > at, np.exp(-(t - at) / 0.02) * np.cos(2 * np.pi * 60 * (t - at)), 0.0)
        wrench[:, 3:] += ring[:, None] * np.array([8.0, -5.0, 3.0])
    streams = [Stream("wrench.csv", {"force": sign * wrench[:, 3:], "torque": sign * wrench[:, :3]}, time=t)]
    t = clock(pose_hz)
    R, _, _, p, _, _ = swing.at(t)
    R = R @ Rotation.exp(scale * angle_std * rng.normal(size=(len(t), 3))).matrix
    channels = {"rotation": R}
    if position:
        channels["position"] = p + scale * 1e-4 * rng.normal(size=p.shape)
    streams.append(Stream("pose.csv", channels, time=t + pose_delay))
    if imu:
        t = clock(imu_hz)
        log = swing.log(t)
        lever = np.asarray(lever, float)
        f = log.acceleration - log.gravity + np.cross(log.angular_acceleration, lever)
        f = f + np.cross(log.angular_velocity, np.cross(log.angular_velocity, lever))
        turn = Rotation.identity() if mount is None else mount
        f = turn.inverse().apply(f) + np.asarray(imu_bias) + scale * imu_std * rng.normal(size=f.shape)
        streams.append(Stream("imu.csv", {"specific_force": f}, time=t + imu_delay))
    return Recording(tuple(streams), GRAVITY, sign)


def fitted(log):
    """Return the ten parameters and bias (16,) of a weighted linear fit."""
    Y = np.zeros((len(log), 6, 16))
    for i in range(10):
        Y[:, :, i] = log.predicted(np.eye(10)[i])
    Y[:, :, 10:] = np.eye(6)
    s = np.array([0.005] * 3 + [0.05] * 3)
    return np.linalg.lstsq((Y / s[:, None]).reshape(-1, 16), (log.wrench / s).ravel(), rcond=None)[0]
