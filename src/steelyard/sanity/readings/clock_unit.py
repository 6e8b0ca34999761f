"""Stamps in a smaller unit than was said: a motion too slow to be seen, which fits the forces at its true speed.

Stamps in ms that are read as s make a log a thousand times as long. Its accelerations are then a million times too
small; in the right unit the mass that is accelerated is the mass that is weighed.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.findings import Finding
from steelyard.logs.clock import median_step
from steelyard.logs.recording import Recording
from steelyard.sanity.readings.both_masses import both_masses
from steelyard.sanity.readings.glance import glance, stream_of
from steelyard.spatial import Rotation

# Turns are judged from so many rows on.
FEWEST_ROWS = 200
# Units of time, each a thousand of the next, and how much smaller than was said they may be.
UNITS = ("s", "ms", "us", "ns")
SMALLER = (1e-3, 1e-6, 1e-9)
# Both masses agree within this share, or so many standard deviations; that which is accelerated is beyond so many from
# none, and both explain all but the last share of the force variance. In a unit that is not theirs, accelerations are a
# million times too large, and that mass is none.
ALIKE, WITHIN, SURE, LEFT = 0.1, 2.0, 5.0, 0.05
# A log longer than this [s] whose turns hardly change from row to row, rows being further apart than that [s], is
# doubtful: so much of a turn is that of the row before. It must turn by as much as the last [rad].
LONG_S, APART_S, LIKE_BEFORE, TURNED = 3600.0, 0.5, 0.95, np.radians(20.0)


def examine_clock(recording: Recording) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording with its stamps in seconds where rows too far apart for a motion are one in another unit."""
    if any(s.time is None for s in recording.streams) or glance(recording) is not None:
        return recording, ()
    said = {UNITS.index(s.said) for s in recording.streams}
    for steps, seconds in enumerate(SMALLER[: len(UNITS) - 1 - max(said)], 1):
        quicker = _with_stamps(recording, seconds)
        if _one_mass(quicker):
            return quicker, (_finding(said, steps),)
    return _doubted(recording), ()


def _doubted(recording: Recording) -> Recording:
    """Return the recording with a note where its poses turn little by little although rows are seconds apart."""
    turning = stream_of(recording, "rotation")
    if turning is None or turning.time is None or len(turning) < FEWEST_ROWS:
        return recording
    step, span = median_step(turning.time), float(turning.time[-1] - turning.time[0])
    R = turning.channels["rotation"]
    turns = Rotation.nearest(np.swapaxes(R[:-1], 1, 2) @ R[1:]).log()
    like = float((turns[1:] * turns[:-1]).sum()) / max(float((turns**2).sum()), 1e-300)
    if span < LONG_S or step < APART_S or like < LIKE_BEFORE or float(np.ptp(turns.cumsum(0), axis=0).max()) < TURNED:
        return recording
    note = (
        f"rows are {step:.3g} s apart over {span / 3600:.2g} h, but poses turn little by little: if it was quicker, "
        "the stamps are in a smaller unit than was said"
    )
    return replace(recording, notes=(*recording.notes, note))


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
    size, std = abs(weighed), float(spread.max())
    return std < size / SURE and left < LEFT and abs(moved - weighed) < max(ALIKE * size, WITHIN * std)
