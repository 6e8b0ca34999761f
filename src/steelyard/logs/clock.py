"""The clock of a log: the stamps of a stream, how far apart they are, and how many there are per second."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from steelyard import check
from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.logs.middles import median

# A gap of the stamps is a jump's where it is as long to within so much and so near to where delays change [s].
SAME_S, NEAR_S = 0.05, 1.0
# [s] to either side of a jump that leaves no gap, in which rows are left out.
UNSURE_S = 0.3


def seconds(time: ArrayLike) -> Array:
    """Return stamps of any kind as [s]: datetime64 since 1970, timedelta64, or numbers, which are seconds already."""
    stamps = np.asarray(time)
    if stamps.dtype.kind not in "mM":
        return check.finite("time", time)
    counts = stamps.astype(f"{stamps.dtype.kind}8[ns]").astype(np.int64)
    return check.finite("time", np.where(np.isnat(stamps), np.nan, counts * 1e-9))


def usual_step(steps: np.ndarray[Any, np.dtype[Any]]) -> float:
    """Return how far rows are apart by steps (N-1,), not all zero: of a coarse clock, many rows share a stamp."""
    usual = float(median(steps))
    if usual > 0:
        return usual
    ticks = steps[steps > 0]
    return float(median(ticks)) * len(ticks) / len(steps)


def median_step(time: Array) -> float:
    """Return the usual step [s] of a clock (N,), of two stamps or more that are not all one."""
    return usual_step(np.diff(time))


def sampling_rate(time: Array) -> float:
    """Return the median sampling rate [Hz] of a rising clock (N,) [s]; raises BadValue below two samples."""
    if len(time) < 2:
        raise BadValue("a clock needs at least two samples.")
    return 1.0 / median_step(time)


def jump_gap(time: Array, size: float, near: float, same: float = SAME_S) -> int | None:
    """Return the row after which stamps (N,) leave a gap, as of a clock that leaps `size` [s] ahead `near` a time [s].

    The size is good to `same` [s]; None where there is no such gap.
    """
    step, usual = np.diff(time), median_step(time)
    # Within the gap there are no rows to tell more closely where it is.
    off = np.maximum(np.maximum(time[:-1] - near, near - time[1:]), 0.0)
    fits = (np.abs(step - usual - size) < same) & (off < NEAR_S)
    fits &= step > max(size / 2, 0.0) + usual
    return int(np.argmin(np.where(fits, off, np.inf))) if size > 0 and fits.any() else None
