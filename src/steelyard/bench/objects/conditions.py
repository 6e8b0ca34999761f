"""Condition numbers of the bench's motions, properly and as the paper counts them, beside what it prints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from steelyard.bench.middles import middle_of
from steelyard.logs.log import MotionLog
from steelyard.logs.moments import regressors

# "The Sum of Its Parts", section V-A: averages over its simulated trajectories.
PRINTED = {"low": 74.0, "moderate": 92.0, "high": 99.0}
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


def conditions(log: MotionLog) -> dict[str, float | None]:
    """Return both condition numbers of a log; None where the motion does not tell all ten parameters."""
    found = {"properly": condition(log), "as_published": condition_as_published(log)}
    return {name: value if np.isfinite(value) else None for name, value in found.items()}


def condition_means(objects: Sequence[dict[str, dict[str, float | None]]]) -> dict[str, dict[str, float | None]]:
    """Return <noise>.<properly|as_published|printed>: means over the objects that have one, and the paper's figure."""
    out: dict[str, dict[str, float | None]] = {}
    for noise in objects[0] if objects else ():
        means = {name: middle_of([each[noise][name] for each in objects]) for name in ("properly", "as_published")}
        out[noise] = means | {"printed": PRINTED.get(noise)}
    return out


def condition_lines(found: dict[str, Any]) -> list[str]:
    """Return one line per noise scenario."""
    lines = []
    for noise, row in found.items():
        own, counted, printed = (
            "-" if row[k] is None else f"{row[k]:.3g}" for k in ("properly", "as_published", "printed")
        )
        lines.append(f"condition number, {noise}: {own}; as the paper counts it {counted}; it prints {printed}")
    return lines
