"""Whether robots tell time in one unit: in another, rows lie a thousand times as far apart, and last as much longer.

A slow logger beside a burst of a fast one does both as well, but hardly by the factor of a unit.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from steelyard.errors import BadValue
from steelyard.findings import about
from steelyard.logs.team_track import Track

# Stamps with so many times the step and the span of another robot's are milliseconds, or less, beside seconds.
UNITS = np.array([1e3, 1e6, 1e9])
# Robots record at rates and for times that differ by up to this factor; fewer rows than these tell no rate.
ALIKE, FEWEST = 8.0, 20
_LEAST = 1e-12


def require_one_clock_unit(recording: str, tracks: Mapping[str, Track]) -> None:
    """Raise BadValue where the stamps of a robot in a recording are in another unit than those of the others."""
    spans = {name: float(track.time[-1] - track.time[0]) for name, track in tracks.items() if len(track) >= FEWEST}
    if len(spans) < 2:
        return
    short, long = min(spans, key=spans.__getitem__), max(spans, key=spans.__getitem__)
    span, step = spans[long] / max(spans[short], _LEAST), _step(tracks[long]) / _step(tracks[short])
    off = np.abs(np.log(np.array([span, step])[:, None] / UNITS))
    if not (off < np.log(ALIKE)).all(0).any():
        return
    raise BadValue(
        f"in '{recording}' the rows of '{long}' lie {about(step)} times as far apart as those of '{short}', and last "
        f"{about(span)} times as long: the time of {_odd(spans, short, long)} is not in the unit that was said. Set "
        'the unit ("s", "ms", "us" or "ns") that its "time" has.'
    )


def _step(track: Track) -> float:
    return max(track.step, _LEAST)


def _odd(spans: Mapping[str, float], short: str, long: str) -> str:
    """Return which of two robots the others do not go with: "one of them" where there are no others."""
    if len(spans) < 3:
        return "one of them"
    middle = float(np.median(list(spans.values())))
    return f"'{long if spans[long] / middle > middle / spans[short] else short}'"
