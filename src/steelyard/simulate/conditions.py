"""How well a motion excites the ten parameters: the condition number properly, and as the paper reports it."""

from __future__ import annotations

import numpy as np

from steelyard.logs.log import MotionLog
from steelyard.logs.moments import regressors

# Entries of the regressors that change by less than this share of its largest do not change at all.
CONSTANT = 1e-12


def condition(log: MotionLog) -> float:
    """Return the condition number of the stacked regressors (6 N, 10) with columns scaled to length 1.

    Infinite where the motion does not excite all ten parameters.
    Source: Gautier and Khalil 1992, with the column scaling that makes it independent of units.
    """
    stacked = regressors(log).reshape(-1, 10)
    length = np.linalg.norm(stacked, axis=0)
    if (length == 0).any():
        return float("inf")
    values = np.linalg.svd(stacked / length, compute_uv=False)
    return float(values[0] / values[-1]) if values[-1] > 0 else float("inf")


def condition_as_published(log: MotionLog) -> float:
    """Return the number that "The Sum of Its Parts" prints, section V-A: not the condition of the stacked regressors.

    Every entry of the 6 x 10 blocks is scaled to 0..1 over time, each block is decomposed by itself, and the largest
    singular value of any block is divided by the smallest of any block. Entries that never change are left at zero.
    """
    blocks = regressors(log)
    low, high = blocks.min(0), blocks.max(0)
    moves = high - low > CONSTANT * np.abs(blocks).max()
    scaled = np.where(moves, (blocks - low) / np.where(moves, high - low, 1.0), 0.0)
    values = np.linalg.svd(scaled, compute_uv=False)
    smallest = float(values.min())
    return float(values.max()) / smallest if smallest > 0 else float("inf")
