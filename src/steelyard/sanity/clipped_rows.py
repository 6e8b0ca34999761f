"""Rows at the end of the range of a channel."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array, Mask
from steelyard.findings import Finding
from steelyard.logs.recording import Stream
from steelyard.sanity.row_values import NOISE_SHARE, left_out, noise_shares

# A channel is clipped when its extreme value comes up this often and at least five times as often as its neighbours.
CLIPPED_ROWS, CLIPPED_SHARE, CLIPPED_RATIO = 10, 0.003, 5
_MEASURED = ("force", "torque", "specific_force", "angular_velocity")


def without_clipped(stream: Stream) -> tuple[Stream, tuple[Finding, ...]]:
    """Return the stream without rows at the end of a channel's range."""
    found: list[tuple[str, int, float, int]] = []
    clipped = np.zeros(len(stream), bool)
    for quantity in (q for q in _MEASURED if q in stream.channels):
        values = stream.channels[quantity]
        noisy = noise_shares(values) > NOISE_SHARE
        for axis in np.flatnonzero(noisy).tolist():
            for extreme in (values[:, axis].min(), values[:, axis].max()):
                rows = _clipped_rows(values[:, axis], float(extreme))
                if rows.any():
                    found.append((quantity, axis, float(extreme), int(rows.sum())))
                    clipped |= rows
    rest, then = left_out(stream, _with_neighbours(clipped))
    return rest, tuple(_saturated(stream, *each, then) for each in found)


def _with_neighbours(rows: Mask) -> Mask:
    """Return the rows (N,) and those beside them, which are filtered by the same electronics."""
    wide = rows.copy()
    wide[1:] |= rows[:-1]
    wide[:-1] |= rows[1:]
    return wide


def _clipped_rows(column: Array, extreme: float) -> Mask:
    """Return rows (N,) at the extreme value, none unless it stands out from the values beside it."""
    at = column == extreme
    count, none = int(at.sum()), np.zeros(len(column), bool)
    if count < max(CLIPPED_ROWS, CLIPPED_SHARE * len(column)):
        return none
    # Both ends of the range may be clipped; neither is compared with the other.
    others, counts = np.unique(column[(column > column.min()) & (column < column.max())], return_counts=True)
    if not len(others) or counts.max() * CLIPPED_RATIO > count:
        return none
    steps = np.abs(np.diff(column))
    entering = steps[at[1:] != at[:-1]]
    quantum = float(steps[steps > 0].min())
    # A coarse channel at rest creeps into its plateau by one quantum; a clipped one runs into its stop.
    return at if len(entering) and float(np.median(entering)) > 3 * quantum else none


def _saturated(stream: Stream, quantity: str, axis: int, extreme: float, rows: int, then: str) -> Finding:
    return Finding.of(
        "channel-saturated",
        f"{quantity.capitalize()} {'xyz'[axis]} of '{stream.name}' stops at {extreme:.6g} in {rows} of "
        f"{len(stream)} rows; {then}.",
    )


def clipped_table(stream: Stream) -> list[Finding]:
    """Return a finding for each wrench channel of a table whose extreme value comes again and no other does."""
    out = []
    for quantity in (q for q in ("force", "torque") if q in stream.channels and len(stream) >= 8):
        for axis, column in enumerate(stream.channels[quantity].T):
            values, counts = np.unique(column, return_counts=True)
            for end in (0, -1):
                if len(values) > 4 and counts[end] >= 3 and np.delete(counts, end).max() == 1:
                    out.append(_saturated(stream, quantity, axis, values[end], int(counts[end]), "check them"))
    return out
