"""Rows at rest: their acceleration is zero, unless the wrench says otherwise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from steelyard.check import Array, Mask
from steelyard.logs.log import MotionLog, Noise

# What a robot that holds still does all the same: joint control ripple, rad/s^2 and m/s^2.
RIPPLE = Noise.of_std(0.01, 0.002, 0.0, 0.0).acceleration
# A row at rest leaves a chi-square of 6 degrees of freedom; one in a thousand lies above this.
SURPRISE = 22.46
# Mean squares of readings at rest above this many of their variances are no noise.
MOVING = 2.0


def at_rest(log: MotionLog, phi: Array, bias: Array) -> MotionLog:
    """Return the log with the acceleration of its resting rows fused with zero, in a noise class of their own.

    A row flagged still may already start to move: one such row in fifty, taken as at rest, moves the centre of mass
    more than all noise together. A flagged row stays at rest only if the wrench that phi (10,) and bias (6,) predict
    without acceleration is within its noise; else it keeps its measured acceleration and its noise.
    """
    if log.noise is None or not log.still.any():
        return log
    variance = np.stack([n.acceleration for n in log.noise])[log.noise_class]
    share = np.where(log.still[:, None], RIPPLE / np.maximum(RIPPLE + variance, 1e-300), 1.0)
    quiet = replace(
        log, angular_acceleration=share[:, :3] * log.angular_acceleration, acceleration=share[:, 3:] * log.acceleration
    )
    wrench_variance = np.stack([n.wrench for n in log.noise])[log.noise_class]
    miss = log.wrench - bias - quiet.predicted(phi)
    resting = log.still & ((miss**2 / wrench_variance).sum(1) < SURPRISE)
    settled = _settled(log, quiet, resting)
    if log.time is None or log.acceleration.any() or log.angular_acceleration.any():
        return settled
    # Nobody measured the acceleration: rows that are not at rest after all say nothing.
    return settled.rows(resting | ~log.still)


def without_noise_of_rest(log: MotionLog) -> MotionLog:
    """Return a log that is at rest throughout without its accelerations, which are noise; any other as it is.

    What such noise seems to say of the inertia would move the masses of given parts, which it hangs on. Readings well
    above their noise are of rows that move all the same, and stay.
    """
    if log.noise is None or not log.still.all():
        return log
    variance = np.stack([n.acceleration for n in log.noise])[log.noise_class]
    readings = np.concatenate([log.angular_acceleration, log.acceleration], 1)
    if ((readings**2).mean(0) > MOVING * variance.mean(0)).any():
        return log
    return without_acceleration(log, range(len(log.noise)))


def without_acceleration(log: MotionLog, classes: Sequence[int]) -> MotionLog:
    """Return the log with zero acceleration in the rows of noise `classes` at rest, which know it to RIPPLE at most."""
    rows = np.isin(log.noise_class, classes)[:, None]
    noise = tuple(
        replace(n, acceleration=np.minimum(n.acceleration, RIPPLE)) if c in classes else n
        for c, n in enumerate(log.noise or ())
    )
    return replace(
        log,
        angular_acceleration=np.where(rows, 0.0, log.angular_acceleration),
        acceleration=np.where(rows, 0.0, log.acceleration),
        noise=noise,
    )


def _settled(log: MotionLog, quiet: MotionLog, resting: Mask) -> MotionLog:
    """Return the log with the resting rows of `quiet` in noise classes of their own."""
    noise = log.noise or ()
    return replace(
        quiet,
        angular_acceleration=np.where(resting[:, None], quiet.angular_acceleration, log.angular_acceleration),
        acceleration=np.where(resting[:, None], quiet.acceleration, log.acceleration),
        still=resting,
        noise_class=log.noise_class + len(noise) * resting,
        noise=noise + tuple(_fused(n) for n in noise),
    )


def _fused(noise: Noise) -> Noise:
    """Return the noise of a reading fused with zero."""
    fused = RIPPLE * noise.acceleration / np.maximum(RIPPLE + noise.acceleration, 1e-300)
    return Noise(fused, noise.wrench)
