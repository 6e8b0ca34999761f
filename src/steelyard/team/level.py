"""Robots that do not agree on where gravity points: what the one says that is alone is left out.

Motion tells how homes, or grasps, are turned, so that what every robot calls down can be compared. A base that is
tilted, a level sensor that sits askew, and twists that are given in other axes than gravity all show so.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding
from steelyard.spatial import unit_vectors
from steelyard.team.poses.covariance import Spread

# Bases that are said to be level, or told where gravity points, are so to within this [rad]; apart by more, and by so
# many standard deviations of how they are turned, one is not.
TILTED, BEYOND = 0.03, 5.0
# One is alone where the others agree by this factor better.
ALONE = 3.0
LEFT_OUT = "It was left out: gravity is what the others say."
MEAN = "The mean was taken; mass and centre of mass may be off by more than their bars."


@dataclass(frozen=True)
class Tilted:
    """Bases that disagree: number of the robot that is alone with what it says, None where nobody clearly is."""

    odd: int | None
    finding: Finding


def tilted(names: tuple[str, ...], down: Array, spread: Spread) -> Tilted | None:
    """Return who disagrees on where gravity points; None where all agree, or where some turn is not known.

    down  (N, 3) what each robot calls down, in common axes; zero of those who do not tell
    """
    who = np.flatnonzero(down.any(1))
    if len(who) < 2 or spread.blind.size:
        return None
    # Where nothing is lost, the size of the team does not matter.
    doubt = spread.turn(1.0)
    each = unit_vectors(down[who])
    apart = np.arccos(np.clip(each @ each.T, -1.0, 1.0))
    if apart.max() < max(TILTED, BEYOND * doubt):
        return None
    # The one who is farthest from the others, where those agree far better.
    odd = int(np.argmax(np.median(apart, axis=1)))
    others = np.delete(np.delete(apart, odd, 0), odd, 1)
    alone = len(who) > 2 and others.max() < apart.max() / ALONE
    if alone:
        degrees = np.rad2deg(float(np.median(np.delete(apart[odd], odd))))
        said = f"Gravity of '{names[who[odd]]}' points {degrees:.1f} deg from where that of the others does"
    else:
        i, j = (names[who[k]] for k in np.unravel_index(np.argmax(apart), apart.shape))
        said = f"Gravity of '{i}' and of '{j}' points {np.rad2deg(apart.max()):.1f} deg apart"
    text = (
        f"{said}, though motion tells how they are turned: a base, or a level sensor, is tilted, gravity is not what "
        f"was said, or twists are in other axes. {LEFT_OUT if alone else MEAN}"
    )
    return Tilted(int(who[odd]) if alone else None, Finding.of("base-tilted", text))
