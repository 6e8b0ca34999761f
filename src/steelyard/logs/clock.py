"""The clock of a log: the stamps of a stream, how far apart they are, and how many there are per second."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from steelyard import check
from steelyard.check import Array
from steelyard.errors import BadDescription, BadValue
from steelyard.logs.recording import Stream

# A gap of the stamps is a jump's where it is as long to within so much and so near to where delays change [s].
SAME_S, NEAR_S = 0.05, 1.0
# [s] to either side of a jump that leaves no gap, in which rows are left out.
UNSURE_S = 0.3
# [s] Rows of a force-torque log are not closer or further apart than this; else the unit of time is another one.
CLOSEST_S, FURTHEST_S = 1e-7, 3600.0


def stamps_of(stream: Stream) -> Array:
    """Return the stamps (N,) [s] of a stream; raises BadDescription where it has none."""
    if stream.time is None:
        raise BadDescription(f"'{stream.name}' has no time; streams with their own rows need a clock.")
    return stream.time


def seconds(time: ArrayLike) -> Array:
    """Return stamps of any kind as [s]: datetime64 since 1970, timedelta64, or numbers, which are seconds already."""
    stamps = np.asarray(time)
    if stamps.dtype.kind in "mM":
        return check.frozen(stamps.astype(f"{stamps.dtype.kind}8[ns]").astype(np.int64) * 1e-9)
    return check.finite("time", time)


def require_likely_step(step: float, where: str) -> None:
    """Raise BadValue where rows `step` [s] apart show that the unit of time is another one."""
    if not CLOSEST_S <= step <= FURTHEST_S:
        raise BadValue(
            f"{where}: rows are {step:.2g} s apart, which no force-torque log is. Correct the unit of time "
            "(s, ms, us, ns; arrays are in s: of nanoseconds give (ns - first) * 1e-9, one `first` for all), the "
            "column or the rate."
        )


def median_step(time: Array) -> float:
    """Return the median step [s] of a clock (N,), of two stamps or more."""
    return float(np.median(np.diff(time)))


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
