"""Noise levels that a log does not declare, estimated from the log itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from steelyard.check import Array, Mask
from steelyard.identify.cost.linear import inverse_scaled, loosest, normal_equations, reweighted
from steelyard.identify.cost.noise_cost import residual_map_of, weights_at
from steelyard.identify.rest import RIPPLE, without_acceleration
from steelyard.inertia.regressor import design
from steelyard.logs.log import MotionLog, Noise
from steelyard.logs.moments import Moments, features
from steelyard.logs.noise import MOTION, WRENCH, as_declared, mean_heard, robust_std, rounding

# Below this many rows the three axes share one level: noise that is slow leaves fewer independent rows than it seems,
# and an axis that looks quiet by chance would be over-weighted.
ROWS_PER_AXIS = 3000
# A median over fewer rows is too rough.
FEWEST_FOR_MEDIAN = 60
# The wrench keeps at least this share of the residual variance that noise in the motion could also explain.
LEAST_SHARE = 0.02
# No class of rows is quieter than this share of the average over all.
QUIETEST = 0.25
# A fit takes no larger share than this of what a channel's residuals tell: three poses and a free bias take so much.
MOST_LOST = 2 / 3
# Variances [(N m)^2, N^2] of an everyday wrist sensor with its model errors: where the iteration starts.
EVERYDAY = np.repeat(np.square([0.02, 0.5]), 3)
# Of a channel that does not measure.
DEAF = np.repeat(np.square([1e2, 1e3]), 3)
SMALLEST = np.repeat(np.square([1e-7, 1e-6]), 3)


def with_noise(log: MotionLog, with_bias: bool) -> MotionLog:
    """Return the log with every noise level filled in; levels that it declares are kept.

    A declared wrench variance of zero means "not known". Acceleration noise comes from the readings of rows at rest,
    else from fourth differences along time; wrench noise from the residuals, less what acceleration noise explains.
    """
    if log.noise is None:
        log = _with_classes(log)
    noise = tuple(_no_more_than_rest_shows(log, c, n) for c, n in enumerate(log.noise or ()))
    if any(new is not old for new, old in zip(noise, log.noise or (), strict=True)):
        log = replace(log, noise=noise)
    unknown = np.stack([n.wrench for n in noise]) <= 0
    if not unknown.any():
        return log
    levels = np.where(unknown, EVERYDAY, np.stack([n.wrench for n in noise]))
    trial, resting = _resting(log)
    moments = Moments.of_log(trial, by_block=False)
    # In a table of poses that are alike up to signs all rows are rounded alike: by half a step, and none averages out.
    least = np.maximum(SMALLEST, rounding(log.wrench) * (3.0 if log.time is None else 1.0))
    for _ in range(5):
        levels = np.where(unknown, _wrench_levels(trial, moments, levels, least, resting, with_bias), levels)
    return replace(log, noise=tuple(replace(n, wrench=w) for n, w in zip(noise, levels, strict=True)))


def _resting(log: MotionLog) -> tuple[MotionLog, list[int]]:
    """Return the log with zero acceleration in the classes that are all at rest, and their numbers.

    There the wrench alone makes the residual; taking what acceleration noise explains away would leave next to nothing
    of a small noise under a large one.
    """
    numbers = [
        c for c in range(len(log.noise or ())) if (log.noise_class == c).any() and log.still[log.noise_class == c].all()
    ]
    return without_acceleration(log, numbers), numbers


def _no_more_than_rest_shows(log: MotionLog, number: int, noise: Noise) -> Noise:
    """Return the noise of a class with its acceleration no noisier than readings at rest scatter.

    More would explain residuals that are the wrench's own, and leave it too little noise.
    """
    rows = log.noise_class == number
    if not rows.any() or (rows & ~log.still).any():
        return noise
    readings = np.concatenate([log.angular_acceleration[rows], log.acceleration[rows]], 1)
    seen = np.maximum((readings**2).mean(0), RIPPLE)
    return replace(noise, acceleration=np.minimum(noise.acceleration, seen))


def with_declared(log: MotionLog, declared: Mapping[str, float]) -> MotionLog:
    """Return the log with declared standard deviations in place, and wrench noise that is not declared left open.

    declared   any of force [N], torque [N m], acceleration [m/s^2], angular_acceleration [rad/s^2]
    """
    if log.noise is None:
        log = _with_classes(log)
    noise = tuple(
        Noise(as_declared(n.acceleration, declared, MOTION), as_declared(np.zeros(6), declared, WRENCH), n.taken)
        for n in log.noise or ()
    )
    return replace(log, noise=noise)


def without_dead(log: MotionLog) -> MotionLog:
    """Return the log with so much noise on its dead channels that they say nothing."""
    if log.noise is None or not log.dead.any():
        return log
    return replace(log, noise=tuple(replace(n, wrench=np.where(log.dead, DEAF, n.wrench)) for n in log.noise))


def _with_classes(log: MotionLog) -> MotionLog:
    """Return the log in two classes, moving and still, with estimated acceleration noise and unknown wrench noise."""
    acceleration = _acceleration_levels(log)
    noise = Noise(acceleration, np.zeros(6))
    return replace(log, noise_class=log.still.astype(np.int64), noise=(noise, noise))


def _acceleration_levels(log: MotionLog) -> Array:
    """Return variances (6,) of the measured [alpha, a]."""
    readings = np.concatenate([log.angular_acceleration, log.acceleration], 1)
    if not readings.any():
        return RIPPLE
    if log.still.sum() >= 8:
        return _pooled((readings[log.still] ** 2).mean(0), int(log.still.sum()))
    if log.time is None or len(log) < 16:
        return np.zeros(6)
    # White noise leaves a variance of 70 in fourth differences, where a smooth motion leaves next to nothing.
    differences = np.diff(readings[np.argsort(log.time, kind="stable")], 4, axis=0)
    return _pooled((differences**2).mean(0) / 70, len(log))


def _wrench_levels(
    log: MotionLog, moments: Moments, levels: Array, least: Array, resting: list[int], with_bias: bool
) -> Array:
    """Return wrench variances (C, 6) per class from the residuals of the solution weighted by `levels` (C, 6).

    Classes at rest are judged by their median, since a few of their rows may move; the others are no quieter, and none
    is below `least` (6,).
    """
    out, shares = np.tile(least, (len(levels), 1)), np.zeros(len(levels))
    T = design(with_bias)
    acceleration = np.stack([n.acceleration for n in log.noise or ()])[moments.noise_class]
    wrench = levels[moments.noise_class]
    linear = reweighted(T, moments.scatter, acceleration, wrench, 4)
    K = residual_map_of(T, linear)
    # Parameters that the data fix take their share of the residual degrees of freedom away.
    lost = _lost(T, moments.scatter, weights_at(K, acceleration, wrench), linear) / (3 * moments.samples)
    lost = np.minimum(lost, MOST_LOST)
    for group, c in enumerate(moments.noise_class):
        rows = moments.counts[group]
        miss = np.diag(K @ moments.scatter[group] @ K.T) / (rows * (1 - lost))
        if c in resting and rows >= FEWEST_FOR_MEDIAN:
            residual = features(log.rows(log.noise_class == c)) @ K.T
            left = np.minimum(np.square(robust_std(residual)) / (1 - lost), miss)
        elif c in resting:
            left = miss
        else:
            # What the motion's noise may explain is taken away; with a class at rest only a sure excess over it counts.
            unsure = 2 * np.sqrt(2 / rows) if resting else 0.0
            left = (1 - unsure) * miss - (K[:, :6] ** 2) @ acceleration[group]
            left = np.maximum(left, 0.0 if resting else LEAST_SHARE * miss)
        out[c] = np.maximum(_pooled(_of_heard(left, log.dead), int(rows)), least)
        shares[c] = rows / moments.samples
    quiet = np.min(out[resting], axis=0) if resting else least
    # A few rows in one pose can be fitted without any residual; they are not better than the sensor is elsewhere.
    return np.asarray(np.maximum(np.maximum(out, quiet), QUIETEST * shares @ out))


def _lost(T: Array, scatter: Array, weights: Array, linear: Array) -> Array:
    """Return how many numbers the torques and how many the forces fix, per channel (6,) of either.

    At rest one mass is all that forces tell: a few poses leave them more to judge noise by than they leave torques.
    """
    H, _ = normal_equations(T, scatter, weights)
    inverse = inverse_scaled(H + loosest(linear))
    taken = []
    for own in (slice(0, 3), slice(3, 6)):
        part = np.zeros_like(weights)
        part[:, own, own] = weights[:, own, own]
        taken.append(float(np.trace(inverse @ normal_equations(T, scatter, part)[0])))
    return np.repeat(np.maximum(taken, 0.0), 3)


def _of_heard(variance: Array, dead: Mask) -> Array:
    """Return the variances (6,) with those of dead channels at the mean of the channels beside them."""
    return np.where(dead, np.repeat(mean_heard(variance, ~dead), 3), variance)


def _pooled(variance: Array, rows: int) -> Array:
    """Return the variances, with each triple of axes at its mean where the rows are few."""
    if rows >= ROWS_PER_AXIS:
        return variance
    return np.asarray(np.repeat(variance.reshape(2, 3).mean(1), 3))
