"""A grasp that slips while nobody records: its place against all others changes from one recording to the next.

Means over a second are compared, those of recordings before with those after. They scatter about the mean of their side
by noise and by whatever else differs between attitudes (soft grasps, levers, encoders), so that this scatter judges the
step; seconds of one recording are counted as one, since much of it may last.

Where bases move, all grasps are fitted before and after. Of the steps d (6 N) from one fit to the other one robot's
slip explains its own, or, of the reference, in whose frame all are told, those of all others: -Ad(G_i^-1) s. The robot
that explains most by the covariance of both fits is it.
Source: own; Hotelling's T^2.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy.special import fdtri, gammainccinv

from steelyard.check import BREAKDOWNS, Array
from steelyard.errors import CannotAnswer
from steelyard.team.adjoint import adjoint_inverse, log
from steelyard.team.changes.slips import WINDOW_S, Slip, clearest
from steelyard.team.stacked import Stretch
from steelyard.team.twists.fit import TwistFit
from steelyard.team.twists.rows import TwistStretch

# How likely noise alone may be taken for a slip, in one log, and the size [m, rad] from which a step counts.
CHANCE, LEAST_M, LEAST_RAD = 1e-4, 2e-3, 4e-3
# What moves farther does not slip: another robot's file, or a base that was carried away.
MOST_M, MOST_RAD = 0.15, 0.6
# Windows that are needed to tell their scatter.
WINDOWS = 16
# Standard deviations of fits to some seconds are too small by so much, where noise hangs together for a tenth of one.
WIDER = 1.5


def slip_between(parts: Sequence[Stretch], apart: Sequence[Array]) -> Slip | None:
    """Return the clearest slip between two recordings, None where there is none.

    apart  (T, N, 6) rotation vector and position of each grasp against what the others say, of every recording
    """
    found, count = list[Slip | None](), parts[0].seen.shape[1]
    for robot in range(count if len(parts) > 1 else 0):
        means, recording = _windows(parts, apart, robot)
        for first in np.unique(recording)[1:]:
            found.append(_step(means, recording, int(first), robot, CHANCE / (count * (len(parts) - 1))))
    return clearest(found)


def step_between(found: Slip, parts: Sequence[Stretch], apart: Sequence[Array]) -> Slip:
    """Return the slip with its step from the residuals (T, N, 6) of every recording of a fit to what was before it."""
    means, recording = _windows(parts, apart, found.robot)
    after = recording >= found.recording
    return replace(found, step=means[after].mean(0) - means[~after].mean(0))


def as_large_as_slips(slip: Slip) -> bool:
    """Tell whether a step between recordings is larger than errors, and no farther than a grasp slips."""
    large = slip.distance > LEAST_M or slip.angle > LEAST_RAD
    return large and slip.distance < MOST_M and slip.angle < MOST_RAD


def _windows(parts: Sequence[Stretch], apart: Sequence[Array], robot: int) -> tuple[Array, Array]:
    """Return means (B, 6) of one robot's residuals over a second each, and the recording (B,) of each."""
    means, recording = [], []
    for number, (part, left) in enumerate(zip(parts, apart, strict=True)):
        rows = left[part.seen[:, robot], robot]
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
    slip = Slip(robot, first, -np.inf, step, score)
    return slip if as_large_as_slips(slip) and score > fdtri(6, freedom - 5, 1 - chance) else None


def slip_between_twists(
    parts: Sequence[TwistStretch], reference: int, fitted: Callable[[Sequence[TwistStretch]], TwistFit]
) -> Slip | None:
    """Return the clearest slip between two recordings in motion, None where there is none.

    fitted  makes the joint fit of some recordings
    """
    moving = [number for number, part in enumerate(parts) if part.rows.kind != "still"]
    slips = list[Slip | None]()
    for last, first in pairwise(moving):
        sides = [[parts[k] for k in moving if (k < first) == before] for before in (True, False)]
        try:
            before, after = (fitted(side) for side in sides)
        except (CannotAnswer, *BREAKDOWNS):
            continue
        found = _step_of_fits(before, after, reference, CHANCE / (parts[0].seen.shape[1] * (len(moving) - 1)))
        slips.append(None if found is None else replace(found, recording=first, since=last))
    return clearest(slips)


def _step_of_fits(before: TwistFit, after: TwistFit, reference: int, chance: float) -> Slip | None:
    """Return the slip from one fit to another where it is large and beyond chance."""
    if before.spread.blind.size or after.spread.blind.size:
        return None
    count = len(before.noise)
    others = np.repeat(np.arange(count) != reference, 6)
    moved = log(before.grasps.inverse() @ after.grasps).ravel()[others]
    weight = np.linalg.inv((before.spread.full + after.spread.full)[np.ix_(others, others)]) / WIDER**2
    ways = np.zeros((count, 6 * count, 6))
    for robot in range(count):
        ways[robot, 6 * robot : 6 * robot + 6] = np.eye(6)
    ways[reference] = -adjoint_inverse(before.grasps).reshape(-1, 6)
    information = np.einsum("nki,kl,nlj->nij", ways[:, others], weight, ways[:, others])
    pull = ways[:, others].swapaxes(1, 2) @ (weight @ moved)
    steps = np.linalg.solve(information, pull[..., None])[..., 0]
    scores = (steps * pull).sum(1)
    robot = int(np.argmax(scores))
    slip = Slip(robot, 0, -np.inf, steps[robot], float(scores[robot]))
    return slip if as_large_as_slips(slip) and slip.score >= 2 * gammainccinv(3.0, chance) else None
