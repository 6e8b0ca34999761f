"""Clocks too late for the joint fit to find by itself: looked for in how fast every grasp turns.

How fast a rigid payload turns is the same for every robot, whatever its home and grasp, so that two clocks are apart by
the shift at which their robots turn alike. A fit starts anew from there, and is kept where robots agree much better.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from steelyard.check import FAILURES, Array
from steelyard.logs.team_log import TeamLog, TeamRecording
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
