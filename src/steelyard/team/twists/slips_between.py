"""A grasp that slips between two recordings of a team whose bases move: all grasps are fitted before and after.

Of the steps d (6 N) from one fit to the other one robot's slip explains its own, or, of the reference, in whose frame
all are told, those of all others: -Ad(G_i^-1) s. The robot that explains most by the covariance of both fits is it.
Source: own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
from scipy.special import gammainccinv

from steelyard.check import BREAKDOWNS, Array
from steelyard.errors import CannotAnswer
from steelyard.team.adjoint import adjoint_inverse, log
from steelyard.team.changes.slips import Slip, SlipAt, clearest
from steelyard.team.changes.slips_between import CHANCE, as_large_as_slips
from steelyard.team.twists.fit import TwistFit
from steelyard.team.twists.rows import TwistStretch

# Standard deviations of fits to some seconds are too small by so much, where noise hangs together for a tenth of one.
WIDER = 1.5


def slip_between(
    parts: Sequence[TwistStretch], reference: int, fitted: Callable[[Sequence[TwistStretch]], TwistFit]
) -> SlipAt | None:
    """Return the clearest slip between two recordings in motion, None where there is none.

    fitted  makes the joint fit of some recordings
    """
    moving = [number for number, part in enumerate(parts) if part.rows.kind != "still"]
    slips = list[SlipAt | None]()
    for last, first in pairwise(moving):
        sides = [[parts[k] for k in moving if (k < first) == before] for before in (True, False)]
        try:
            before, after = (fitted(side) for side in sides)
        except (CannotAnswer, *BREAKDOWNS):
            continue
        found = _step(before, after, reference, CHANCE / (parts[0].seen.shape[1] * (len(moving) - 1)))
        slips.append(None if found is None else SlipAt(first, -np.inf, *found, since=last))
    return clearest(slips)


def _step(before: TwistFit, after: TwistFit, reference: int, chance: float) -> tuple[Slip, Array] | None:
    """Return the slip from one fit to another, and its step (6,), where it is large and beyond chance."""
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
    slip = Slip.of(robot, 0, steps[robot], float(scores[robot]))
    if not as_large_as_slips(slip) or slip.score < 2 * gammainccinv(3.0, chance):
        return None
    return slip, steps[robot]
