"""What the robots of a team measure: joint encoders, poses or twists, and forces, with the noise of a case."""

from __future__ import annotations

import numpy as np
from scipy import signal

from steelyard.check import Array
from steelyard.simulate.motions import Kinematics
from steelyard.simulate.noise import unit_noise
from steelyard.simulate.team_cases import DOWN, RATE_HZ, TeamNoise
from steelyard.spatial import Pose, Rotation, lever_acceleration

_CORNER_HZ = 2.0


def autoregressive(rng: np.random.Generator, rows: int, columns: int) -> Array:
    """Return stationary first-order noise (rows, columns) of standard deviation 1 with its corner at 2 Hz."""
    keep = float(np.exp(-2 * np.pi * _CORNER_HZ / RATE_HZ))
    driven = rng.standard_normal((rows, columns)) * np.sqrt(1 - keep**2)
    driven[0] /= np.sqrt(1 - keep**2)
    return np.asarray(signal.lfilter([1.0], [1.0, -keep], driven, axis=0))


def read_joints(rng: np.random.Generator, joints: Array, noise: TeamNoise) -> Array:
    """Return what encoders read of joint angles (T, 6) [rad]: white and structure noise added, then quantised."""
    read = joints + noise.white_rad * rng.standard_normal(joints.shape)
    read = read + noise.ar_rad * autoregressive(rng, *joints.shape)
    if noise.encoder_bits is None:
        return np.asarray(read)
    step = 2 * np.pi / 2**noise.encoder_bits
    return np.asarray(step * np.round(read / step))


def read_pose(rng: np.random.Generator, pose: Pose, noise: TeamNoise) -> Pose:
    """Return poses (T,) with noise on rotation and position, in the grasp's and the home's axes."""
    size = np.repeat([noise.pose_rad, noise.pose_m], 3)
    error = size * unit_noise(rng, len(pose.position), 6, noise.pose_spectrum, RATE_HZ)
    return Pose(pose.rotation @ Rotation.exp(error[:, :3]), pose.position + error[:, 3:])


def read_twist(rng: np.random.Generator, twist: Array, noise: TeamNoise) -> Array:
    """Return body twists (T, 6) with noise of the case's spectrum."""
    size = np.repeat([noise.rate_rad_s, noise.velocity_m_s], 3)
    return np.asarray(twist + size * unit_noise(rng, len(twist), 6, noise.twist_spectrum, RATE_HZ))


def read_imu(rng: np.random.Generator, motion: Kinematics, grasp: Pose, noise: TeamNoise) -> tuple[Array, Array]:
    """Return angular velocity and specific force a - g (T, 3) in the axes of a grasp X_CG of the moving frame C."""
    omega, alpha = motion.angular_velocity, motion.angular_acceleration
    felt = motion.acceleration + lever_acceleration(omega, alpha, grasp.position)
    felt = felt - motion.rotation.inverse().apply(DOWN)
    into = grasp.rotation.inverse()
    white = rng.standard_normal((len(omega), 6)) * np.repeat([noise.imu_rad_s, noise.imu_m_s2], 3)
    return into.apply(omega) + white[:, :3], into.apply(felt) + white[:, 3:]


def draw_calibration(rng: np.random.Generator, noise: TeamNoise) -> tuple[Array, Array]:
    """Return gain (3,) and bias (6,) [N m, N] of one robot's wrench."""
    gain = 1 + noise.force_gain * rng.standard_normal(3)
    size = np.repeat([noise.torque_bias_Nm, noise.force_bias_N], 3)
    return gain, size * rng.standard_normal(6)


def read_wrench(
    rng: np.random.Generator, wrench: Array, noise: TeamNoise, gain: Array, bias: Array, six_axis: bool
) -> Array:
    """Return what a wrist reads of wrenches (T, 6): gain on the force, bias, noise; no moment from a gimbal."""
    size = np.repeat([noise.torque_white_Nm, noise.force_white_N], 3)
    read = wrench * np.concatenate([np.ones(3), gain]) + bias
    read = read + size * unit_noise(rng, len(wrench), 6, noise.force_spectrum, RATE_HZ)
    if not six_axis:
        read[:, :3] = 0.0
    return np.asarray(read)
