"""Shifts between how fast two robots turn: one throughout, one that grows steadily, or two, before and after a time.

Source: own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from steelyard.check import Array

# Shifts are steps of STEP_S; times at which a clock may have jumped are BIN_S apart, and a part is LEAST_S long at
# least; jumps are looked for up to LARGEST_S about the shift that fits best throughout [s].
STEP_S, BIN_S, LEAST_S, LARGEST_S = 0.01, 0.1, 2.5, 0.7
# By how much [s] a clock that is called must have jumped; either part's own shift leaves less by this factor than the
# other's; both together leave less than a shift that grows steadily; and robots turn alike but for this share.
JUMPS_S, FITS, BETTER, LEFT = 0.025, 2.0, 1.1, 0.5
WIDTH = round(BIN_S / STEP_S)


@dataclass(frozen=True)
class Split:
    """Two shifts [s] that together fit best, `before` the time `at` [s] and `after` it.

    left    share of how the speed varies that they leave
    fits    how many times as much either part is left by the other's shift, the lesser of the two
    both    what they leave in all, of `cost`
    cost    (S, K) what every shift leaves of every bin
    """

    at: float
    before: float
    after: float
    left: float
    fits: float
    both: float
    cost: Array

    @property
    def sure(self) -> bool:
        """Whether the clock jumped, and neither stands nor runs fast or slow throughout."""
        far = abs(self.after - self.before) > JUMPS_S
        if not (far and self.fits > FITS and self.left < LEFT):
            return False
        # A shift that grows or falls steadily, by up to all that is looked for, leaves much more.
        return best_line(self.cost, len(self.cost) - 1)[0] > BETTER * self.both


def best_split(x: Array, y: Array, common: int, most: int) -> Split | None:
    """Return the best split of two speeds (T,), by shifts within `most` steps of one that they have in common.

    Speeds are NaN where they tell nothing.
    """
    begin = most + max(-common, 0)
    x, y = x[max(-common, 0) :], y[max(common, 0) :]
    x, y = x[: len(y)], y[: len(x)]
    ends = round(LEAST_S / BIN_S)
    if len(x) * STEP_S < 2 * (LEAST_S + LARGEST_S) + BIN_S:
        return None
    cost, inner = costs(x, y, most, WIDTH), x[most:-most]
    # Bins in which any shift meets a speed that is not known tell nothing.
    cost[:, ~np.isfinite(cost).all(0)] = 0.0
    known = inner[np.isfinite(inner)]
    varied = float(((known - known.mean()) ** 2).sum()) if len(known) else 0.0
    least = 1e-12 * float(np.nansum(inner**2)) + 1e-300
    at = int((_leasts(cost)[:-1] + _leasts(cost[:, ::-1])[-2::-1])[ends : 1 - ends].argmin()) + ends
    sums, rest = cost[:, : at + 1].sum(1), cost[:, at + 1 :].sum(1)
    i, j = int(sums.argmin()), int(rest.argmin())
    one, two = max(float(sums[i]), least), max(float(rest[j]), least)
    before, after = (STEP_S * (k - most + common) for k in (i, j))
    return Split(
        STEP_S * begin + BIN_S * (at + 1), before, after,
        (one + two) / (varied + least),
        min(sums[j] / one, rest[i] / two), one + two, cost,
    )  # fmt: skip


@njit(cache=True)
def _leasts(cost: Array) -> Array:
    """Return what the best shift leaves of the bins (K,) up to each; cost (S, K)."""
    total, out = np.zeros(len(cost)), np.empty(cost.shape[1])
    for k in range(cost.shape[1]):
        total += cost[:, k]
        out[k] = total.min()
    return out


@njit(cache=True)
def costs(x: Array, y: Array, most: int, width: int) -> Array:
    """Return the squares (S, K) left between two speeds at every shift, summed over bins of `width` steps."""
    count, shifts = (len(x) - 2 * most) // width, 2 * most + 1
    out = np.zeros((count, shifts))
    # Shifts innermost: their sums do not wait for one another.
    for k in range(count):
        total = out[k]
        for t in range(k * width, (k + 1) * width):
            here, there = x[most + t], y[t : t + shifts]
            for shift in range(shifts):
                off = here - there[shift]
                total[shift] += off * off
    return out.T


@njit(cache=True)
def best_line(cost: Array, most: int) -> tuple[float, int, int]:
    """Return what shifts leave at the least that grow steadily over the bins by up to `most` steps, start, and growth.

    cost  (S, K) what every shift leaves of every bin
    """
    shifts, bins = cost.shape
    along, total = np.linspace(-0.5, 0.5, bins), np.empty(shifts)
    least, start, growth = np.inf, 0, 0
    for grows in range(-(most // 2) * 2, most + 1, 2):
        rows = np.rint(grows * along).astype(np.int64)
        low, high = -rows.min(), shifts - rows.max()
        total[:] = 0.0
        for k in range(bins):
            for first in range(low, high):
                total[first] += cost[first + rows[k], k]
        for first in range(low, high):
            if total[first] < least:
                least, start, growth = total[first], first, grows
    return least, start, growth
