"""Intervals of time (K, 2) [s]: their union, and which times lie in them."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array, Mask


def merged(*groups: Array) -> Array:
    """Return the union of groups of intervals (K, 2) as disjoint intervals in order."""
    parts = np.concatenate([np.zeros((0, 2)), *groups])
    parts = parts[np.argsort(parts[:, 0])]
    if len(parts) < 2:
        return parts
    ends = np.maximum.accumulate(parts[:, 1])
    first = np.concatenate([[True], parts[1:, 0] > ends[:-1]])
    last = np.concatenate([first[1:], [True]])
    return np.stack([parts[first, 0], ends[last]], 1)


def inside(time: Array, intervals: Array) -> Mask:
    """Return which of `time` (N,) lie in disjoint, ordered intervals (K, 2)."""
    edges = intervals.ravel()
    return np.asarray(np.searchsorted(edges, time, "right") % 2 == 1)
