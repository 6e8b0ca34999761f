"""Values at the end of a channel's range: the true ones were beyond.

A value that comes again proves nothing by itself: a coarse quantum and a noise-free simulation repeat. The extreme one
is compared with those beside it.
"""

from __future__ import annotations

import numpy as np

from steelyard.check import Array, Integers, Mask
from steelyard.findings import Finding
from steelyard.logs.conditioning import noise_variances
from steelyard.logs.recording import Stream

# A channel is clipped when its extreme value comes up this often and at least five times as often as its neighbours.
CLIPPED_ROWS, CLIPPED_SHARE, CLIPPED_RATIO = 10, 0.003, 5
# Measured channels carry noise of more than this share of their range; simulated ones without noise do not.
NOISE_SHARE = 1e-5
# Rows from which on, and in blocks of which, noise is told.
_FEWEST, _NOISE_BLOCK = 7, 50
# What is left of a stream that loses more rows than this share is no fair sample: then none is left out.
MOST_LEFT_OUT = 0.7
LEFT_OUT, TOO_MANY = "these rows were left out", "so many cannot be left out, and these were used as they are"
ONE_PIECE: Integers = np.zeros(0, np.int64)


def clipped_rows(column: Array, extreme: float, begins: Integers = ONE_PIECE) -> Mask:
    """Return rows (N,) of a channel at its extreme value, none unless it stands out from the values beside it.

    begins  rows at which another recording begins: what lies between two is no step of the channel
    """
    at = column == extreme
    count, none = int(at.sum()), np.zeros(len(column), bool)
    if count < max(CLIPPED_ROWS, CLIPPED_SHARE * len(column)):
        return none
    # Both ends of the range may be clipped; neither is compared with the other.
    others, counts = np.unique(column[(column > column.min()) & (column < column.max())], return_counts=True)
    if not len(others) or counts.max() * CLIPPED_RATIO > count:
        return none
    steps = np.abs(np.diff(column))
    enters = at[1:] != at[:-1]
    enters[begins - 1] = False
    quantum = float(steps[steps > 0].min())
    # A coarse channel at rest creeps into its plateau by one quantum; a clipped one runs into its stop.
    return at if enters.any() and float(np.median(steps[enters])) > 3 * quantum else none


def saturated(name: str, quantity: str, axis: int, extreme: float, rows: int, of: int, then: str) -> Finding:
    """Return the finding of an axis of `name` that stops at its extreme value in `rows` of so many rows."""
    what = f"{quantity.capitalize()} {'xyz'[axis]} of '{name}' stops at {extreme:.6g} in {rows} of {of} rows"
    return Finding.of("channel-saturated", f"{what}; {then}.")


def left_out(stream: Stream, rows: Mask) -> tuple[Stream, str]:
    """Return the stream without `rows` (N,), or all of it where they are too many, and what was done in words."""
    if rows.mean() > MOST_LEFT_OUT:
        return stream, TOO_MANY
    return stream.rows(~rows) if rows.any() else stream, LEFT_OUT


def with_neighbours(rows: Mask) -> Mask:
    """Return the rows (N,) and those beside them, which are filtered by the same electronics."""
    wide = rows.copy()
    wide[1:] |= rows[:-1]
    wide[:-1] |= rows[1:]
    return wide


def noise_shares(values: Array) -> Array:
    """Return the noise of each column over its range (D,), from third differences, in the median stretch."""
    if len(values) < _FEWEST:
        return np.zeros(values.shape[1])
    noise = np.sqrt(np.median(noise_variances(values, _NOISE_BLOCK), axis=0))
    return np.asarray(noise / np.maximum(np.ptp(values, axis=0), 1e-300))
