"""Taps: short bursts in a wrench or an accelerometer that stand out of their own surroundings."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array, Mask
from steelyard.logs.clock import sampling_rate
from steelyard.logs.conditioning import lowpass
from steelyard.logs.intervals import merged

_SPLIT_HZ = 20.0  # a held body moves below, a knock rings above
_PEAK, _EDGE = 8.0, 4.0  # sigmas to call a tap, and to end it
_SURROUNDINGS_S = 0.6
_SHARE_OF_RANGE = 0.05
_GAP_ROWS, _GAP_S = 5, 0.05  # a step of the clock longer than both is a gap
_PAUSE_S = 0.05  # a tap that rings on is loud again within this


def bursts(time: Array, values: Array, margin_s: float = 0.03) -> Array:
    """Return intervals (K, 2) [s] in which `values` (N, 3), sampled at `time` (N,) [s], burst.

    The part above 20 Hz (or a fifth of the rate) is measured against its median size in the 0.6 s before and
    after, whichever is larger, so that the start of a motion or a noisy stretch is no tap; and a tap must
    reach a twentieth of the range of the channel. Each interval is widened by `margin_s`.
    """
    rate = sampling_rate(time)
    half = max(int(_SURROUNDINGS_S * rate), 8)
    if len(time) < 4 * half:
        return np.zeros((0, 2))
    size = _fast_part(values, rate)
    level = _level(size, half)
    slow = np.quantile(values, [0.02, 0.98], axis=0)
    floor = _SHARE_OF_RANGE * float(np.linalg.norm(slow[1] - slow[0]))
    whole = ~_beside_gaps(time, rate)
    peak = (size > _PEAK * level) & (size > floor) & whole
    return _intervals(time, peak, (size > _EDGE * level) & whole, margin_s)


def _beside_gaps(time: Array, rate: float) -> Mask:
    """Return rows (N,) beside a gap in the clock: what was moved on meanwhile looks like a burst, and is none."""
    steps = np.diff(time)
    marks = np.zeros(len(time) + 1, np.int64)
    reach = int(np.ceil(rate / min(_SPLIT_HZ, 0.2 * rate)))
    gaps = np.flatnonzero(steps > max(_GAP_ROWS / rate, _GAP_S)) + 1
    np.add.at(marks, np.maximum(gaps - reach, 0), 1)
    np.add.at(marks, np.minimum(gaps + reach, len(time)), -1)
    return np.asarray(np.cumsum(marks[:-1]) > 0)


def _fast_part(values: Array, rate: float) -> Array:
    """Return the size (N,) of what is above the split frequency."""
    split = min(_SPLIT_HZ, 0.2 * rate)
    return np.asarray(np.linalg.norm(values - lowpass(values, split, rate, order=2), axis=1))


def _level(size: Array, half: int) -> Array:
    """Return the local Gaussian scale (N,): the larger of the medians before and after each sample."""
    blocks = max(half // 16, 1)
    count = len(size) // blocks
    coarse = np.median(size[: count * blocks].reshape(count, blocks), axis=1)
    wing = max(half // blocks, 2)
    padded = np.concatenate([np.full(wing, np.nan), coarse, np.full(wing, np.nan)])
    windows = np.lib.stride_tricks.sliding_window_view(padded, wing)
    with np.errstate(all="ignore"):
        median = _nan_median(windows)
    before, after = median[:count], median[wing + 1 : wing + 1 + count]
    level = np.fmax(before, after)
    level = np.where(np.isfinite(level), level, np.median(coarse))
    at = (np.arange(count) + 0.5) * blocks
    # The norm of three Gaussians has its median at 1.54 sigma.
    return np.asarray(np.interp(np.arange(len(size)), at, level) / 1.54)


def _nan_median(windows: Array) -> Array:
    """Return medians of the rows without NaN; NaN where fewer than half of a row is left."""
    enough = np.isfinite(windows).sum(1) * 2 >= windows.shape[1]
    out = np.full(len(windows), np.nan)
    if enough.any():
        out[enough] = np.nanmedian(windows[enough], axis=1)
    return out


def _intervals(time: Array, peak: Mask, edge: Mask, margin_s: float) -> Array:
    """Return the stretches around peaks in which the signal comes above the edge at least every 0.05 s."""
    rows = np.flatnonzero(edge | peak)
    if not peak.any():
        return np.zeros((0, 2))
    cuts = np.flatnonzero(np.diff(time[rows]) > _PAUSE_S)
    starts, ends = rows[np.concatenate([[0], cuts + 1])], rows[np.concatenate([cuts, [len(rows) - 1]])]
    hits = np.concatenate([[0], np.cumsum(peak)])
    kept = hits[ends + 1] > hits[starts]
    return merged(np.stack([time[starts[kept]] - margin_s, time[ends[kept]] + margin_s], 1))
