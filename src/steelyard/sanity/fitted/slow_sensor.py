"""A slow sensor: the filter that makes its wrench late makes it too small as well, where it is quick."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.check import Array
from steelyard.findings import about
from steelyard.identify.estimate import Estimate
from steelyard.logs.clock import median_step
from steelyard.logs.conditioning import FILTERED, signal, taken_by_filter
from steelyard.logs.log import MotionLog
from steelyard.sanity.fitted.full_fit import Rows
from steelyard.sanity.fitted.seen_motion import moves

# It is said where it is so large beside the bars that are.
WORTH_SAYING = 1.0


def allow_filter(log: MotionLog, estimate: Estimate, late: float) -> Estimate:
    """Return the estimate with bars that hold what a filter may take away which makes the wrench `late` [s]."""
    if late <= 0 or log.time is None or not moves(log):
        return estimate
    rows, pick = Rows.of(log)
    lost = taken_away(log.time, log.predicted(rows.solve().phi), late)
    moved = np.sqrt(FILTERED) * replace(rows, values=lost[pick]).solve().phi
    wider = estimate.allowing(moved)
    known = estimate.identified
    if not (wider.std[known] > np.hypot(1, WORTH_SAYING) * estimate.std[known]).any():
        return wider
    return wider.noted(
        f"the wrench is {about(1e3 * late)} ms late: a filter that makes it so takes of quick motion, too; error bars "
        "hold what that may change"
    )


def taken_away(time: Array, wrench: Array, late: float) -> Array:
    """Return what a filter of first order that is `late` [s] had taken away (N, 6) for `wrench` (N, 6) to be left."""
    step = median_step(time)
    even = np.arange(time[0], time[-1] + step / 2, step)
    values = signal(time, wrench).at(even)
    # There and back, so that the ends meet.
    loop = np.concatenate([values, values[::-1]])
    frequency = np.asarray(np.fft.rfftfreq(len(loop), step)[:, None], np.float64)
    lost = taken_by_filter(frequency, late)
    return signal(even, np.fft.irfft(lost * np.fft.rfft(loop, axis=0), len(loop), axis=0)[: len(even)]).at(time)
