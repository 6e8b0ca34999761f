"""Stamps in two columns, as ROS writes them: whole seconds, and the nanoseconds above them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from steelyard.errors import BadValue
from steelyard.io.units import TIME

Column = np.ndarray[Any, np.dtype[Any]]


def one_column(columns: Sequence[Column], units: Sequence[str], where: str) -> Column:
    """Return stamps (N,): one column as it is; two, in `units` of time, added as datetime64[ns], NaT where one misses.

    Integers are added, because a float64 holds no nanoseconds since 1970. Raises BadValue where the larger unit is not
    whole, or the smaller one does not count from zero up to it.
    """
    if len(columns) == 1:
        return columns[0]
    if any(column.dtype.kind == "M" for column in columns):
        raise BadValue(f"{where}: a date with its time of day is a whole stamp. Name its column alone, with one unit.")
    known = np.isfinite(columns[0]) & np.isfinite(columns[1])
    large, small = (np.where(known, column, 0) for column in columns)
    scale, step = (TIME["ns"] // TIME[unit] for unit in units)
    fits = (np.abs(large) < 2**62 // scale) & (small >= 0) & (small < scale // step)
    bad = ~fits | (large != np.round(large)) | (small != np.round(small))
    if bad.any():
        row = int(bad.argmax())
        raise BadValue(
            f"{where}: two columns of time must be whole {units[0]}, and whole {units[1]} from 0 to "
            f"{scale // step - 1}; row {row + 1} holds {large[row]} and {small[row]}. "
            "Correct the columns or their units."
        )
    total = large.astype(np.int64) * scale + small.astype(np.int64) * step
    return np.where(known, total.astype("M8[ns]"), np.datetime64("NaT", "ns"))
