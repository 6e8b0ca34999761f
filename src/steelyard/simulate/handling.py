"""Handling: how the paper's robot turns what it holds, exact wrenches along it, and the noise of its sensors.

The robot lifts the object and turns it so that gravity lies along each axis of S, stops at each pose and moves quickly
between them. Three variants: "paper", "slow" (no point within `reach` of S is faster than 0.25 m/s) and "static" (only
poses at rest, gravity along both directions of every axis).
Source: "The Sum of Its Parts", section V-A and Table III; gravity and acceleration have the physical sign, a - g.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from steelyard import check
from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.inertia import InertialParameters
from steelyard.logs.log import MotionLog
from steelyard.simulate import logs
from steelyard.simulate.motions import Held, Kinematics, Motion, Step, StopAndGo
from steelyard.simulate.noise import Spectrum, Std
from steelyard.spatial import Rotation

Variant = Literal["paper", "slow", "static"]
VARIANTS: tuple[Variant, ...] = ("paper", "slow", "static")
GRAVITY = (0.0, 0.0, -9.81)
RATE_HZ = 100.0
# Rows are at rest below these true speeds [m/s, rad/s].
STILL_SPEED, STILL_ANGULAR_SPEED = 0.05, 0.1
# ISO/TS 15066 calls robots slow below this speed of any point [m/s].
TIP_SPEED = 0.25
REACH = 0.35
# Standard deviations of angular acceleration, acceleration, force, torque (rad/s^2, m/s^2, N, N m).
# "high" is Table III, "high-code" what the published code draws.
NOISE: Mapping[str, Std] = MappingProxyType({
    "none": (0.0, 0.0, 0.0, 0.0),
    "low": (0.25, 0.025, 0.05, 0.0025),
    "moderate": (0.5, 0.05, 0.1, 0.005),
    "high": (1.0, 0.1, 0.33, 0.0067),
    "high-code": (1.0, 0.1, 0.2, 0.01),
})  # fmt: skip

# Extrinsic xyz angles [deg]: gravity along +z (flange down), -y, +x, +z of S.
_TURNS = ((180, 0, 0), (90, 0, 40), (125, 90, 25), (180, 0, 0))
_POSES = ((180, 0, 0), (90, 0, 40), (0, 90, 0), (0, 0, 0), (-90, 0, 40), (0, -90, 0))
_LIFT, _CARRY = (0.0, 0.0, 0.2), ((0.12, 0.1, 0.0), (-0.05, 0.12, 0.08), (-0.07, -0.22, -0.08))
_STOP, _TURN, _LONG_STOP, _HOLD = 0.5, 2.0, 1.0, 10 / 6


@dataclass(frozen=True, eq=False)
class Disturbance:
    """What a real force-torque sensor adds beyond white noise; all zero by default.

    bias     (6,) [tau N m, f N] constant
    drift    (6,) [N m/s, N/s] growth of the bias from the first row on
    latency  [s] by which the wrench is late on its stamps
    quantum  (6,) [N m, N] step to which the wrench is rounded; 0 = none
    spectrum "white", or "2hz": noise of every channel low-passed at 2 Hz, of the same strength
    """

    bias: ArrayLike = (0.0,) * 6
    drift: ArrayLike = (0.0,) * 6
    latency: float = 0.0
    quantum: ArrayLike = (0.0,) * 6
    spectrum: Spectrum = "white"


NOTHING = Disturbance()


def handling_motion(variant: str = "paper", reach: float = REACH) -> tuple[Motion, float]:
    """Return the motion of S and how long it lasts [s].

    `reach` [m] is the distance from S of the object's farthest point; only the slow variant depends on it.
    """
    if variant not in VARIANTS:
        raise BadValue(f"variant must be one of {', '.join(VARIANTS)}; got {variant!r}.")
    if variant == "static":
        return Held(Rotation.from_rpy(np.radians(_POSES)), _HOLD), _HOLD * len(_POSES)
    if variant == "paper":
        return _stop_and_go(_TURN, _STOP), (_TURN + _STOP) * len(_TURNS)
    turn = _slow_turn(check.positive("reach", reach))
    return _stop_and_go(turn, _LONG_STOP), (turn + _LONG_STOP) * len(_TURNS)


def _stop_and_go(turn: float, stop: float) -> StopAndGo:
    """Return the lift and the turns, `turn` [s] each, with `stop` [s] between them."""
    interval = turn + stop
    carry = (Step(k * interval, turn, np.array(move)) for k, move in enumerate(_CARRY, start=1))
    return StopAndGo(np.radians(_TURNS), interval, turn, (Step(stop / 2, turn, np.array(_LIFT)), *carry))


def _slow_turn(reach: float) -> float:
    """Return the duration of a turn [s] at which the fastest point is at the limit: speeds go as 1 / duration."""
    seen = _stop_and_go(1.0, 0.5).at(np.linspace(0, 1.5 * len(_TURNS), 3001))
    speed = np.linalg.norm(seen.velocity, axis=1) + reach * np.linalg.norm(seen.angular_velocity, axis=1)
    return float(1.001 * speed.max() / TIP_SPEED)


def motion_arrays(variant: str = "paper", body: InertialParameters | None = None) -> dict[str, Array]:
    """Return the noise-free columns of an object folder's `motion.npz`, N rows at 100 Hz.

    time (N,) [s], rotation_world_from_sensor (N, 3, 3), position_world (N, 3) [m], and in S axes (N, 3)
    linear_velocity_sensor, angular_velocity_sensor, linear_acceleration_sensor, angular_acceleration_sensor (classical,
    of the S origin, gravity not included) and gravity_sensor. With a `body` in S also force_sensor and torque_sensor,
    what the robot applies to it.
    """
    motion, duration = handling_motion(variant)
    seen = motion.at(np.arange(round(duration * RATE_HZ)) / RATE_HZ)
    log = exact_log(seen, body)
    columns = {
        "time": seen.time,
        "rotation_world_from_sensor": seen.rotation.matrix,
        "position_world": seen.position,
        "linear_velocity_sensor": seen.velocity,
        "angular_velocity_sensor": seen.angular_velocity,
        "linear_acceleration_sensor": seen.acceleration,
        "angular_acceleration_sensor": seen.angular_acceleration,
        "gravity_sensor": log.gravity,
    }
    if body is not None:
        columns |= {"force_sensor": log.wrench[:, 3:], "torque_sensor": log.wrench[:, :3]}
    return columns


def exact_log(seen: Kinematics, body: InertialParameters | None) -> MotionLog:
    """Return the log without noise along `seen` (N rows) of `body` in S; wrenches are zero without one."""
    return logs.exact_log(seen, body, np.array(GRAVITY), (STILL_SPEED, STILL_ANGULAR_SPEED))


def handling_log(
    body: InertialParameters,
    variant: str = "paper",
    noise: str | Std = "high",
    seed: int = 0,
    *,
    disturbance: Disturbance = NOTHING,
) -> MotionLog:
    """Return the ordered log of handling `body` (ten parameters in S), with seeded noise.

    `noise` is a scenario of `NOISE` or four standard deviations of angular acceleration, acceleration, force, torque;
    gravity in S and angular velocity stay exact. The log declares its noise where there is any on every channel.
    """
    motion, duration = handling_motion(variant)
    time = np.arange(round(duration * RATE_HZ)) / RATE_HZ
    log = exact_log(motion.at(time), body)
    if disturbance.latency:
        late = exact_log(motion.at(np.maximum(time - disturbance.latency, 0.0)), body)
        log = replace(log, wrench=late.wrench)
    noisy = with_noise(log, noise, np.random.default_rng(seed), disturbance.spectrum)
    return replace(noisy, wrench=_as_read(noisy.wrench, time, disturbance))


def with_noise(
    log: MotionLog,
    noise: str | Std,
    rng: np.random.Generator,
    spectrum: Spectrum = "white",
) -> MotionLog:
    """Return a noise-free log at 100 Hz with noise of a scenario, or of four deviations; see `logs.with_noise`."""
    return logs.with_noise(log, noise_std(noise), rng, spectrum, RATE_HZ)


def noise_std(noise: str | Std) -> Std:
    """Return the standard deviations of angular acceleration, acceleration, force, torque in SI units."""
    if not isinstance(noise, str):
        return noise
    if noise not in NOISE:
        raise BadValue(f"There is no noise scenario '{noise}'; there are: {', '.join(NOISE)}.")
    return NOISE[noise]


def _as_read(wrench: Array, time: Array, disturbance: Disturbance) -> Array:
    """Return the wrench (N, 6) as the sensor reports it: biased, drifting, rounded."""
    bias, drift, quantum = (check.vectors(name, getattr(disturbance, name), 6) for name in ("bias", "drift", "quantum"))
    out = wrench + bias + np.outer(time, drift)
    step = np.where(quantum > 0, quantum, 1.0)
    return np.asarray(np.where(quantum > 0, np.round(out / step) * step, out))
