"""A soft arm: its structure lags behind the encoders, and accelerates the load more than they say.

Below its first mode, at f0, a structure that is driven by a(t) moves the load by a - a''/(2 pi f0)^2, and so changes
the wrench w to w - w''/(2 pi f0)^2. A slow filter of the force does the contrary. Either looks like inertia.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from steelyard.check import Array
from steelyard.identify.estimate import Estimate
from steelyard.logs.conditioning import signal
from steelyard.logs.log import MotionLog
from steelyard.sanity.fitted.full_fit import Rows
from steelyard.sanity.fitted.seen_motion import moves

# It is said beyond so many standard deviations, by leaving out stretches, and where it leaves less of the residual.
SURE, LEFT = 6.0, 0.995
# [Hz] the second derivative is taken below this; poses tell it no better.
SLOW = 8.0
# [s^2] Where none is seen, an arm may still have its first mode near 16 Hz, which moves an inertia by a bar of its own.
USUAL = 1e-4


@dataclass(frozen=True, eq=False)
class Softness:
    """How the wrench follows its own second derivative.

    follows, std  [s^2] negative for a soft arm, positive for a slow filter, and its standard deviation
    left          squared residual beside that without
    moved         (10,) what the parameters are less with it
    """

    follows: float
    std: float
    left: float
    moved: Array

    @property
    def possible(self) -> float:
        """How far the wrench may follow [s^2], rms, beside what arms usually do."""
        share = USUAL**2 / (USUAL**2 + self.std**2)
        return float(np.hypot(share * self.follows, np.sqrt(share) * self.std))


def softness(log: MotionLog) -> Softness | None:
    """Return how soft the arm is that moved the load; None for too few moving rows, no clock or dead channels."""
    if log.time is None or not moves(log):
        return None
    rows, pick = Rows.of(log)
    once = rows.solve()
    even = np.arange(log.time[0], log.time[-1], 1 / (8 * SLOW))
    slow = signal(log.time, log.predicted(once.phi), SLOW).at(even)
    bends = np.gradient(np.gradient(slow, even, axis=0), even, axis=0)
    bends = signal(even, bends).at(log.time[pick])[:, :, None]
    fit = rows.solve(bends, jackknife=True)
    return Softness(float(fit.extra[0]), float(fit.extra_std[0]), fit.beside(once), once.phi - fit.phi)


def allow_softness(log: MotionLog, estimate: Estimate) -> Estimate:
    """Return the estimate with bars that hold what a soft arm or a slow filter moves it by.

    That is all of it where the log shows one, and else what a usual arm and the log leave possible.
    """
    found = softness(log)
    if found is None or found.follows == 0:
        return estimate
    if abs(found.follows) < SURE * found.std or found.left > LEFT:
        return estimate.allowing(found.moved * found.possible / found.follows)
    rate = 1 / (2 * np.pi * np.sqrt(abs(found.follows)))
    what = f"an arm with its first mode near {rate:.0f} Hz" if found.follows < 0 else "a slow filter of the force"
    return estimate.allowing(found.moved).noted(
        f"the wrench bends with the motion as with {what}; error bars hold what that changes"
    )
