"""A grasp that slips while nobody records: its place against all others changes from one recording to the next.

Means over a second are compared, those of recordings before with those after. They scatter about the mean of their side
by noise and by whatever else differs between attitudes (soft grasps, levers, encoders), so that this scatter judges the
step; seconds of one recording are counted as one, since much of it may last.
Source: own; Hotelling's T^2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.special import fdtri

from steelyard.check import Array
from steelyard.team.changes.slips import WINDOW_S, Slip, SlipAt, clearest
from steelyard.team.stacked import Stretch, row_slices

# How likely noise alone may be taken for a slip, in one log, and the size [m, rad] from which a step counts.
CHANCE, LEAST_M, LEAST_RAD = 1e-4, 2e-3, 4e-3
# What moves farther does not slip: another robot's file, or a base that was carried away.
MOST_M, MOST_RAD = 0.15, 0.6
# Windows that are needed to tell their scatter.
WINDOWS = 16


def slip_between(parts: Sequence[Stretch], apart: Array) -> SlipAt | None:
    """Return the clearest slip between two recordings, None where there is none.

    apart  (T, N, 6) rotation vector and position of each grasp against what the others say, recording after recording
    """
    found, count = list[SlipAt | None](), apart.shape[1]
    for robot in range(count if len(parts) > 1 else 0):
        means, recording = _windows(parts, apart[:, robot], robot)
        for first in np.unique(recording)[1:]:
            slip = _step(means, recording, int(first), robot, CHANCE / (count * (len(parts) - 1)))
            found.append(None if slip is None else SlipAt(int(first), -np.inf, slip))
    return clearest(found)


def step_between(found: SlipAt, parts: Sequence[Stretch], apart: Array) -> SlipAt:
    """Return the slip with its step from the residuals (T, N, 6), all rows in one, of a fit to what was before it."""
    means, recording = _windows(parts, apart[:, found.slip.robot], found.slip.robot)
    after = recording >= found.recording
    step = means[after].mean(0) - means[~after].mean(0)
    slip = found.slip
    return replace(found, slip=Slip.of(slip.robot, slip.row, step, slip.score), step=step)


def as_large_as_slips(slip: Slip) -> bool:
    """Tell whether a step between recordings is larger than errors, and no farther than a grasp slips."""
    large = slip.distance > LEAST_M or slip.angle > LEAST_RAD
    return large and slip.distance < MOST_M and slip.angle < MOST_RAD


def _windows(parts: Sequence[Stretch], apart: Array, robot: int) -> tuple[Array, Array]:
    """Return means (B, 6) of one robot's residuals (T, 6) over a second each, and the recording (B,) of each."""
    means, recording = [], []
    for number, (part, own) in enumerate(zip(parts, row_slices(parts), strict=True)):
        rows = apart[own][part.seen[:, robot]]
        pieces = min(round(len(rows) / (WINDOW_S * part.rate)), len(rows))
        for piece in np.array_split(rows, max(1, pieces)) if len(rows) else ():
            means.append(piece.mean(0))
            recording.append(number)
    return np.array(means).reshape(-1, 6), np.array(recording, np.int64)


def _step(means: Array, recording: Array, first: int, robot: int, chance: float) -> Slip | None:
    """Return the step at the beginning of a recording where it is large and beyond chance."""
    after = recording >= first
    freedom = len(means) - 2
    if freedom < WINDOWS - 2:
        return None
    step = means[after].mean(0) - means[~after].mean(0)
    left = means - np.where(after[:, None], means[after].mean(0), means[~after].mean(0))
    sides = sum(1 / len(np.unique(recording[side])) for side in (after, ~after))
    spread = left.T @ left / freedom * sides
    try:
        score = float(step @ np.linalg.solve(spread, step)) * (freedom - 5) / (6 * freedom)
    except np.linalg.LinAlgError:
        return None
    slip = Slip.of(robot, 0, step, score)
    return slip if as_large_as_slips(slip) and score > fdtri(6, freedom - 5, 1 - chance) else None
