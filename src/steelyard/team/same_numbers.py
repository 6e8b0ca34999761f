"""Numbers that cannot have been measured: two robots with the same ones, and a force that never changes."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from steelyard.errors import BadValue
from steelyard.findings import Finding
from steelyard.logs.team_log import TeamLog
from steelyard.logs.team_track import Track

FEWEST = 50  # rows in which noise shows
COMPARED = 64  # rows of a recording that are enough to tell two robots apart


def require_own_numbers(log: TeamLog) -> None:
    """Raise BadValue where two robots have the same numbers in a recording: one file was given twice."""
    for recording in log.recordings:
        moving = {n: t for n, t in recording.tracks.items() if t.has("force") and len(t) >= FEWEST}
        for first, second in combinations(moving, 2):
            if _alike(moving[first], moving[second]):
                raise BadValue(
                    f"'{first}' and '{second}' have the same numbers in '{recording.name}': one file is given for "
                    'both. Correct the "path" of one of them.'
                )


def stuck_forces(log: TeamLog) -> Iterator[Finding]:
    """Yield a finding for every force that is the same in all rows of a motion: the sum of forces is wrong by it."""
    for recording in log.of_kind("motion"):
        for name, track in recording.tracks.items():
            if not track.has("force") or track.valid["force"].sum() < FEWEST:
                continue
            force = track.channels["force"][track.valid["force"]]
            axes = [axis for axis, still in zip("xyz", np.ptp(force, axis=0) == 0, strict=True) if still]
            if axes:
                yield Finding.of(
                    "channel-stuck",
                    f"Force {', '.join(axes)} of '{name}' is the same in all {len(force)} rows of '{recording.name}'. "
                    "If the robot did carry, mass, centre of mass and inertia are wrong by what it carried.",
                )


def _alike(first: Track, second: Track) -> bool:
    """Return whether two robots measured the same, to the last digit, in rows all over a recording."""
    if len(first) != len(second) or first.channels.keys() != second.channels.keys():
        return False
    rows = slice(None, None, max(1, len(first) // COMPARED))
    return all(np.array_equal(first.channels[name][rows], second.channels[name][rows]) for name in first.channels)
