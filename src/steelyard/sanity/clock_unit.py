"""Stamps in a smaller unit than was said: a motion too slow to be seen, which fits the forces at its true speed.

Stamps in ms that are read as s make a log a thousand times as long. Its accelerations are then a million times too
small; in the right unit the mass that is accelerated is the mass that is weighed.
"""

from __future__ import annotations

from dataclasses import replace

from steelyard.findings import Finding
from steelyard.logs.recording import Recording
from steelyard.sanity.both_masses import both_masses
from steelyard.sanity.glance import glance

# Seconds that a stamp of one may be, and the unit to declare.
UNITS = ((1e-3, "ms"), (1e-6, "us"), (1e-9, "ns"))
# Both masses agree within this share, are known within the second, and explain all but the third of the force variance.
ALIKE, KNOWN, LEFT = 0.1, 0.03, 0.05


def examine_clock(recording: Recording) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording with its stamps in seconds where rows too far apart for a motion are one in another unit."""
    if any(s.time is None for s in recording.streams) or glance(recording) is not None:
        return recording, ()
    for seconds, unit in UNITS:
        quicker = _with_stamps(recording, seconds)
        if _one_mass(quicker):
            text = (
                f"The stamps are in {unit}, not in s: so read, the load is accelerated as it is weighed. The answer "
                "assumes this."
            )
            return quicker, (Finding("time-unit", text, f'Set unit = "{unit}" in time of every stream.'),)
    return recording, ()


def _with_stamps(recording: Recording, seconds: float) -> Recording:
    """Return the recording with stamps and delays of so many seconds each."""

    def shorter(value: float | None) -> float | None:
        return None if value is None else value * seconds

    streams = (
        replace(s, time=None if s.time is None else s.time * seconds, delay=shorter(s.delay)) for s in recording.streams
    )
    return replace(recording, streams=tuple(streams))


def _one_mass(recording: Recording) -> bool:
    """Whether force follows acceleration and gravity as those of one mass."""
    view = glance(recording)
    if view is None or view.acceleration is None or view.rotation is None:
        return False
    masses, spread, left = both_masses(view, recording.gravity, view.rotation)
    moved, weighed = (float(v) for v in masses)
    known = float(spread.max()) < KNOWN * abs(weighed)
    return known and left < LEFT and abs(moved - weighed) < ALIKE * abs(weighed)
