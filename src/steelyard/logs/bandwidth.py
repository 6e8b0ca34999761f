"""Bandwidth: up to which frequency arm and load move as the poses say.

Encoders do not see an arm's structure swing after a stop. The wrench does, and taken for noise of the motion such
swinging inflates the inertia. It comes stop after stop; what happens once, such as a slip or a knock, is no swinging.
"""

from __future__ import annotations

import numpy as np

from steelyard.check import Array
from steelyard.logs.delays import features, free_residual
from steelyard.logs.kinematics import Motion

# [Hz] where the bands begin that are judged; the last ends where the low-pass does, at this multiple at least.
BANDS, NARROWEST = (5.0, 7.0, 10.0, 14.0, 20.0, 28.0), 1.25
# A structure swings where so many times more is left per Hz than in the quietest band above, and more than explained.
CLEAR = 4.0
# Power is told by windows of so many seconds; where there are so many, the loudest two of each band are left out.
_WINDOW_S, _WINDOWS, _ONCE = 3.0, 6, 2


def rigid_up_to(rate: float, cutoff: float, wrench: Array, motion: Motion) -> float | None:
    """Return the frequency [Hz] from which on the wrench (N, 6) no longer follows the motion, None where it does.

    rate     [Hz] of the rows
    cutoff   [Hz] of their low-pass

    Noise is as strong at higher frequencies, and that of an acceleration stronger; what swings is not. Moments and
    forces are judged apart.
    """
    edges = np.array([*(b for b in BANDS if NARROWEST * b < cutoff), cutoff])
    if len(edges) < 2:
        return None
    left = free_residual(wrench, features(motion, None))
    low = np.inf
    for part in (slice(0, 3), slice(3, 6)):
        unlike, alike = (_per_hz(values[:, part], rate, edges) for values in (left, wrench - left))
        floor = np.minimum.accumulate(unlike[::-1])[::-1]
        swings = np.flatnonzero((unlike > alike) & (unlike > CLEAR * floor))
        low = min(low, edges[swings[0]] if len(swings) else np.inf)
    return float(low) if low < cutoff else None


def _per_hz(values: Array, rate: float, edges: Array) -> Array:
    """Return the mean variance per Hz of evenly sampled `values` (N, D) in each band, without what happens once."""
    count = int(len(values) / (rate * _WINDOW_S))
    count, once = (count, _ONCE) if count >= _WINDOWS else (1, 0)
    length = len(values) // count
    windows = values[: count * length].reshape(count, length, -1)
    shaped = (windows - windows.mean(1, keepdims=True)) * np.hanning(length)[:, None]
    power = (np.abs(np.fft.rfft(shaped, axis=1)) ** 2).sum(2)
    band = np.searchsorted(edges, np.fft.rfftfreq(length, 1 / rate), "right") - 1
    inside = (band >= 0) & (band < len(edges) - 1)
    sums = np.stack([np.bincount(band[inside], each[inside], len(edges) - 1) for each in power])
    return np.asarray(np.sort(sums, axis=0)[: count - once].mean(0) / np.diff(edges))
