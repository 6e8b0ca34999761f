"""Rows that are no measurements: repeated, frozen and clipped ones, judged stream by stream on the raw values.

A value that repeats proves nothing by itself: an orientation at rest, a coarse quantum, a noise-free simulation all
repeat. Each check therefore compares with what the same stream does elsewhere.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.findings import Finding
from steelyard.logs.recording import Recording, Stream
from steelyard.logs.repeated_rows import columns_of, repeats, rising
from steelyard.sanity.rows.stuck_rows import clipped_table, known_gravity, without_clipped, without_frozen


def examine_rows(recording: Recording) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording without repeated, frozen and clipped rows and with rising clocks, and what was found."""
    tables = all(s.time is None for s in recording.streams)
    if tables:
        recording, findings = _repeated_in_tables(recording)
        gravity = known_gravity(recording)
        return recording, (*findings, *(f for s in recording.streams for f in clipped_table(s, gravity)))
    streams: list[Stream] = []
    found: list[Finding] = []
    for stream in recording.streams:
        for step in (_without_repeats, without_clipped, without_frozen):
            stream, findings = step(stream)
            found.extend(findings)
        streams.append(rising(stream))
    return replace(recording, streams=tuple(streams)), tuple(found)


def _without_repeats(stream: Stream) -> tuple[Stream, tuple[Finding, ...]]:
    """Return the stream with each repeated row once, where rows repeat more often than its quantum explains."""
    again, stamped = repeats(stream)
    if not again.any():
        return stream, ()
    count = int(again.sum())
    message = (
        f"{count} of {len(stream)} rows of '{stream.name}' ({100 * count / len(stream):.0f} %) repeat the row before "
        f"in every channel{_with_stamps(stamped, count)}; each was used once."
    )
    return stream.rows(~again), (Finding.of("rows-duplicated", message),)


def _with_stamps(stamped: int, count: int) -> str:
    if stamped == 0:
        return ""
    return ", with the same stamp" if stamped == count else f", {stamped} of them with the same stamp"


def _repeated_in_tables(recording: Recording) -> tuple[Recording, tuple[Finding, ...]]:
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
