"""Clocks too late for the joint fit to find by itself: looked for in how fast every grasp turns.

How fast a rigid payload turns is the same for every robot, whatever its home and grasp, so that two clocks are apart by
the shift at which their robots turn alike. A fit starts anew from there, and is kept where robots agree much better.
Clocks that count from different moments, each logger's own, are brought together before anything is fitted, whatever
the shift is, so that the files need have no time in common.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from steelyard.check import FAILURES, Array
from steelyard.logs.team_log import TeamLog, TeamRecording
from steelyard.logs.team_track import Track
from steelyard.team.adjoint import turning_speed
from steelyard.team.clocks.errors import NOTHING, ClockError, ClockErrors
from steelyard.team.motion_fit import F

# Shifts are looked for up to so many seconds, and a share of the recording, in steps of STEP_S.
FARTHEST_S, SHARE, STEP_S = 2.0, 0.25, 0.05
# Clocks nearer than this [s] the fit finds by itself.
NEAR_S = 0.1
# Robots must turn alike at the shift, and by so much more than without one (correlations).
ALIKE, MORE = 0.7, 0.1
# The noise of all robots' turns and places, multiplied, must fall by this factor.
BETTER = 10.0
# Clocks however far apart: robots must turn alike at the shift, and leave less than this share of what they leave at
# shifts that a fit or the search beside it finds.
SURELY_ALIKE, LEAVES = 0.9, 0.25
# What is compared must be so much of the shorter track; longer ones are told in so many steps.
OVERLAP, MOST_STEPS = 0.5, 6000
LEAST = 1e-6  # of the square of its speeds: a robot that turned by less at a lag tells nothing of it


def searched(log: TeamLog, team: F, of: Callable[[TeamLog], F]) -> tuple[TeamLog, F, ClockErrors]:
    """Return log, fit, and how late clocks are beside what it finds: as they are, or begun from other clocks."""
    lags = far_lags(log)
    if max((abs(e.late) for errors in lags.recordings for e in errors.values()), default=0.0) < NEAR_S:
        return log, team, NOTHING
    try:
        moved = lags.corrected(log)
        again = of(moved)
    except FAILURES:
        return log, team, NOTHING
    if float(np.log(team.fit.noise / again.fit.noise).sum()) < np.log(BETTER):
        return log, team, NOTHING
    return moved, again, lags


def far_lags(log: TeamLog) -> ClockErrors:
    """Return how late robots' stamps are against the reference, where they then turn far more alike.

    All recordings are asked together; one in which the robots turn far more alike at a shift of its own has that.
    """
    found: list[dict[str, ClockError]] = [{} for _ in log.recordings]
    for name in log.others:
        alone = [_products(recording, log.reference, name) for recording in log.recordings]
        every: dict[int, Array] = {}
        for sums in alone:
            for shift, total in sums.items():
                every[shift] = every.get(shift, np.zeros(6)) + total
        common = _best(every, 0)
        for errors, sums in zip(found, alone, strict=True):
            shift = _best(sums, common) if sums else common
            if shift:
                errors[name] = ClockError(shift * STEP_S)
    return ClockErrors(tuple(found)) if any(found) else NOTHING


def _best(sums: dict[int, Array], usual: int) -> int:
    """Return the shift at which robots turn far more alike than at the usual one, or that."""
    alike = {shift: float(correlation(total)) for shift, total in sums.items()}
    best = max(alike, key=lambda shift: alike[shift], default=usual)
    return best if alike.get(best, 0.0) > max(ALIKE, alike.get(usual, 0.0) + MORE) else usual


def _products(recording: TeamRecording, reference: str, name: str) -> dict[int, Array]:
    """Return, for every shift in steps, the sums of 1, x, y, x^2, y^2, x y over how fast two robots turn."""
    if recording.kind == "still" or not {name, reference} <= recording.tracks.keys():
        return {}
    first, second = recording.tracks[reference], recording.tracks[name]
    begin, end = min(first.time[0], second.time[0]), max(first.time[-1], second.time[-1])
    time = np.arange(float(begin), float(end), STEP_S)
    x, y = (turning_speed(track, time, STEP_S) for track in (first, second))
    most = int(min(FARTHEST_S, SHARE * (end - begin)) / STEP_S)
    sums = {}
    for shift in range(-most, most + 1):
        a, b = x[max(0, -shift) : len(x) - max(0, shift)], y[max(0, shift) : len(y) - max(0, -shift)]
        good = np.isfinite(a) & np.isfinite(b)
        a, b = a[good], b[good]
        sums[shift] = np.array([len(a), a.sum(), b.sum(), a @ a, b @ b, a @ b])
    return sums


def correlation(total: Array) -> Array:
    """Return the correlation (..) of x and y by sums (6, ..) of 1, x, y, x^2, y^2, x y; 0 where one is constant."""
    n, x, y, xx, yy, xy = total
    spread = np.maximum(n * xx - x * x, 0.0) * np.maximum(n * yy - y * y, 0.0)
    return np.asarray(np.where(spread > 0, (n * xy - x * y) / np.sqrt(np.where(spread > 0, spread, 1.0)), 0.0))


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
    if best < SURELY_ALIKE or 1 - best**2 > LEAVES * (1 - usual**2):
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
