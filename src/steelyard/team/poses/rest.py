"""How much a pose at rest tells, however many rows it was logged for.

Encoders in steps, eccentric joints and bent arms err alike in all rows of a rest, and anew in each row of a motion: a
second at rest counted as a hundred rows pulls grasps to its own error. How much alike is seen in what a fit leaves:
means over rests against means over as many rows of motion.
Source: own.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from steelyard.check import Array
from steelyard.team.poses.fit import PoseFit
from steelyard.team.stacked import Stretch, row_slices

# Rows that a rest must have, and rests and windows of motion that must be there to be compared.
ROWS, RESTS, WINDOWS = 10, 2, 4
# Rests that would count more than this are left as they are: chance.
LESS = 0.5


def shares_at_rest(parts: Sequence[Stretch], fit: PoseFit) -> Array | None:
    """Return how much each row (T,) counts, below one at rest; None where all count alike."""
    rest = [part.kind == "still" for part in parts]
    sizes = [len(part) for part in parts]
    rows = round(np.median([n for n, still in zip(sizes, rest, strict=True) if still] or [0]))
    if rows < ROWS or all(rest):
        return None
    resting, moving = list[float](), list[float]()
    for part, own, still in zip(parts, row_slices(parts), rest, strict=True):
        left = (fit.rows.residual[own] / np.repeat(fit.noise, 3, axis=1))[part.seen.all(1)]
        if len(left) >= rows / 2:
            pieces = 1 if still else max(1, len(left) // rows)
            means = [(piece.mean(0) ** 2).mean() for piece in np.array_split(left, pieces)]
            (resting if still else moving).extend(means)
    if len(resting) < RESTS or len(moving) < WINDOWS:
        return None
    share = max(float(np.mean(moving)) / max(float(np.mean(resting)), 1e-300), 1 / rows)
    return np.repeat(np.where(rest, share, 1.0), sizes) if share < LESS else None
