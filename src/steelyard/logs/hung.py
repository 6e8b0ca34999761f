"""Stretches of a log in which a driver hung: it repeats its last row, and jumps to where things are when it goes on."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array, Mask
from steelyard.logs.runs import lasting, runs

# Rows repeat the one before in no more than this share of what is beside those stretches: else the quantum is coarse.
REPEATING = 0.05
# The step after a stretch is so many times the usual one (median) in some column.
JUMPS = 5.0


def hung(values: Array, least: float, most: int | None = None) -> tuple[Mask, bool]:
    """Return the rows (N,) of stretches in which nothing of values (N, K) changes and that jump after; and if all jump.

    None are where values repeat elsewhere, too, or stand still more than `most` times. least  rows of a stretch
    """
    rows = np.zeros(len(values), np.bool_)
    same = (values[1:] == values[:-1]).all(1)
    long = lasting(same, least) if values.shape[1] else np.zeros_like(same)
    held = runs(long)
    if not len(held) or (most is not None and len(held) > most) or long.all() or same[~long].mean() > REPEATING:
        return rows, True
    steps = np.abs(np.diff(values, axis=0))
    typical = np.maximum(np.median(steps[~long], 0), 1e-300)
    jumping = [(a, b) for a, b in held.tolist() if b < len(steps) and (steps[b] > JUMPS * typical).any()]
    for first, last in jumping:
        rows[first : last + 1] = True
    return rows, len(jumping) == len(held)
