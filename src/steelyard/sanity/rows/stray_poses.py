"""Single poses that are wrong: away from the rows before them for a few rows, and back where those were."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array, Integers, Mask
from steelyard.findings import Finding
from steelyard.logs.recording import Stream
from steelyard.sanity.rows.still_rows import WAY, angles

# [rad] A leap, as is one by WAY. Angles that wrap and are read in the wrong unit leap by 2 pi degrees.
TURN = float(np.radians(10))
# So many rows at most are away, by more than a leap and so many times what lies between the rows beside.
LONGEST, BACK = 4, 5.0
# Where more than this share of the rows leap, poses are read wrongly, or were recorded one by one.
MOST = 0.1


def without_strays(stream: Stream) -> tuple[Stream, tuple[Finding, ...]]:
    """Return the stream without rows whose pose is away from those on both sides, which agree, and what was found."""
    if stream.time is None or "rotation" not in stream.channels:
        return stream, ()
    away = _away(stream)
    if not away.any():
        return stream, ()
    count = int(away.sum())
    at = stream.time[away] - stream.time[0]
    text = (
        f"The pose of '{stream.name}' is away from the rows before and after in {count} of {len(stream)} rows, "
        f"first at {at[0]:.2f} s; they were left out."
    )
    return stream.rows(~away), (Finding("outliers", text, "Nothing to do; check what tracks or logs the pose."),)


def _away(stream: Stream) -> Mask:
    """Return which rows (N,) have a pose that is away; none where poses leap often."""
    row, away = np.arange(len(stream)), np.zeros(len(stream), np.bool_)
    steps = _apart(stream, row[:-1], row[1:])
    leaps = steps > 1
    if leaps.sum() > MOST * len(steps):
        return away
    for length in range(1, LONGEST + 1):
        before = np.flatnonzero(leaps[:-length] & leaps[length:])
        smaller = np.minimum(steps[before], steps[before + length])
        found = before[smaller > BACK * _apart(stream, before, before + length + 1)]
        away[(found[:, None] + 1 + np.arange(length)).ravel()] = True
    return away


def _apart(stream: Stream, first: Integers, second: Integers) -> Array:
    """Return how far apart the poses of two rows each (K,) are, in leaps."""
    R = stream.channels["rotation"]
    apart = angles(np.swapaxes(R[first], 1, 2) @ R[second]) / TURN
    if "position" in stream.channels:
        place = stream.channels["position"]
        apart = np.maximum(apart, np.linalg.norm(place[second] - place[first], axis=1) / WAY)
    return np.asarray(apart)
