"""Single poses that are wrong: away from the rows before them for a few rows, and back where those were."""

from __future__ import annotations

import numpy as np

from steelyard.check import Mask
from steelyard.findings import Finding
from steelyard.logs.clock import usual_step
from steelyard.logs.recording import Stream
from steelyard.logs.strays import strays

# Leaps of a rotation matrix (10 degrees: angles that wrap, read in the wrong unit, leap by 2 pi degrees), and of a
# position [m].
LEAST = {"rotation": 0.25, "position": 5e-3}


def without_strays(stream: Stream) -> tuple[Stream, tuple[Finding, ...]]:
    """Return the stream without rows whose pose is away from those on both sides, which agree, and what was found."""
    if stream.time is None or "rotation" not in stream.channels or len(stream) < 2:
        return stream, ()
    away = _away(stream, usual_step(np.diff(stream.time)))
    if not away.any():
        return stream, ()
    count = int(away.sum())
    at = stream.time[away] - stream.time[0]
    text = (
        f"The pose of '{stream.name}' is away from the rows before and after in {count} of {len(stream)} rows, "
        f"first at {at[0]:.2f} s; they were left out."
    )
    return stream.rows(~away), (Finding("outliers", text, "Nothing to do; check what tracks or logs the pose."),)


def _away(stream: Stream, step: float) -> Mask:
    """Return which rows (N,), so long [s] apart, have a rotation or a position that is away."""
    parts = [(stream.channels[name], least) for name, least in LEAST.items() if name in stream.channels]
    return np.asarray(np.any([strays(part.reshape(len(stream), -1), step, least) for part, least in parts], axis=0))
