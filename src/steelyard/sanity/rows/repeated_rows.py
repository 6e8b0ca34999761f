"""Rows that were logged more than once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.check import Array, Mask
from steelyard.findings import Finding
from steelyard.logs.recording import Recording, Stream
from steelyard.logs.runs import runs
from steelyard.sanity.rows.row_values import NOISY, columns_of, run_lengths

# Repeats beyond three times what the quantum of the channels explains, and at least this share of the rows.
REPEATED_SHARE, CHANCE = 0.02, 3.0
# A longer run of equal rows is rest or a frozen driver, not a row logged again.
LONGEST_RUN = 8


def without_repeats(stream: Stream) -> tuple[Stream, tuple[Finding, ...]]:
    """Return the stream with each repeated row once, where rows repeat more often than its quantum explains."""
    if stream.time is None or len(stream) < 30:
        return stream, ()
    values = columns_of(stream)
    equal = values[1:] == values[:-1]
    repeat = equal.all(1)
    stamped = repeat & (np.diff(stream.time) == 0)
    again = repeat & (run_lengths(repeat) <= _longest(repeat))
    if not _more_than_chance(equal, again, _moving(stream, values)):
        again = stamped
    count = int(again.sum())
    if count <= max(10, REPEATED_SHARE * len(stream)) and not _many(stamped):
        return stream, ()
    message = (
        f"{count} of {len(stream)} rows of '{stream.name}' ({100 * count / len(stream):.0f} %) repeat the row before "
        f"in every channel{_with_stamps(int(stamped.sum()), count)}; each was used once."
    )
    return stream.rows(np.concatenate([[True], ~again])), (Finding.of("rows-duplicated", message),)


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


def _with_stamps(stamped: int, count: int) -> str:
    if stamped == 0:
        return ""
    return ", with the same stamp" if stamped == count else f", {stamped} of them with the same stamp"


def repeated_in_tables(recording: Recording) -> tuple[Recording, tuple[Finding, ...]]:
    """Return tables without rows that come again anywhere in all streams together."""
    if len({len(s) for s in recording.streams}) != 1 or len(recording.streams[0]) < 4:
        return recording, ()
    together = np.concatenate([columns_of(s) for s in recording.streams], 1)
    _, first = np.unique(together, axis=0, return_index=True)
    count = len(together) - len(first)
    if count < max(2, 0.05 * len(together)):
        return recording, ()
    rows = np.zeros(len(together), bool)
    rows[first] = True
    message = (
        f"{count} of {len(together)} rows ({100 * count / len(together):.0f} %) repeat an earlier row in every "
        "channel; each was used once."
    )
    streams = tuple(s.rows(rows) for s in recording.streams)
    return replace(recording, streams=streams), (Finding.of("rows-duplicated", message),)
