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

# Units of time, each a thousand of the next, and how much smaller than was said they may be.
UNITS = ("s", "ms", "us", "ns")
SMALLER = (1e-3, 1e-6, 1e-9)
# Both masses agree within this share, are known within the second, and explain all but the third of the force variance.
ALIKE, KNOWN, LEFT = 0.1, 0.03, 0.05


def examine_clock(recording: Recording) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording with its stamps in seconds where rows too far apart for a motion are one in another unit."""
    if any(s.time is None for s in recording.streams) or glance(recording) is not None:
        return recording, ()
    said = {UNITS.index(s.said) for s in recording.streams}
    for steps, seconds in enumerate(SMALLER[: len(UNITS) - 1 - max(said)], 1):
        quicker = _with_stamps(recording, seconds)
        if _one_mass(quicker):
            return quicker, (_finding(said, steps),)
    return recording, ()


def _finding(said: set[int], steps: int) -> Finding:
    """Return `time-unit` where stamps said to be in units of these numbers are so many steps of a thousand smaller."""
    if len(said) == 1:
        (old,) = (UNITS[k] for k in said)
        unit = UNITS[UNITS.index(old) + steps]
        which, remedy = f"in {unit}, not in {old}", f'Set unit = "{unit}" in time of every stream.'
    else:
        pairs = ", ".join(f'unit = "{UNITS[k + steps]}" for "{UNITS[k]}"' for k in sorted(said))
        which, remedy = f"in units {1000**steps:.3g} times smaller than said", f"Set in time of every stream {pairs}."
    text = f"The stamps are {which}: so read, the load is accelerated as it is weighed. The answer assumes this."
    return Finding("time-unit", text, remedy)


def _with_stamps(recording: Recording, seconds: float) -> Recording:
    """Return the recording with stamps of so many seconds each; a delay was declared in a unit of its own."""
    streams = (replace(s, time=None if s.time is None else s.time * seconds) for s in recording.streams)
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
