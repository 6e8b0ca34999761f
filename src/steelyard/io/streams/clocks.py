"""Stamps of all streams become seconds after one common origin, without losing the digits of large stamps.

They stand in one column or, as ROS writes them, in two: whole seconds, and the nanoseconds above them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from steelyard import check
from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.io.streams.channels import require_finite, unfit_text
from steelyard.io.units import TIME
from steelyard.logs.clock import usual_step

_FEW_STEPS = 10
# Signals are put on even stamps: a clock that was set in the middle of a log would make them fill the memory.
_LONGEST_S = 3 * 86400.0  # from the first row to the last
_MOST_STEPS, _MOST_HOLES = 20e6, 10.0  # in steps of the rows' median, and beside the number of rows
# Excel counts days since 1900: these are 2000 to 2100. No log has 50 000 rows a second in just these seconds.
_DAYS, _FASTEST = (36526.0, 73051.0), 2e-5
_LARGE = 1e6  # [s] stamps below this keep their own origin: float64 holds them to a nanosecond


# Counters of drivers begin anew at the end of their range: bits, and counts a second. A fall is theirs where stamps
# before and after it are within so many steps of both ends.
_BITS, _COUNTS, _WITHIN_STEPS = (16, 32), (TIME["ms"], TIME["us"], TIME["ns"]), 10

Stamps = np.ndarray[Any, np.dtype[Any]]


@dataclass(frozen=True, eq=False)
class Clock:
    """Stamps as the file holds them (N,), int64 or float64; `per_second` of them make a second.

    `missing` (N,) marks rows without a stamp, which hold that of a neighbour and are NaN as seconds; None has none.
    """

    stamps: np.ndarray[Any, np.dtype[Any]]
    per_second: int
    where: str
    missing: np.ndarray[Any, np.dtype[np.bool_]] | None = None

    @classmethod
    def of(cls, column: np.ndarray[Any, np.dtype[Any]], unit: str, where: str, gaps: bool = False) -> Clock:
        """Return the clock of a time column in `unit`; with `gaps` stamps may be missing, but not all of them.

        Stamps with a date, datetime64[ns], need no unit.
        """
        missing = ~np.isfinite(column)
        if missing.any() and (missing.all() or not gaps):
            raise BadValue(unfit_text(np.flatnonzero(missing), len(column), where))
        dated = column.dtype.kind == "M"
        column, per_second = (column.astype(np.int64), TIME["ns"]) if dated else (column, TIME[unit])
        if not missing.any():
            return cls(_counted_on(column, per_second), per_second, where)
        known = np.where(missing, 0, np.arange(len(column)))
        latest = np.maximum.accumulate(known)
        latest[: np.argmin(missing)] = np.argmin(missing)
        return cls(_counted_on(column[latest], per_second), per_second, where, missing)

    def __post_init__(self) -> None:
        if self.stamps.dtype.kind != "i":
            require_finite(self.stamps, self.where)
        steps = np.diff(self.stamps)
        falls = np.flatnonzero(steps < 0)
        if len(falls):
            i = int(falls[0])
            times = f"{len(falls)} times, first" if len(falls) > 1 else "once,"
            before, after = self.stamps[i], self.stamps[i + 1]
            raise BadValue(
                f"{self.where}: time must not go back; it does {times} from {before} in row {i + 1} "
                f"to {after} in row {i + 2}. If the rows are out of order, sort them; if the clock was set back, "
                "add that to the times from there on, or leave out the rows that overlap."
            )
        if len(steps) and not steps.any():
            raise BadValue(
                f"{self.where}: time stands still at {self.stamps[0]} in all {len(self.stamps)} rows. "
                "Name the column of the clock, or give time = { rate = .. }."
            )
        if len(steps) > _FEW_STEPS:
            self._refuse_days()
            step = usual_step(steps) / self.per_second
            check.likely_step(step, self.where)
            self._refuse_jumps(steps, step)

    def _refuse_days(self) -> None:
        """Raise BadValue where the stamps are Excel's dates: days, whose fractions would pass for seconds."""
        first, last = float(self.stamps[0]), float(self.stamps[-1])
        step = (last - first) / (len(self.stamps) - 1)
        if self.per_second == 1 and _DAYS[0] <= first and last < _DAYS[1] and step < _FASTEST:
            raise BadValue(
                f"{self.where}: these look like Excel's dates, counted in days: {first:.10g} to {last:.10g}. Add a "
                "column of seconds, = (A2 - A$2) * 86400 formatted as a number with all its digits, and name that one."
            )

    def _refuse_jumps(self, steps: np.ndarray[Any, np.dtype[Any]], step: float) -> None:
        """Raise BadValue where stamps `step` [s] apart leap so far that the clock was set, or two logs were joined."""
        span = float(steps.sum()) / self.per_second
        if span > min(_LONGEST_S, step * max(_MOST_STEPS, _MOST_HOLES * len(steps))):
            i = int(np.argmax(steps))
            leap = float(steps[i]) / self.per_second
            raise BadValue(
                f"{self.where}: time jumps by {leap:.3g} s from row {i + 1} to row {i + 2}, "
                f"where rows are {step:.2g} s apart: the clock was set, or two logs were joined. Cut the log there."
            )

    def seconds_after(self, origin: int) -> Array:
        """Return (N,) [s] after `origin` [s]; integers are subtracted as integers."""
        seconds = (self.stamps - origin * self.per_second) / self.per_second
        return check.frozen(seconds if self.missing is None else np.where(self.missing, np.nan, seconds))

    @property
    def first_second(self) -> int:
        """The last whole second before the first stamp."""
        return int(self.stamps[0] // self.per_second)


def _counted_on(stamps: np.ndarray[Any, np.dtype[Any]], per_second: int) -> np.ndarray[Any, np.dtype[Any]]:
    """Return stamps (N,), counted on where the counter behind them began anew at the end of its range."""
    steps = np.diff(stamps)
    falls = steps < 0
    if not falls.any() or not (steps > 0).any():
        return stamps
    near = _WITHIN_STEPS * usual_step(steps[~falls])
    for bits, counts in product(_BITS, _COUNTS):
        period = 2**bits * per_second / counts
        last, first = stamps[:-1][falls], stamps[1:][falls]
        if (
            near < period / 4
            and (last > period - near).all()
            and (last <= period).all()
            and (np.abs(first) < near).all()
        ):
            whole = int(period) if stamps.dtype.kind == "i" and period.is_integer() else period
            return np.asarray(stamps + whole * np.concatenate([[0], np.cumsum(falls)]))
    return stamps


def common_origin(clocks: Sequence[Clock]) -> int:
    """Return the whole second to subtract from every clock: the earliest, or 0 where the stamps are small."""
    earliest = min((clock.first_second for clock in clocks), default=0)
    return earliest if abs(earliest) > _LARGE else 0


def one_column(columns: Sequence[Stamps], units: Sequence[str], where: str) -> Stamps:
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
