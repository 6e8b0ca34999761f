"""Logs of a known body: exact Newton-Euler wrenches along an exact motion, then noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from steelyard import check
from steelyard.check import Array
from steelyard.inertia import InertialParameters
from steelyard.logs.log import MotionLog, Noise
from steelyard.simulate import scenarios
from steelyard.simulate.motions import Kinematics, Motion
from steelyard.simulate.noise import Spectrum, Std, unit_noise


def bounds(object_name: str) -> Array:
    """Return the lower and upper corner (2, 3) [m] of the bench object's true bounding box in S."""
    return scenarios.body(object_name).bounds()


def simulate_log(
    object_name: str,
    motion_name: str,
    noise_name: str,
    seed: int,
    *,
    shuffled: bool = True,
    spectrum: Spectrum = "white",
    bias: ArrayLike | None = None,
    repeats: int = 1,
) -> tuple[MotionLog, InertialParameters]:
    """Return the log of a bench object and its true parameters.

    The noise of every (seed, object, motion, level) is its own draw. `bias` (6,) [tau N m, f N] is added to
    the wrench. `shuffled` rows come in a seeded random order without time and pose numbers; ordered rows keep
    both (still rows carry the number of their pose, moving rows -1). `repeats` plays the motion again and
    again, each time with new noise. The log declares its true noise; the level "none" declares nothing.

    Source: `rules` of the embedded bench.
    """
    names = (scenarios.object_names(), scenarios.motion_names(), scenarios.noise_names())
    body, motion, std = (
        scenarios.body(object_name),
        scenarios.motion(motion_name),
        scenarios.noise_std(noise_name),
    )
    chosen = (object_name, motion_name, noise_name)
    rng = np.random.default_rng([seed, *(group.index(n) for group, n in zip(names, chosen, strict=True))])
    bench = scenarios.bench()
    log = log_of(
        body.parameters(),
        motion,
        std,
        rng,
        samples=int(bench["samples"]),
        rate=float(bench["rate_hz"]),
        gravity=np.array(bench["gravity_world"], float),
        spectrum=spectrum,
        bias=bias,
        repeats=repeats,
    )
    return (_shuffled(log, rng) if shuffled else log), body.parameters()


def log_of(
    body: InertialParameters,
    motion: Motion,
    std: Std,
    rng: np.random.Generator,
    *,
    samples: int = 1000,
    rate: float = 100.0,
    gravity: ArrayLike = (0.0, 0.0, -9.81),
    spectrum: Spectrum = "white",
    bias: ArrayLike | None = None,
    repeats: int = 1,
) -> MotionLog:
    """Return the ordered log of `body` (in S) along `motion`, sampled at `rate` [Hz] from time zero.

    `std` of angular acceleration, acceleration, force, torque (rad/s^2, m/s^2, N, N m), independent per axis;
    `gravity` (3,) [m/s^2] in W, seen from S, and angular velocity stay exact. `bias` (6,) [tau, f] is added
    to the wrench.
    """
    seen = motion.at(np.arange(samples) / rate)
    still_below = scenarios.STILL_SPEED, scenarios.STILL_ANGULAR_SPEED
    log = exact_log(seen, body, check.vectors("gravity", gravity), still_below)
    if repeats > 1:
        log = replace(log.rows(np.tile(np.arange(samples), repeats)), time=np.arange(samples * repeats) / rate)
    log = with_noise(log, std, rng, spectrum, rate)
    return log if bias is None else replace(log, wrench=log.wrench + check.vectors("bias", bias, 6))


def exact_log(
    seen: Kinematics, body: InertialParameters | None, gravity: Array, still_below: tuple[float, float]
) -> MotionLog:
    """Return the log without noise along `seen` (N rows) of `body` in S; wrenches are zero without one.

    gravity      (3,) [m/s^2] in W
    still_below  true speeds [m/s, rad/s] below which rows are at rest and carry the number of their pose
    """
    still = seen.at_rest(*still_below)
    log = MotionLog(
        wrench=np.zeros((len(seen.time), 6)),
        gravity=seen.rotation.inverse().apply(gravity),
        acceleration=seen.acceleration,
        angular_velocity=seen.angular_velocity,
        angular_acceleration=seen.angular_acceleration,
        time=seen.time,
        still=still,
        pose=np.where(still, seen.pose, -1),
    )
    return log if body is None else replace(log, wrench=log.predicted(body.vector))


def with_noise(
    log: MotionLog,
    std: Std,
    rng: np.random.Generator,
    spectrum: Spectrum,
    rate: float,
) -> MotionLog:
    """Return a noise-free log with noise on both accelerations and the wrench, declared where it is above zero.

    std   of angular acceleration, acceleration, force, torque (rad/s^2, m/s^2, N, N m), independent per axis
    rate  of the rows [Hz]
    """
    angular, linear, force, torque = std
    drawn = unit_noise(rng, len(log), 12, spectrum, rate) * np.repeat([angular, linear, torque, force], 3)
    return replace(
        log,
        wrench=log.wrench + drawn[:, 6:],
        acceleration=log.acceleration + drawn[:, 3:6],
        angular_acceleration=log.angular_acceleration + drawn[:, :3],
        noise=(Noise.of_std(*std),) if all(std) else None,
    )


def _shuffled(log: MotionLog, rng: np.random.Generator) -> MotionLog:
    """Return the rows in random order, stripped of time and pose number."""
    return replace(log.rows(rng.permutation(len(log))), time=None, pose=np.full(len(log), -1))
