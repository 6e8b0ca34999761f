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
from steelyard.team.adjoint import turning_speed
from steelyard.team.clocks.errors import NOTHING, ClockError, ClockErrors
from steelyard.team.clocks.search import FARTHEST_S, SHARE, STEP_S, correlation

# Robots must turn alike at the shift (correlation), and leave less than this share of what they leave at shifts that a
# fit or the search beside it finds.
ALIKE, LEAVES = 0.9, 0.25
# What is compared must be so much of the shorter track; longer ones are told in so many steps.
OVERLAP, MOST_STEPS = 0.5, 6000
LEAST = 1e-6  # of the square of its speeds: a robot that turned by less at a lag tells nothing of it


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
    # The first row of x is at row `lag` of y.
    lags = np.arange(1 - len(x), len(y))
    alike = _alike(x, y)
    late = float(second.time[0] - first.time[0]) + step * lags
    near = np.abs(late) <= min(FARTHEST_S, SHARE * min(spans)) + step
    best, usual = float(alike.max()), float(alike[near].max(initial=0.0))
    if best < ALIKE or 1 - best**2 > LEAVES * (1 - usual**2):
        return 0.0
    return float(late[alike.argmax()])


def _speed(track: Track, step: float) -> Array:
    """Return how fast a grasp turns, in even steps [s] from its first stamp on."""
    return turning_speed(track, np.arange(float(track.time[0]), float(track.time[-1]), step), step)


def _alike(x: Array, y: Array) -> Array:
    """Return the correlation of speeds x (N,) and y (M,) at lags 1 - N to M - 1; 0 where too few rows tell it.

    The sums over what overlaps are themselves correlations over the lag, of what is known, speeds and squares, and
    Fourier transforms find them for all lags at once.
    """
    X, Y = _powers(x), _powers(y)
    count = len(x) + len(y) - 1
    ahead, behind = np.fft.rfft(X[:, ::-1], count), np.fft.rfft(Y, count)
    n, sx, sy, xx, yy, _ = total = np.fft.irfft(ahead[[0, 1, 0, 2, 0, 1]] * behind[[0, 0, 1, 0, 2, 1]], count)
    overlap = np.minimum.reduce([np.arange(1, count + 1), np.arange(count, 0, -1), np.full(count, min(len(x), len(y)))])
    told = (overlap >= OVERLAP * min(len(x), len(y))) & (n >= OVERLAP * overlap)
    # What hardly turns in the rows that overlap is left to rounding.
    told &= (n * xx - sx * sx > LEAST * n * X[2].sum()) & (n * yy - sy * sy > LEAST * n * Y[2].sum())
    return np.where(told, correlation(total), 0.0)


def _powers(speed: Array) -> Array:
    """Return what is known of speeds (N,), the speeds about their mean, and the squares (3, N); 0 where unknown."""
    good = np.isfinite(speed)
    about = np.where(good, speed - (speed[good].mean() if good.any() else 0.0), 0.0)
    return np.stack([good, about, about**2])
