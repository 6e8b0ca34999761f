"""Clocks too late for the joint fit to find by itself: looked for in how fast every grasp turns.

How fast a rigid payload turns is the same for every robot, whatever its home and grasp, so that two clocks are apart by
the shift at which their robots turn alike. A fit starts anew from there, and is kept where robots agree much better.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol, TypeVar

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadValue, CannotAnswer
from steelyard.logs.team_log import TeamLog
from steelyard.logs.team_track import Track
from steelyard.team.stacked import punctual
from steelyard.team.turning_speed import turning_speed

# Shifts are looked for up to so many seconds, and a share of the recording, in steps of STEP_S.
FARTHEST_S, SHARE, STEP_S = 2.0, 0.25, 0.05
# Clocks nearer than this [s] the fit finds by itself.
NEAR_S = 0.1
# Robots must turn alike at the shift, and by so much more than without one (correlations).
ALIKE, MORE = 0.7, 0.1
# The noise of all robots' turns and places, multiplied, must fall by this factor.
BETTER = 10.0


class Fitted(Protocol):
    """A joint fit of poses or of twists."""

    @property
    def fit(self) -> Any:
        """The optimum, with its noise (N, 2)."""

    @property
    def rough(self) -> bool:
        """Whether robots disagree."""


F = TypeVar("F", bound=Fitted)


def searched(log: TeamLog, team: F, of: Callable[[TeamLog], F]) -> tuple[TeamLog, F, dict[str, float]]:
    """Return log, fit, and how late clocks are beside what it finds [s]: as they are, or begun from other clocks."""
    lags = far_lags(log)
    if max(map(abs, lags.values()), default=0.0) < NEAR_S:
        return log, team, {}
    try:
        moved = begun_from(log, lags)
        again = of(moved)
    except (BadValue, CannotAnswer, np.linalg.LinAlgError):
        return log, team, {}
    if float(np.log(team.fit.noise / again.fit.noise).sum()) < np.log(BETTER):
        return log, team, {}
    return moved, again, lags


def begun_from(log: TeamLog, lags: Mapping[str, float]) -> TeamLog:
    """Return the log with every robot's stamps moved by the seconds that they are late; others are punctual."""
    return log.with_recordings(*(punctual(recording, lags) for recording in log.recordings))


def far_lags(log: TeamLog) -> dict[str, float]:
    """Return by how many seconds robots' stamps are late against the reference, where they then turn far more alike."""
    out = {}
    for name in log.others:
        sums: dict[int, Array] = {}
        for recording in log.recordings:
            if recording.kind != "still" and {name, log.reference} <= recording.tracks.keys():
                _add_products(sums, recording.tracks[log.reference], recording.tracks[name])
        alike = {shift: _correlation(total) for shift, total in sums.items()}
        best = max(alike, key=lambda shift: alike[shift], default=0)
        if best and alike[best] > max(ALIKE, alike[0] + MORE):
            out[name] = best * STEP_S
    return out


def _add_products(sums: dict[int, Array], first: Track, second: Track) -> None:
    """Add, for every shift in steps, the sums of 1, x, y, x^2, y^2, x y over how fast both turn."""
    begin, end = min(first.time[0], second.time[0]), max(first.time[-1], second.time[-1])
    time = np.arange(float(begin), float(end), STEP_S)
    x, y = (turning_speed(track, time, STEP_S) for track in (first, second))
    most = int(min(FARTHEST_S, SHARE * (end - begin)) / STEP_S)
    for shift in range(-most, most + 1):
        a, b = x[max(0, -shift) : len(x) - max(0, shift)], y[max(0, shift) : len(y) - max(0, -shift)]
        good = np.isfinite(a) & np.isfinite(b)
        a, b = a[good], b[good]
        total = np.array([len(a), a.sum(), b.sum(), a @ a, b @ b, a @ b])
        sums[shift] = sums.get(shift, np.zeros(6)) + total


def _correlation(total: Array) -> float:
    n, x, y, xx, yy, xy = total
    spread = max(n * xx - x * x, 0.0) * max(n * yy - y * y, 0.0)
    return float((n * xy - x * y) / np.sqrt(spread)) if spread > 0 else 0.0
