"""Runs: rows one after the other for which something holds."""

from __future__ import annotations

import numpy as np

from steelyard.check import Integers, Mask


def runs(mask: Mask) -> Integers:
    """Return the first row and the last + 1 of every run of True in a mask (N,), in order (R, 2)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return np.asarray(edges.reshape(-1, 2), np.int64)
