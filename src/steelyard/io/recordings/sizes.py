"""What the size of numbers tells of their unit."""

from __future__ import annotations

from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.io.units import TIME, UNITS

_EPOCH = (1e9, 1e10)  # [s] stamps since 1970 lie here from 2001 to 2286
SLOWEST = 10.0  # [s] longer steps than this are not seconds
_ONE_G = (0.8, 1.25)  # size of an accelerometer reading in g
_GRAVITY = (9.7, 9.9)
_SPECIFIC_FORCE = (8.0, 12.0)
_FURTHEST = 20.0  # [m] beyond this no arm reaches


def unit_by_size(quantity: str, values: Array) -> str | None:
    """Return SI; an accelerometer shows whether it counts in g, and gravity that it is gravity."""
    size = median_size(values) if len(values) else 0.0
    if quantity == "specific_force" and _ONE_G[0] < size < _ONE_G[1]:
        return "g"
    low, high = {"specific_force": _SPECIFIC_FORCE, "gravity": _GRAVITY}.get(quantity, (-1.0, np.inf))
    return next(iter(UNITS[quantity])) if low < size < high or not np.isfinite(size) else None


def median_size(values: Array) -> float:
    """Return the median length of the rows of (N, 3) that hold numbers; NaN where none does."""
    sizes = np.linalg.norm(values[np.isfinite(values).all(-1)], axis=-1)
    return float(np.median(sizes)) if len(sizes) else float("nan")


def length_unit(values: Array | None) -> str:
    """Return mm for positions (N, 3) that no arm reaches in metres, else m."""
    return "mm" if values is not None and len(values) and median_size(values) > _FURTHEST else "m"


def angle_unit(values: Array | None) -> str | None:
    """Return deg for angles (N, 3) beyond a turn in rad, rad for others; None without any that is not zero.

    Degrees that never leave seven would hardly turn what is to be identified.
    """
    if values is None or not values.any():
        return None
    return "deg" if float(np.abs(values).max()) > 2 * np.pi else "rad"


def stamp_unit(stamps: np.ndarray[Any, np.dtype[Any]]) -> tuple[str | None, float]:
    """Return the unit of stamps (N,) since 1970, None of others; and their median step as they are."""
    known = stamps.astype(np.float64)
    known = known[np.isfinite(known)]
    step = float(np.median(np.diff(known))) if len(known) > 1 else 0.0
    since = [unit for unit, per_second in TIME.items() if len(known) and _EPOCH[0] < known[0] / per_second < _EPOCH[1]]
    return next(iter(since), None), step
