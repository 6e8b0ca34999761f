"""Noise levels that a log does not declare, estimated from the log itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from steelyard.check import Array
from steelyard.identify.linear import reweighted
from steelyard.identify.regressor import design, residual_map
from steelyard.identify.rest import RIPPLE
from steelyard.logs.log import MotionLog, Noise
from steelyard.logs.moments import Moments

# Below this many rows the three axes share one level: noise that is slow leaves fewer independent rows than it seems,
# and an axis that looks quiet by chance would be over-weighted.
ROWS_PER_AXIS = 3000
# The wrench keeps at least this share of the residual variance that noise in the motion could also explain.
LEAST_SHARE = 0.1
# No class of rows is quieter than this share of the average over all.
QUIETEST = 0.25
# Start of the iteration: force in N and torque in N m of an everyday wrist sensor.
FIRST_GUESS = np.repeat(np.square([0.02, 0.5]), 3)
SMALLEST = np.repeat(np.square([1e-7, 1e-6]), 3)


def with_noise(log: MotionLog, with_bias: bool) -> MotionLog:
    """Return the log with every noise level filled in; levels that it declares are kept.

    A declared wrench variance of zero means "not known". Acceleration noise comes from the readings of rows at rest,
    else from fourth differences along time; wrench noise from the residuals, less what acceleration noise explains.
    """
    if log.noise is None:
        log = _with_classes(log)
    noise = log.noise or ()
    unknown = np.stack([n.wrench for n in noise]) <= 0
    if not unknown.any():
        return log
    levels = np.where(unknown, FIRST_GUESS, np.stack([n.wrench for n in noise]))
    for _ in range(5):
        log = replace(log, noise=tuple(Noise(n.acceleration, w) for n, w in zip(noise, levels, strict=True)))
        levels = np.where(unknown, _wrench_levels(log, with_bias), levels)
    return replace(log, noise=tuple(Noise(n.acceleration, w) for n, w in zip(noise, levels, strict=True)))


def with_declared(log: MotionLog, declared: Mapping[str, float]) -> MotionLog:
    """Return the log with declared standard deviations in place, and wrench noise that is not declared left open.

    declared   any of force [N], torque [N m], acceleration [m/s^2], angular_acceleration [rad/s^2]
    """
    if log.noise is None:
        log = _with_classes(log)
    noise = tuple(
        Noise(
            _declared(n.acceleration, declared, ("angular_acceleration", "acceleration")),
            _declared(np.zeros(6), declared, ("torque", "force")),
        )
        for n in log.noise or ()
    )
    return replace(log, noise=noise)


def _declared(variance: Array, declared: Mapping[str, float], names: tuple[str, str]) -> Array:
    """Return variances (6,) with the triples that are declared replaced."""
    out = np.array(variance)
    for k, name in enumerate(names):
        if name in declared:
            out[3 * k : 3 * k + 3] = declared[name] ** 2
    return out


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
    differences = np.diff(readings, 4, axis=0)
    return _pooled((differences**2).mean(0) / 70, len(log))


def _wrench_levels(log: MotionLog, with_bias: bool) -> Array:
    """Return wrench variances (C, 6) per class from the residuals of the current weighted solution."""
    moments = Moments.of_log(log, by_block=False)
    noise = log.noise or ()
    out, shares = np.tile(SMALLEST, (len(noise), 1)), np.zeros(len(noise))
    T = design(with_bias)
    acceleration = np.stack([noise[c].acceleration for c in moments.noise_class])
    wrench = np.stack([noise[c].wrench for c in moments.noise_class])
    linear = reweighted(T, moments.scatter, acceleration, wrench, 4)
    K = residual_map(linear[:10], linear[10:16] if with_bias else np.zeros(6))
    # Parameters that the data fix take their share of the residual degrees of freedom away.
    lost = min(len(T), 6 * moments.samples / 2) / (6 * moments.samples)
    for group, c in enumerate(moments.noise_class):
        rows = moments.counts[group]
        miss = np.diag(K @ moments.scatter[group] @ K.T) / (rows * (1 - lost))
        explained = (K[:, :6] ** 2) @ acceleration[group]
        out[c] = np.maximum(_pooled(np.maximum(miss - explained, LEAST_SHARE * miss), int(rows)), SMALLEST)
        shares[c] = rows / moments.samples
    # A few rows in one pose can be fitted without any residual; they are not better than the sensor is elsewhere.
    return np.asarray(np.maximum(out, QUIETEST * shares @ out))


def _pooled(variance: Array, rows: int) -> Array:
    """Return the variances, with each triple of axes at its mean where the rows are few."""
    if rows >= ROWS_PER_AXIS:
        return variance
    return np.asarray(np.repeat(variance.reshape(2, 3).mean(1), 3))
