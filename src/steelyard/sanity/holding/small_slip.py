"""A small slip: from some time on the same body sits a few millimetres elsewhere in the gripper.

It is too small to stand out of the tolerance for hands (`load_change`), but rows that were fitted as one body show it:
from one time on a first moment of its own takes much of the residual away. Errors of calibration hang on orientation
and not on time; a step in time takes little of theirs, and not the same where stretches are left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from steelyard.check import Array, Mask
from steelyard.findings import Finding
from steelyard.identify.cost.linear import inverse_scaled
from steelyard.logs.log import MotionLog
from steelyard.sanity.fitted.full_fit import RANK, Rows
from steelyard.sanity.holding.load_change import SHORTEST, first_after, longer_side, slip_words

# Either side must hold this many rows.
FEWEST = 12
# Of the squared residual of one body with a drift, a slip leaves no more than this share, and takes so many times as
# much away as a bias that jumps at that time, and as a gravity that is tilted.
LEFT, BESIDE_JUMP, BESIDE_TILT = 0.9, 1.5, 2.0
# A bias that jumps as well takes no more beyond it than this share of what it takes: 0.015 beside slips, from 0.15 on
# beside what only looks like one.
JUMP_TOO = 0.1
# It must be this sure by leaving out stretches, no less, and no more: who loses an object has not slipped [m].
SURE, SMALLEST, LARGEST = 12.0, 1e-3, 0.1
_FIRST = slice(1, 4)  # where phi and the rows have the first moment


@dataclass(frozen=True, eq=False)
class Slip:
    """At `time` [s] the centre of mass moved by `moved` (3,) [m], `std` (3,) [m] by leaving out stretches."""

    time: float
    moved: Array
    std: Array

    def longer_side(self, log: MotionLog) -> tuple[Mask, Finding]:
        """Return the rows (N,) of the longer part of the log, and what is to be said."""
        time = np.zeros(0) if log.time is None else log.time
        return longer_side(time, self.time, slip_words(float(np.linalg.norm(self.moved))), slipped=True)


def small_slip(log: MotionLog, rotation: Array | None = None, gravity: Array | None = None) -> Slip | None:
    """Return the slip that explains much of what one body leaves of a log, and no rival does; None where there is none.

    log       the rows that would be fitted, in order of time
    rotation  (N, 3, 3) S to W at the rows, and gravity (3,) [m/s^2] in W, where they are known
    """
    time = log.time
    if time is None or len(log) < 2 * FEWEST or time[-1] - time[0] < 2 * SHORTEST or (np.diff(time) < 0).any():
        return None
    rows, pick = Rows.of(log, drift=True)
    when = _best(rows)
    if when is None:
        return None
    late = (np.asarray(rows.log.time) > when)[:, None, None]
    jump, moment = np.broadcast_to(late * np.eye(6), (len(late), 6, 6)), rows.columns[:, :, _FIRST] * late
    steady, jumped = rows.solve(), rows.solve(jump)
    found = rows.solve(moment, jackknife=True)
    taken = steady.left - found.left
    if found.left > LEFT * steady.left or taken < BESIDE_JUMP * (steady.left - jumped.left) or found.phi[0] <= 0:
        return None
    if found.left - rows.solve(np.concatenate([moment, jump], 2)).left > JUMP_TOO * taken:
        return None
    if rotation is not None and gravity is not None:
        tilted = rows.solve(rows.tilting(steady.phi, rotation[pick], gravity))
        if taken < BESIDE_TILT * (steady.left - tilted.left):
            return None
    moved, std = found.extra / found.phi[0], found.extra_std / found.phi[0]
    sure = bool((np.abs(moved) > SURE * std).any())
    return Slip(when, moved, std) if sure and SMALLEST < np.linalg.norm(moved) < LARGEST else None


def _best(rows: Rows) -> float | None:
    """Return the time [s] from which a first moment of its own leaves least."""
    time = np.asarray(rows.log.time)
    both = np.concatenate([rows.columns, rows.values[:, :, None]], 2) * np.sqrt(rows.weights)[:, :, None]
    # Row j of `after` sums over rows j and on: with it, the equations of a step at any row are known.
    after = np.cumsum((np.swapaxes(both, 1, 2) @ both)[::-1], axis=0)[::-1]

    j = first_after(time, lambda j: _left(after[0], after[j]), FEWEST)
    return None if j is None else float(time[j - 1] + time[j]) / 2


def _left(whole: Array, late: Array) -> float:
    """Return the weighted squared residual with first moments anew in the rows summed in `late` (p + 1, p + 1)."""
    p = len(whole) - 1
    H = np.block([[whole[:p, :p], late[:p, _FIRST]], [late[_FIRST, :p], late[_FIRST, _FIRST]]])
    g = np.append(whole[:p, p], late[_FIRST, p])
    return float(whole[p, p] - g @ inverse_scaled(H, RANK) @ g)
