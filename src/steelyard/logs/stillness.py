"""Stillness: which rows are at rest, and the numbers of still poses and time blocks."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array, Integers, Mask
from steelyard.logs.clock import median_step
from steelyard.logs.conditioning import noise_std
from steelyard.logs.runs import runs

_SHORTEST_S = 0.25
_BLOCKS, _SHORTEST_BLOCK_S = 12, 0.3
TURNING = 0.02  # [rad/s]
MOVING = 0.005  # [m/s]
_NOISES = 1.5  # times the white noise of a channel: its spread at rest, and a little


def still_rows(time: Array, omega: Array, velocity: Array | None, wrench: Array, turning_known: bool = True) -> Mask:
    """Return which rows (N,) are at rest for at least 0.25 s.

    At rest means turning below 0.02 rad/s and, where the velocity is known, moving below 5 mm/s; a motion
    that nobody measured shows in the wrench, whose local spread must be near its least. Where nobody measured the
    turning (`turning_known` false) a smooth motion may be the least there is: then the wrench must stay in its noise.
    """
    quiet = np.linalg.norm(omega, axis=1) < TURNING
    if velocity is not None:
        quiet &= np.linalg.norm(velocity, axis=1) < MOVING
    quiet &= steady(time, wrench[:, 3:])
    if not turning_known:
        quiet &= steady(time, wrench[:, 3:], limit=_NOISES * float(np.linalg.norm(noise_std(wrench[:, 3:]))))
    return _long_enough(time, quiet)


def steady(time: Array, values: Array, limit: float | None = None) -> Mask:
    """Return where `values` (N, 3) hardly change within 0.25 s, judged against the quietest tenth of the log.

    limit  largest local spread; None = three times that of the quietest tenth
    """
    step = median_step(time)
    width = max(round(_SHORTEST_S / step), 3)
    if len(time) < 2 * width:
        return np.ones(len(time), bool)
    sums = np.cumsum(np.concatenate([np.zeros((1, 3)), values - values.mean(0)]), 0)
    squares = np.cumsum(np.concatenate([np.zeros((1, 3)), (values - values.mean(0)) ** 2]), 0)
    mean = (sums[width:] - sums[:-width]) / width
    spread = np.sqrt(np.maximum((squares[width:] - squares[:-width]) / width - mean**2, 0).sum(1))
    least = float(np.quantile(spread, 0.1))
    calm = spread < (3 * least + 0.003 * float(np.linalg.norm(np.ptp(values, axis=0))) if limit is None else limit)
    # A row is steady when any window that holds it is.
    hits = np.cumsum(np.concatenate([[0], calm]))
    rows = np.arange(len(time))
    low, high = np.maximum(rows - width + 1, 0), np.minimum(rows, len(calm) - 1) + 1
    return np.asarray(hits[high] > hits[np.minimum(low, len(calm))])


def pose_numbers(time: Array, still: Mask) -> Integers:
    """Return a number per row (N,): one per still stretch, and one per block of the moving stretches between.

    Blocks are a twelfth of the log long, but no shorter than 0.3 s.
    """
    length = max((time[-1] - time[0]) / _BLOCKS, _SHORTEST_BLOCK_S)
    change = np.flatnonzero(np.diff(still)) + 1
    starts = np.concatenate([[0], change])
    stretch = np.searchsorted(change, np.arange(len(time)), "right")
    ends = np.concatenate([change, [len(time)]]) - 1
    spans = np.maximum(time[ends] - time[starts], 1e-9)
    parts = np.where(still[starts], 1, np.maximum(np.rint(spans / length), 1)).astype(np.int64)
    within = np.minimum((time - time[starts][stretch]) / spans[stretch] * parts[stretch], parts[stretch] - 1)
    first = np.concatenate([[0], np.cumsum(parts)[:-1]])
    return np.asarray(first[stretch] + within.astype(np.int64))


def _long_enough(time: Array, mask: Mask) -> Mask:
    """Return the mask without stretches shorter than 0.25 s."""
    starts, stops = runs(mask).T
    kept = np.zeros(len(mask), np.bool_)
    kept[mask] = np.repeat(time[stops - 1] - time[starts] >= _SHORTEST_S * 0.95, stops - starts)
    return kept
