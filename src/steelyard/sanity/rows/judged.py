"""Rows that are no measurements: repeated, frozen and clipped ones, judged stream by stream on the raw values.

A value that repeats proves nothing by itself: an orientation at rest, a coarse quantum, a noise-free simulation all
repeat. Each check therefore compares with what the same stream does elsewhere.
"""

from __future__ import annotations

from dataclasses import replace

from steelyard.findings import Finding
from steelyard.logs.recording import Recording, Stream
from steelyard.logs.repeated_rows import rising
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
        streams.append(rising(stream))
    return replace(recording, streams=tuple(streams)), tuple(found)
