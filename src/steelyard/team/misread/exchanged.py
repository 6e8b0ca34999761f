"""Two robots whose files stand in each other's place in one recording, so that no grasps and homes fit them all.

Exchanged in every recording they are merely called by each other's name, which no pose can tell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from steelyard.errors import BadValue
from steelyard.logs.team_log import TeamLog
from steelyard.spatial import Pose
from steelyard.team.misread.poses import Judge
from steelyard.team.poses.measured import in_words
from steelyard.team.stacked import Stretch, stretches

# Rows of a recording that are enough to tell; exchanges that are tried at most.
ROWS, MOST = 100, 120
# The noise of all robots' turns and places must fall by this factor each on average.
CLOSES = 5.0


def require_own_files(log: TeamLog) -> None:
    """Raise BadValue where exchanging two robots in one recording makes poses fit that do not fit as they are.

    Clocks are taken as they are: what a fit makes of them where files are exchanged is nothing to go by.
    """
    names, reference = log.names, log.names.index(log.reference)
    parts = stretches(log, {})
    few = tuple(part.thinned(ROWS) for part in parts)
    judge = Judge(names, reference)
    as_given, tried = judge(few, True), list(_exchanges(few))
    if not as_given.fits or len(tried) > MOST:
        return
    best, noise = None, as_given.noise
    for number, pair in tried:
        found = judge((*few[:number], _exchanged(few[number], *pair), *few[number + 1 :]), True)
        if found.fits and found.noise.prod() < noise.prod():
            best, noise = (number, pair), found.noise
    if best is None or float(np.log(as_given.noise / noise).mean()) < np.log(CLOSES):
        return
    number, (i, j) = best
    where = " or ".join(f"'{part.name}'" for part in (parts if len(parts) == 2 else parts[number : number + 1]))
    raise BadValue(
        f"the files of '{names[i]}' and '{names[j]}' look exchanged in {where}: with each in the other's place, "
        f"what robots say of their poses differs by {in_words(noise)}, as given by {in_words(as_given.noise)}. "
        'Exchange their "path" there.'
    )


def _exchanges(parts: Sequence[Stretch]) -> list[tuple[int, tuple[int, int]]]:
    """Return recordings and pairs of robots to try; of two recordings, either one is as good."""
    numbers = range(len(parts)) if len(parts) > 2 else range(len(parts) - 1)
    return [
        (number, (i, j))
        for number in numbers
        for i, j in combinations(range(parts[0].seen.shape[1]), 2)
        if parts[number].seen[:, i].any() or parts[number].seen[:, j].any()
    ]


def _exchanged(part: Stretch, i: int, j: int) -> Stretch:
    order = np.arange(part.seen.shape[1])
    order[[i, j]] = j, i
    return replace(
        part, poses=Pose(part.poses.rotation[:, order], part.poses.position[:, order]), seen=part.seen[:, order]
    )
