"""Rows of still poses: which belong together, and their means over windows of time or of rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from steelyard.check import Array, Integers, Mask
from steelyard.logs.recording import Stream
from steelyard.spatial import Rotation

_KEPT = ("force", "torque", "rotation", "gravity", "specific_force")


def spans(stretch: Integers) -> Integers:
    """Return the first row and the last + 1 of every stretch of a number per row (N,), which never falls (K, 2)."""
    edges = np.flatnonzero(np.diff(stretch)) + 1
    return np.stack([np.concatenate([[0], edges]), np.concatenate([edges, [len(stretch)]])], 1)


def angles(matrices: Array) -> Array:
    """Return the angle (N,) [rad] of rotations (N, 3, 3)."""
    cosine = (np.trace(matrices, axis1=1, axis2=2) - 1) / 2
    return np.asarray(np.arccos(np.clip(cosine, -1.0, 1.0)))


def split(rests: Array, length: float) -> Array:
    """Return the begin and end (W, 2) of even parts of about `length` of every rest (K, 2); an empty rest has none."""
    out = []
    for begin, end in rests:
        if end >= begin:
            edges = np.linspace(begin, end, max(round((end - begin) / length), 1) + 1)
            # The row on an inner edge belongs to the part that begins there.
            out.append(np.stack([edges[:-1], np.append(np.nextafter(edges[1:-1], -np.inf), end)], 1))
    return np.concatenate(out) if out else np.zeros((0, 2))


def as_table(streams: Sequence[Stream], windows: Array) -> tuple[tuple[Stream, ...], int]:
    """Return streams with clocks as tables of still poses, means over the windows (W, 2) that all fill, and how many.

    Channels that tell only of motion are left out, and streams without any other.
    """
    tables = [_averaged(s, windows) for s in streams if set(_KEPT) & s.channels.keys()]
    full = np.logical_and.reduce([filled for _, filled in tables])
    return tuple(stream.rows(full) for stream, _ in tables), int(full.sum())


def _averaged(stream: Stream, windows: Array) -> tuple[Stream, Mask]:
    """Return the stream as a table of means over windows (W, 2) [s], and which windows (W,) hold any of its rows."""
    if stream.time is None:
        return stream, np.ones(len(stream), np.bool_)
    first = np.searchsorted(stream.time, windows[:, 0], "left")
    last = np.searchsorted(stream.time, windows[:, 1], "right")
    full = last > first
    channels = {q: _means(v, first, last) for q, v in stream.channels.items() if q in _KEPT}
    if "rotation" in channels:
        channels["rotation"][full] = Rotation.nearest(channels["rotation"][full]).matrix
    return replace(stream, channels=channels, time=None, poses=True, delay=None), full


def _means(values: Array, first: Integers, last: Integers) -> Array:
    """Return the mean (W, ..) of rows first..last - 1 of values (N, ..); zero where there are none."""
    sums = np.concatenate([np.zeros_like(values[:1]), np.cumsum(values - values[:1], axis=0)])
    count = np.maximum(last - first, 1).reshape(-1, *(1,) * (values.ndim - 1))
    return np.asarray((sums[last] - sums[first]) / count + values[:1])
