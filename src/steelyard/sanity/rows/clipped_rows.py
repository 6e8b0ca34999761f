"""Rows at the end of the range of a channel."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array, Mask
from steelyard.findings import Finding
from steelyard.logs.clipping import NOISE_SHARE, clipped_rows, left_out, noise_shares, saturated, with_neighbours
from steelyard.logs.recording import Recording, Stream

# Rows in which gravity and forces are the same to so small a share of themselves repeat a pose without noise.
SAME_PULL = 1e-6
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
                rows = clipped_rows(values[:, axis], float(extreme))
                if rows.any():
                    found.append((quantity, axis, float(extreme), int(rows.sum())))
                    clipped |= rows
    rest, then = left_out(stream, with_neighbours(clipped))
    return rest, tuple(saturated(stream.name, *each, len(stream), then) for each in found)


def clipped_table(stream: Stream, gravity: Array | None) -> list[Finding]:
    """Return a finding for each wrench channel of a table whose extreme value comes again and no other does.

    gravity  (N, 3) in S; rows of which it asks the same value are no clipped ones. None where it is not known
    """
    out = []
    for quantity in (q for q in ("force", "torque") if q in stream.channels and len(stream) >= 8):
        for axis, column in enumerate(stream.channels[quantity].T):
            values, counts = np.unique(column, return_counts=True)
            for end in (0, -1):
                if len(values) > 4 and counts[end] >= 3 and counts[1:-1].max() == 1:
                    at = column == values[end]
                    if not _same_pull(stream, at, gravity):
                        extreme, rows = values[end], int(at.sum())
                        out.append(saturated(stream.name, quantity, axis, extreme, rows, len(stream), "check them"))
    return out


def _same_pull(stream: Stream, at: Mask, gravity: Array | None) -> bool:
    """Tell whether rows `at` (N,) are repeats of one pose without noise: gravity (N, 3) and all forces agree."""
    if gravity is None or "force" not in stream.channels:
        return False
    alike = (np.ptp(values[at], axis=0).max() / np.abs(values).max() for values in (gravity, stream.channels["force"]))
    return all(share < SAME_PULL for share in alike)


def known_gravity(recording: Recording) -> Array | None:
    """Return gravity in S (N, 3) where rotations or a channel tell it in every row."""
    found = {q: v for s in recording.streams for q, v in s.channels.items()}
    if "rotation" in found and np.isfinite(found["rotation"]).all():
        return np.asarray(np.swapaxes(found["rotation"], 1, 2) @ recording.gravity)
    return found.get("gravity")
