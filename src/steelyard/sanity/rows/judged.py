"""Rows that are no measurements: repeated, frozen and clipped ones, judged stream by stream on the raw values.

A value that repeats proves nothing by itself: an orientation at rest, a coarse quantum, a noise-free simulation all
repeat. Each check therefore compares with what the same stream does elsewhere.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.findings import Finding
from steelyard.logs.recording import Recording, Stream
from steelyard.sanity.rows.clipped_rows import clipped_table, known_gravity, without_clipped
from steelyard.sanity.rows.frozen_rows import without_frozen
from steelyard.sanity.rows.repeated_rows import repeated_in_tables, without_repeats


def examine_rows(recording: Recording) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording without repeated, frozen and clipped rows and with rising clocks, and what was found."""
    tables = all(s.time is None for s in recording.streams)
    if tables:
        recording, findings = repeated_in_tables(recording)
        gravity = known_gravity(recording)
        return recording, (*findings, *(f for s in recording.streams for f in clipped_table(s, gravity)))
    streams: list[Stream] = []
    found: list[Finding] = []
    for stream in recording.streams:
        for step in (without_repeats, without_clipped, without_frozen):
            stream, findings = step(stream)
            found.extend(findings)
        streams.append(_rising(stream))
    return replace(recording, streams=tuple(streams)), tuple(found)


def _rising(stream: Stream) -> Stream:
    """Return the stream with equal stamps of a coarse clock spread evenly up to the next one."""
    if stream.time is None or (np.diff(stream.time) > 0).all():
        return stream
    stamps, first, counts = np.unique(stream.time, return_index=True, return_counts=True)
    gap = np.diff(stamps)
    gap = np.append(gap, np.median(gap)) if len(gap) else np.ones(1)
    gap = np.minimum(gap, 2 * np.median(gap))
    place = np.arange(len(stream.time)) - np.repeat(first, counts)
    return replace(stream, time=stream.time + np.repeat(gap / counts, counts) * place)
