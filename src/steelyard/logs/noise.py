"""Noise of an aligned log: which rows share one level, and what those levels are."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from steelyard.check import Array, Integers, Mask
from steelyard.inertia.regressor import motion_map
from steelyard.logs.log import Noise
from steelyard.logs.runs import stretches

# What may be declared of the six variances of a motion and of a wrench.
MOTION, WRENCH = ("angular_acceleration", "acceleration"), ("torque", "force")
_FEWEST_ROWS = 30
# Standard deviations from which on a row counts less.
FAR = 2.0
# Finer steps than this are never the largest error.
_MOST_DECIMALS = 6


def robust_std(values: Array) -> Array:
    """Return the standard deviation (k,) of normal values (N, k) about zero, from the median of their sizes."""
    return np.asarray(1.4826 * np.median(np.abs(values), axis=0))


def mean_heard(values: Array, heard: Mask) -> Array:
    """Return the means (2,) of values (6,) over the three torques and the three forces, of channels that measure."""
    return np.asarray((values * heard).reshape(2, 3).sum(1) / np.maximum(heard.reshape(2, 3).sum(1), 1))


def huber(scaled: Array) -> Array:
    """Return how much (N,) each row of residuals (N, k) over their spread counts: less from an rms of FAR on."""
    return np.asarray(np.minimum(1.0, FAR / np.maximum(np.sqrt((scaled**2).mean(1)), 1e-12)))


def block_covariance(H: Array, scores: Array, prior: Array, blocks: int) -> Array:
    """Return the covariance (P, P) of a fit by the scores (N, P) of its rows, summed over even stretches of them.

    H  (P, P) normal matrix, in it the `prior` (P,), which counts as data of its own strength
    This sandwich sees residuals that are correlated within a stretch.
    """
    block = stretches(len(scores), blocks)
    sums = np.stack([np.bincount(block, column, blocks) for column in scores.T], 1)
    back = np.linalg.inv(H)
    return np.asarray(back @ (sums.T @ sums * blocks / (blocks - 1) + np.diag(prior)) @ back)


def rounding(wrench: Array) -> Array:
    """Return the variances (6,) that rounding leaves in wrenches (N, 6), typed or printed with so many decimals.

    Of full doubles it is zero. A residual does not show it where poses are alike up to signs.
    """
    steps = np.repeat([_step(wrench[:, :3]), _step(wrench[:, 3:])], 3)
    return np.asarray(steps**2 / 12)


def _step(values: Array) -> float:
    """Return the largest power of ten, at most one, of which all values are multiples; zero if it is a tiny one."""
    if not values.any():
        return 0.0
    for decimals in range(_MOST_DECIMALS + 1):
        # Most logs are full doubles: a few rows tell.
        if all(_whole(part * 10.0**decimals) for part in (values[:_FEWEST_ROWS], values)):
            return 10.0**-decimals
    return 0.0


def _whole(values: Array) -> bool:
    return bool((np.abs(values - np.rint(values)) < 1e-9 * np.maximum(np.abs(values), 1.0)).all())


def classes(still: Mask, alpha_variance: Array) -> Integers:
    """Return a class (N,) per row: still rows, and moving rows binned by factors of four of their variance (N,)."""
    base = float(np.median(alpha_variance)) or 1.0
    bins = np.clip(np.rint(np.log(np.maximum(alpha_variance, 1e-30) / base) / np.log(4.0)), -1, 3).astype(np.int64)
    label = np.where(still, -2, bins)
    # A bin with few rows joins the moving rows around the median.
    names, counts = np.unique(label, return_counts=True)
    rare = names[(counts < _FEWEST_ROWS) & (names != -2)]
    label = np.where(np.isin(label, rare), 0, label)
    _, index = np.unique(label, return_inverse=True)
    return np.asarray(index, dtype=np.int64)


def levels(
    index: Integers, alpha_variance: Array, acceleration_variance: Array, residual: Array, body: Array,
    least: Array, declared: Mapping[str, float], within: tuple[float, float] = (1.0, 1.0),
) -> tuple[Noise, ...]:  # fmt: skip
    """Return one Noise per class from the variances of the motion (N,) and the wrench residual (N, 6) of a body (10,).

    The wrench carries what the residual shows beyond the noise of the motion, at least `least` (6,) [(N m)^2, N^2].
    Declared standard deviations (force, torque, acceleration, angular_acceleration) win.
    within  shares of the two variances of the motion that are noise within it
    """
    M = motion_map(body)[:, :6]
    out = []
    for k in range(int(index.max()) + 1):
        rows = index == k
        unsure = np.repeat([alpha_variance[rows].mean(), acceleration_variance[rows].mean()], 3)
        motion = as_declared(unsure * np.repeat(within, 3), declared, MOTION)
        seen = robust_std(residual[rows]) ** 2
        explained = np.einsum("ij,j,ij->i", M, motion, M)
        wrench = np.maximum(seen - explained, np.maximum(least, 0.01 * seen))
        out.append(Noise(motion, as_declared(wrench, declared, WRENCH), np.maximum(unsure - motion, 0.0)))
    return tuple(out)


def as_declared(variance: Array, declared: Mapping[str, float], names: tuple[str, str]) -> Array:
    """Return variances (6,), each triple by the standard deviation that is declared by its name where one is."""
    stds = [declared.get(name, np.nan) for name in names]
    given = np.repeat(np.square(stds), 3)
    return np.where(np.isnan(given), variance, given)
