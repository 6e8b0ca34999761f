"""Single poses that are wrong: away from the rows before them for a few rows, and back where those were."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array, Integers, Mask
from steelyard.findings import Finding
from steelyard.logs.recording import Stream
from steelyard.sanity.rows.still_rows import TURN, WAY, angles

# So many rows at most are away, by more than a leap (TURN, WAY) and so many times what lies between the rows beside.
LONGEST, BACK = 4, 5.0
# Poses of which more than this share are away are read wrongly, or tell no motion.
MOST = 0.05


def without_strays(stream: Stream) -> tuple[Stream, tuple[Finding, ...]]:
    """Return the stream without rows whose pose is away from those on both sides, which agree, and what was found."""
    if stream.time is None or "rotation" not in stream.channels:
        return stream, ()
    away = _away(stream)
    if not away.any() or away.mean() > MOST:
        return stream, ()
    count = int(away.sum())
    at = stream.time[away] - stream.time[0]
    text = (
        f"The pose of '{stream.name}' is away from the rows before and after in {count} of {len(stream)} rows, "
        f"first at {at[0]:.2f} s; they were left out."
    )
    return stream.rows(~away), (Finding("outliers", text, "Nothing to do; check what tracks or logs the pose."),)


def _away(stream: Stream) -> Mask:
    """Return which rows (N,) have a pose that is away."""
    rows, away = len(stream), np.zeros(len(stream), np.bool_)
    for length in range(1, LONGEST + 1):
        first = np.arange(1, rows - length)
        if not len(first):
            break
        leaps = np.minimum(_apart(stream, first - 1, first), _apart(stream, first + length - 1, first + length))
        found = first[(leaps > 1) & (leaps > BACK * _apart(stream, first - 1, first + length))]
        away[(found[:, None] + np.arange(length)).ravel()] = True
    return away


def _apart(stream: Stream, first: Integers, second: Integers) -> Array:
    """Return how far apart the poses of two rows each (K,) are, in leaps."""
    R = stream.channels["rotation"]
    apart = angles(np.swapaxes(R[first], 1, 2) @ R[second]) / TURN
    if "position" in stream.channels:
        place = stream.channels["position"]
        apart = np.maximum(apart, np.linalg.norm(place[second] - place[first], axis=1) / WAY)
    return np.asarray(apart)
