"""Single poses that are wrong: away from the rows before them for a few rows, and back where those were."""

from __future__ import annotations

from functools import partial

import numpy as np

from steelyard.check import Array, Integers
from steelyard.findings import Finding
from steelyard.logs.recording import Stream
from steelyard.logs.strays import strays
from steelyard.sanity.rows.still_rows import WAY, angles

# [rad] A leap, as is one by WAY. Angles that wrap and are read in the wrong unit leap by 2 pi degrees.
TURN = float(np.radians(10))


def without_strays(stream: Stream) -> tuple[Stream, tuple[Finding, ...]]:
    """Return the stream without rows whose pose is away from those on both sides, which agree, and what was found."""
    if stream.time is None or "rotation" not in stream.channels:
        return stream, ()
    away = strays(len(stream), partial(_apart, stream))
    if not away.any():
        return stream, ()
    count = int(away.sum())
    at = stream.time[away] - stream.time[0]
    text = (
        f"The pose of '{stream.name}' is away from the rows before and after in {count} of {len(stream)} rows, "
        f"first at {at[0]:.2f} s; they were left out."
    )
    return stream.rows(~away), (Finding("outliers", text, "Nothing to do; check what tracks or logs the pose."),)


def _apart(stream: Stream, first: Integers, second: Integers) -> Array:
    """Return how far apart the poses of two rows each (K,) are, in leaps."""
    R = stream.channels["rotation"]
    apart = angles(np.swapaxes(R[first], 1, 2) @ R[second]) / TURN
    if "position" in stream.channels:
        place = stream.channels["position"]
        apart = np.maximum(apart, np.linalg.norm(place[second] - place[first], axis=1) / WAY)
    return np.asarray(apart)
