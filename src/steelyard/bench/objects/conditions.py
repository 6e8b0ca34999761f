"""Condition numbers of the bench's motions, properly and as the paper counts them, beside what it prints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from steelyard.bench.middles import middle_of
from steelyard.logs.log import MotionLog
from steelyard.simulate.conditions import condition, condition_as_published

# "The Sum of Its Parts", section V-A: averages over its simulated trajectories.
PRINTED = {"low": 74.0, "moderate": 92.0, "high": 99.0}


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
