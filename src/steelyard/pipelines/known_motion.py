"""Rows whose acceleration is known: all of them, or those at rest where no stream measures it as the load felt it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.identify.rest import RIPPLE
from steelyard.logs.alignment import Aligned
from steelyard.logs.log import MotionLog, Noise

# Poses at rest that fix mass, centre of mass and bias without any help from rows in motion.
FEWEST_POSES = 4


def with_known_acceleration(log: MotionLog, aligned: Aligned, mistimed: bool) -> tuple[MotionLog, tuple[str, ...]]:
    """Return the rows whose acceleration is known, and a note where that leaves some out.

    Without a measured acceleration, or with one that the load did not feel (`mistimed`), only rows at rest are known.
    Where they are in too few poses, all rows are taken, without a measured acceleration as if at rest: what that misses
    counts as noise of the wrench. A moving body then looks touched, but is not.
    """
    measured = aligned.acceleration_from != "none"
    if (measured and not mistimed) or log.still.all():
        return log, ()
    if len(np.unique(log.pose[log.still])) >= FEWEST_POSES:
        at_rest = log.rows(log.still)
        at_rest = replace(at_rest, angular_acceleration=np.zeros_like(at_rest.angular_acceleration))
        why = "the accelerations are not those of the load" if measured else "no stream measures the acceleration"
        return at_rest, (f"{why}: only the rows at rest were used",)
    if measured:
        return log, ()
    quiet = None if log.noise is None else tuple(Noise(np.minimum(n.acceleration, RIPPLE), n.wrench) for n in log.noise)
    return replace(log, noise=quiet), ("no stream measures the acceleration: it was taken as zero throughout",)
