"""What a filter takes that makes a wrench late: a delay is put right, but not what was taken.

A filter of first order that is late by `late` [s] leaves 1 / sqrt(1 + (2 pi f late)^2) of a frequency f, a mean over
the last samples about as much, a slow bus all of it. No log tells them apart by much: the noise of accelerations, which
grows with f, lowers what seems to follow, too.
"""

from __future__ import annotations

import numpy as np

from steelyard.check import Array

# A filter is behind none to all of a delay, all shares alike likely: the mean square of what it takes away.
SHARE = 1 / 3


def taken(frequency: Array, late: float | Array) -> Array:
    """Return what a filter of first order that is `late` [s] takes at `frequency` [Hz], as a share of what it leaves.

    Frequencies and delays of any shapes that broadcast.
    """
    return np.asarray(np.sqrt(1 + (2 * np.pi * frequency * late) ** 2) - 1)
