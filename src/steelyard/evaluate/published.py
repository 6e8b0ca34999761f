"""The size-based errors as the published code computes them: for the table only, never to judge by.

The code of "The Sum of Its Parts" keeps the centre-of-mass error in an array of integers, so that each axis loses what
is behind the decimal point, and divides by the box of its own estimated shape, which is thicker than the object.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from steelyard import check
from steelyard.evaluate import bodies
from steelyard.evaluate.bodies import Scores
from steelyard.inertia import InertialParameters


def score_as_published(found: InertialParameters, true: InertialParameters, edges: ArrayLike) -> Scores:
    """Score one body by the box `edges` (3,) [m] of its estimated shape, centre-of-mass percents floored per axis.

    The published code takes |R (max - min)| of the estimated points, with R turning O into S: these are the edges of a
    box along the axes of S only where R swaps axes.
    """
    box = check.vectors("edges", edges)
    floored = np.floor(100 * np.abs(found.com - true.com) / box)
    right = bodies.score(found, true, np.stack([np.zeros(3), box]))
    return replace(right, com_pct=float(floored.mean()))
