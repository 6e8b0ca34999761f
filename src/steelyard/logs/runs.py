"""Rows of a log: runs of those for which something holds, which are alike, and a few picked evenly."""

from __future__ import annotations

import numpy as np

from steelyard.check import Integers, Mask


def runs(mask: Mask) -> Integers:
    """Return the first row and the last + 1 of every run of True in a mask (N,), in order (R, 2)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return np.asarray(edges.reshape(-1, 2), np.int64)


def lasting(mask: Mask, least: float) -> Mask:
    """Return a mask (N,) without runs of fewer than `least` rows."""
    lengths, out = np.ptp(runs(mask), axis=1), mask.copy()
    out[mask] = np.repeat(lengths >= least, lengths)
    return out


def around(steps: Mask) -> Mask:
    """Return the rows (N,) before and after these steps (N - 1,) from one row to the next."""
    return np.asarray(np.concatenate([[False], steps]) | np.concatenate([steps, [False]]))


def distinct_rows(mask: Mask) -> tuple[Mask, Integers]:
    """Return the different rows (C, M) of a mask (N, M), in order, and which of them each row (N,) is."""
    if len(mask) and (mask == mask[0]).all():
        return mask[:1], np.zeros(len(mask), np.int64)
    changes = np.ones(len(mask), np.bool_)
    changes[1:] = (mask[1:] != mask[:-1]).any(1)
    # Rows are mostly like the one before: only the first of each run is sorted.
    found, first = np.unique(mask[changes], axis=0, return_inverse=True)
    return found, first.ravel()[np.cumsum(changes) - 1]


def stretches(rows: int, count: int) -> Integers:
    """Return which of `count` even stretches each of so many rows (N,) is in."""
    return np.arange(rows) * count // max(rows, 1)


def picked(rows: int, most: int) -> Integers:
    """Return the numbers (k,) of at most `most` rows, spread evenly over all from the first to the last."""
    return np.unique(np.linspace(0, rows - 1, min(rows, most)).astype(np.int64))
