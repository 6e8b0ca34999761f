"""Rows of a stream that were logged more than once, and clocks that stand still from row to row."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.check import Array, Mask
from steelyard.logs.recording import Stream
from steelyard.logs.runs import lasting, runs

# What noise shows in, even at rest.
NOISY = ("force", "torque", "specific_force")
# Repeats beyond three times what the quantum of the channels explains, and at least this share of the rows.
REPEATED_SHARE, CHANCE = 0.02, 3.0
# A longer run of equal rows is rest or a frozen driver, not a row logged again.
LONGEST_RUN = 8
# Rows in which repeats show.
FEWEST = 30


def repeats(stream: Stream) -> tuple[Mask, int]:
    """Return which rows (N,) repeat the one before and say nothing new, and how many of them have its stamp too.

    No row does where they repeat no more often than the quantum of the channels explains.
    """
    none = np.zeros(len(stream), np.bool_)
    if stream.time is None or len(stream) < FEWEST:
        return none, 0
    values = columns_of(stream)
    equal = values[1:] == values[:-1]
    repeat = equal.all(1)
    # A row without numbers repeats one like it only with its stamp: else both may be lost.
    alike = (equal | (np.isnan(values[1:]) & np.isnan(values[:-1]))).all(1)
    stamped = alike & (np.diff(stream.time) == 0)
    again = repeat & ~lasting(repeat, _longest(repeat) + 1) | stamped
    if not _more_than_chance(equal, again, _moving(stream, values)):
        again = stamped
    if int(again.sum()) <= max(10, REPEATED_SHARE * len(stream)) and not _many(stamped):
        return none, 0
    return np.concatenate([[False], again]), int(stamped.sum())


def rising(stream: Stream) -> Stream:
    """Return the stream with equal stamps of a coarse clock spread evenly up to the next one."""
    if stream.time is None or (np.diff(stream.time) > 0).all():
        return stream
    stamps, first, counts = np.unique(stream.time, return_index=True, return_counts=True)
    gap = np.diff(stamps)
    gap = np.append(gap, np.median(gap)) if len(gap) else np.ones(1)
    gap = np.minimum(gap, 2 * np.median(gap))
    place = np.arange(len(stream.time)) - np.repeat(first, counts)
    return replace(stream, time=stream.time + np.repeat(gap / counts, counts) * place)


def columns_of(stream: Stream) -> Array:
    """Return all channels side by side (N, K), without those that never change."""
    values = np.concatenate([v.reshape(len(v), -1) for v in stream.channels.values()], 1)
    return np.asarray(values[:, (values != values[0]).any(0)])


def _moving(stream: Stream, values: Array) -> Mask:
    """Return which steps (N-1,) count: all where a channel carries noise, else those in which the body moves."""
    if set(NOISY) & set(stream.channels):
        return np.ones(len(values) - 1, bool)
    size = np.linalg.norm(np.diff(values, axis=0), axis=1)
    level = np.convolve(size, np.full(11, 1 / 11), "same")
    return np.asarray(level > 0.2 * np.quantile(level, 0.95))


def _more_than_chance(equal: Mask, again: Mask, counted: Mask) -> bool:
    """Tell whether all K channels repeat together more often than their single repeats explain.

    For independent channels the numbers of steps c_k with k channels equal obey c_K <= c_(K-1)^2 / c_(K-2) times
    (K-1) / 2K (Newton's inequality).
    """
    K = equal.shape[1]
    if K < 2 or not counted.any():
        return False
    counts = np.bincount(equal[counted].sum(1), minlength=K + 1).astype(float)
    bound = (counts[K - 1] + 1) ** 2 / (counts[K - 2] + 1) * (K - 1) / (2 * K)
    together = float((again & counted).sum())
    return bool(together > CHANCE * bound + max(10.0, REPEATED_SHARE * float(counted.sum())))


def _longest(repeat: Mask) -> int:
    """Return how long a run of repeats may be: more where a fast logger holds every sample for many rows."""
    lengths = np.ptp(runs(repeat), axis=1)
    return max(LONGEST_RUN, 2 * int(np.median(lengths))) if len(lengths) > 20 else LONGEST_RUN


def _many(stamped: Mask) -> bool:
    return int(stamped.sum()) >= 10 or float(stamped.mean()) > 0.01
