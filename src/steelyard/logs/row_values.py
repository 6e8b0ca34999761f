"""What tells in the raw values of a stream whether a row is a measurement."""

from __future__ import annotations

from typing import Any

import numpy as np

from steelyard.check import Array, Mask
from steelyard.logs.clipping import LEFT_OUT, MOST_LEFT_OUT, TOO_MANY
from steelyard.logs.recording import Stream
from steelyard.logs.runs import runs

NOISY = ("force", "torque", "specific_force")


def left_out(stream: Stream, rows: Mask) -> tuple[Stream, str]:
    """Return the stream without `rows` (N,), or all of it where they are too many, and what was done in words."""
    if rows.mean() > MOST_LEFT_OUT:
        return stream, TOO_MANY
    return stream.rows(~rows) if rows.any() else stream, LEFT_OUT


def columns_of(stream: Stream) -> Array:
    """Return all channels side by side (N, K), without those that never change."""
    values = np.concatenate([v.reshape(len(v), -1) for v in stream.channels.values()], 1)
    return np.asarray(values[:, (values != values[0]).any(0)])


def run_lengths(mask: Mask) -> np.ndarray[Any, np.dtype[np.int64]]:
    """Return for each true entry the length of its run of true entries, zero elsewhere."""
    lengths = np.ptp(runs(mask), axis=1)
    out = np.zeros(len(mask), np.int64)
    out[mask] = np.repeat(lengths, lengths)
    return out
