"""Clocks of robots that count from different moments: each robot's logger had a clock of its own, or none.

As in the search beside a fit, two clocks are apart by the shift at which their robots turn alike; here whatever it is,
before anything is fitted, so that the files need have no time in common.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from steelyard.check import Array
from steelyard.logs.team_log import TeamLog, TeamRecording
from steelyard.logs.team_track import Track
from steelyard.team.clocks.errors import NOTHING, ClockError, ClockErrors
from steelyard.team.clocks.search import FARTHEST_S, SHARE, STEP_S, correlation
from steelyard.team.turns import turning_speed

# Robots must turn alike at the shift (correlation), and leave less than this share of what they leave at shifts that a
# fit or the search beside it finds.
ALIKE, LEAVES = 0.9, 0.25
# What is compared must be so much of the shorter track; longer ones are told in so many steps.
OVERLAP, MOST_STEPS = 0.5, 6000


def together(log: TeamLog) -> tuple[TeamLog, ClockErrors]:
    """Return the log with clocks brought together, and how late stamps were before that.

    Recordings at rest show no lag: they have that of the robot's motions, where these are of one mind.
    """
    found = [{name: _late(recording, log.reference, name) for name in recording.tracks} for recording in log.recordings]
    usual = {name: _usual([own for late in found if (own := late.get(name)) is not None]) for name in log.names}
    errors = [
        {name: ClockError(late) for name, own in each.items() if (late := usual[name] if own is None else own)}
        for each in found
    ]
    apart = ClockErrors(tuple(errors)) if any(errors) else NOTHING
    return apart.corrected(log), apart


def _usual(late: Sequence[float]) -> float:
    """Return the middle of how late a robot's stamps are [s] in its motions, 0 where they differ."""
    return float(np.median(late)) if late and np.ptp(late) < FARTHEST_S else 0.0


def _late(recording: TeamRecording, reference: str, name: str) -> float | None:
    """Return how late [s] a robot's stamps are against the reference's, 0 where a fit may find it, None at rest."""
    if recording.kind == "still" or reference not in recording.tracks:
        return None
    first, second = recording.tracks[reference], recording.tracks[name]
    spans = [float(np.ptp(track.time)) for track in (first, second)]
    if name == reference or min(spans) < TeamRecording.LONG_S:
        return 0.0
    step = max(STEP_S, max(spans) / MOST_STEPS)
    x, y = _speed(first, step), _speed(second, step)
    begun = float(second.time[0] - first.time[0])
    fewest = int(OVERLAP * min(len(x), len(y)))
    lags = np.arange(fewest - len(x), len(y) - fewest + 1)
    # A lag is where in y the first row of x is.
    alike = np.array([_alike(x, y, int(lag)) for lag in lags])
    late = begun + step * lags
    near = np.abs(late) <= min(FARTHEST_S, SHARE * min(spans)) + step
    best, usual = float(alike.max()), float(alike[near].max(initial=0.0))
    if best < ALIKE or 1 - best**2 > LEAVES * (1 - usual**2):
        return 0.0
    return float(late[alike.argmax()])


def _speed(track: Track, step: float) -> Array:
    """Return how fast a grasp turns, in even steps [s] from its first stamp on."""
    return turning_speed(track, np.arange(float(track.time[0]), float(track.time[-1]), step), step)


def _alike(x: Array, y: Array, lag: int) -> float:
    """Return the correlation of speeds whose first row of x is at row `lag` of y."""
    begin, end = max(-lag, 0), min(len(x), len(y) - lag)
    a, b = x[begin:end], y[begin + lag : end + lag]
    good = np.isfinite(a) & np.isfinite(b)
    a, b = a[good], b[good]
    if len(a) < OVERLAP * len(good):
        return 0.0
    return correlation(np.array([len(a), a.sum(), b.sum(), a @ a, b @ b, a @ b]))
