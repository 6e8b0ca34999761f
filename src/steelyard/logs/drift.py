"""How the offset of a sensor drifts: in a line, or, as one does that warms up, ever slower toward where it settles."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array

# A drift in a line never settles.
STEADILY = float("inf")
# Time constants in which an offset may settle, as shares of the log: slower ones look like a line.
SETTLING = (1 / 24, 1 / 16, 1 / 11, 1 / 7.5, 1 / 5, 1 / 3.5, 1 / 2, 1.0)


def settled_course(time: Array, settling: float) -> Array:
    """Return a drift from -1 to 1 over the times (N,) [s], which settles with a time constant `settling` [s]."""
    start, span = float(time.min()), max(float(np.ptp(time)), 1e-9)
    if settling == STEADILY:
        return np.asarray(2 * (time - start) / span - 1)
    return np.asarray(2 * np.expm1((start - time) / settling) / np.expm1(-span / settling) - 1)
