"""Rows of one still pose that remember each other: noise below the rate of a sensor, in a table that has no clock.

Such rows are worth fewer than they are, and their error bars would be too narrow. Means over several times as many rows
as noise remembers are no longer alike, and are read instead.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.check import Array, Integers
from steelyard.logs.recording import Recording, Stream
from steelyard.sanity.still_rows import angles, as_table, spans, split

# Gravity turns by less between rows of one pose [rad], of which there are so many on average.
SAME, FEWEST_ROWS = np.radians(2.0), 8.0
# Rows remember each other where they are worth fewer by this factor; means are over so many times the factor.
WORTH_LESS, TIMES = 1.5, 3.0
# Correlations below this are chance.
LEAST = 0.05


def examine_memory(recording: Recording) -> Recording:
    """Return a table of still poses with rows that remember each other averaged; a note says so."""
    if not all(s.time is None and s.poses for s in recording.streams):
        return recording
    down = next((d for s in recording.streams if (d := _down(s)) is not None), None)
    felt = [s.channels[q] for s in recording.streams for q in ("force", "torque") if q in s.channels]
    if down is None or any(len(values) != len(down) for values in felt):
        return recording
    poses = spans(np.cumsum(np.append(False, _apart(down[:-1], down[1:]) > SAME)))
    middle = np.repeat(down[poses.mean(1).astype(np.int64)], np.diff(poses, axis=1)[:, 0], axis=0)
    # Rows that turn little by little are a motion.
    if len(down) < FEWEST_ROWS * len(poses) or (_apart(middle, down) > SAME).any():
        return recording
    worth = _worth(np.hstack(felt), poses)
    if worth < WORTH_LESS:
        return recording
    length = float(np.ceil(TIMES * worth))
    clocks = [replace(s, time=np.arange(len(s), dtype=np.float64)) for s in recording.streams]
    streams, rows = as_table(clocks, split(poses - np.array([0.0, 1.0]), length))
    note = (
        f"rows of one pose remember each other over {worth:.0f} rows: means over {length:.0f} were read, {rows} in all"
    )
    return replace(recording, streams=streams, notes=(*recording.notes, note))


def _down(stream: Stream) -> Array | None:
    """Return rotations (N, 3, 3) of a stream, or else gravity (N, 3) as one of its channels tells it."""
    return next((stream.channels[q] for q in ("rotation", "gravity", "specific_force") if q in stream.channels), None)


def _apart(down: Array, other: Array) -> Array:
    """Return the angle (N,) [rad] between rows of rotations (N, 3, 3) or of vectors (N, 3)."""
    if down.ndim == 3:
        return angles(np.swapaxes(down, 1, 2) @ other)
    sizes = np.linalg.norm(down, axis=1) * np.linalg.norm(other, axis=1)
    return np.asarray(np.arccos(np.clip((down * other).sum(1) / np.maximum(sizes, 1e-300), -1.0, 1.0)))


def _worth(values: Array, poses: Integers) -> float:
    """Return how many rows of values (N, k) are worth one, by how alike neighbours in a pose are; 1 of white noise."""
    count = np.diff(poses, axis=1)[:, 0]
    means = np.add.reduceat(values, poses[:, 0], axis=0) / count[:, None]
    left = values - np.repeat(means, count, axis=0)
    left = left / np.maximum(left.std(0), 1e-300)
    number = np.repeat(np.arange(len(poses)), count)
    worth = 1.0
    for lag in range(1, int(count.max()) // 2):
        pairs = number[lag:] == number[:-lag]
        alike = float((left[lag:] * left[:-lag])[pairs].sum() / max(float((left**2).sum()), 1e-300))
        if alike < LEAST:
            break
        worth += 2 * alike
    return worth
