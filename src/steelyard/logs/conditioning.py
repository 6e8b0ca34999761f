"""Conditioning: low-pass and interpolation of sampled channels, and how noisy they are."""

from __future__ import annotations

import numpy as np

from steelyard import check
from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.logs.butterworth import there_and_back
from steelyard.logs.clock import sampling_rate
from steelyard.logs.curve import Curve

_NOISE_BLOCK = 64
_QUIETEST = 0.84  # 0.1 quantile of the noise level over blocks of that length

# A filter is behind none to all of a delay, all shares alike likely: the mean square of what it takes away.
FILTERED = 1 / 3


def signal(time: Array, values: Array, cutoff_hz: float | None = None) -> Curve:
    """Return `values` (N, D) as a function of time, low-passed at `cutoff_hz` where that is below 0.4 of the rate.

    Without a cut-off the samples themselves are met exactly.
    """
    t, y = check.finite("time", time), check.finite("values", values)
    rate = sampling_rate(t)
    if cutoff_hz is not None and cutoff_hz < 0.4 * rate and len(t) > 30:
        even = np.linspace(t[0], t[-1], int(np.ceil((t[-1] - t[0]) * rate)) + 1)
        y = lowpass(Curve.through(t, y).at(even), cutoff_hz, (len(even) - 1) / (t[-1] - t[0]))
        t = even
    return Curve.through(t, y)


def lowpass(values: Array, cutoff_hz: float, rate_hz: float, order: int = 4) -> Array:
    """Return `values` (N, D), evenly sampled, through a zero-phase Butterworth low-pass of even order.

    Raises BadValue when the cut-off is not below half the rate.
    Source: "Cooperative Payload Estimation", IV-B (fourth-order Butterworth; run forwards and backwards
    here).
    """
    if not 0 < cutoff_hz < rate_hz / 2:
        raise BadValue(f"cut-off must be between 0 and half the rate ({rate_hz / 2:.6g} Hz); got {cutoff_hz:.6g} Hz.")
    pad = min(len(values) - 1, int(3 * rate_hz / cutoff_hz))
    return there_and_back(values, cutoff_hz / rate_hz, order, pad)


def lowpass_gain(frequency: Array, cutoff_hz: float) -> Array:
    """Return the share (K,) of an amplitude that a fourth-order `lowpass` leaves at frequencies (K,) [Hz]."""
    return np.asarray(1 / (1 + (frequency / cutoff_hz) ** 8))


def noise_left(cutoff_hz: float | None, rate_hz: float) -> float:
    """Return the share of the variance of white noise that a low-pass leaves; all of it where there is none."""
    return 1.0 if cutoff_hz is None else min(1.0, 2 * cutoff_hz / rate_hz)


def taken_by_filter(frequency: Array, late: float | Array) -> Array:
    """Return what a filter of first order that is `late` [s] takes at `frequency` [Hz], as a share of what it leaves.

    It leaves 1 / sqrt(1 + (2 pi f late)^2) of a frequency f, a mean over the last samples about as much, a slow bus all
    of it. A delay is put right, but not what was taken, and no log tells them apart by much: the noise of
    accelerations, which grows with f, lowers what seems to follow, too. Shapes broadcast.
    """
    return np.asarray(np.sqrt(1 + (2 * np.pi * frequency * late) ** 2) - 1)


def noise_std(values: Array) -> Array:
    """Return the white-noise level (D,) of evenly sampled `values` (N, D) from third differences.

    The quietest tenth of short blocks decides, so that motion and vibration elsewhere do not count; the
    factor makes up for choosing the quietest of blocks that are only noise.
    """
    y = check.finite("values", values)
    if len(y) < 8:
        return np.zeros(y.shape[1])
    variances = noise_variances(y, _NOISE_BLOCK)
    quiet = np.sqrt(np.quantile(variances, 0.1, axis=0))
    return np.asarray(quiet / _QUIETEST if len(variances) > 9 else quiet)


def noise_variances(values: Array, rows: int) -> Array:
    """Return the white-noise variance (B, D) in each block of about `rows` rows of `values` (N, D): third differences.

    There must be four rows or more.
    """
    squares = np.diff(values, 3, axis=0) ** 2 / 20
    block = np.arange(max(len(squares) // rows, 1))
    size, longer = divmod(len(squares), len(block))
    starts = size * block + np.minimum(block, longer)
    return np.asarray(np.add.reduceat(squares, starts, axis=0) / (size + (block < longer))[:, None])
