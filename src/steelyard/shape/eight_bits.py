"""Colours as eight bits, however they were given."""

from __future__ import annotations

from typing import Any

import numpy as np

from steelyard.errors import BadValue

Colours = np.ndarray[Any, np.dtype[np.uint8]]
_BRIGHT = 2.0  # floats up to here are 0..1, some of them overexposed: read as 0..255 they would all be black


def eight_bits(values: Any) -> Colours:
    """Return colours of any shape as 8 bits, of numbers 0..255, floats 0..1 or 16-bit numbers.

    What is not known is black. Raises BadValue where they are none of these.
    """
    array = np.asarray(values)
    if array.dtype == np.uint8 or array.dtype.kind not in "fiu" or not array.size:
        return np.array(array, dtype=np.uint8)
    levels = np.nan_to_num(array.astype(np.float64))
    least, most = float(levels.min()), float(levels.max())
    if array.dtype.kind == "f" and most <= _BRIGHT:
        levels = 255 * np.minimum(levels, 1.0)
    elif array.dtype == np.uint16 and most > 255:
        levels /= 257
    if levels.min() <= -1 or levels.max() >= 256:  # rounding may lead a little beyond
        raise BadValue(
            f"colours must be numbers 0 to 255, or floats 0 to 1; they go from {least:.4g} to {most:.4g}. "
            "Scale them, or leave them out."
        )
    return np.round(np.clip(levels, 0, 255)).astype(np.uint8)
