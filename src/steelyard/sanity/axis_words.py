"""Axes and directions as findings tell them."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array


def axis_words(axis: Array) -> str:
    """Return an axis (3,), which points either way, with its largest component positive."""
    return _listed(axis * np.sign(axis[np.abs(axis).argmax()]), 2)


def direction_words(vector: Array) -> str:
    """Return where a vector (3,) points."""
    return _listed(vector / np.linalg.norm(vector), 3)


def _listed(vector: Array, places: int) -> str:
    # Adding zero turns a minus zero, which rounding leaves, into a plain one.
    return ", ".join(f"{v:.{places}f}" for v in np.round(vector, places) + 0.0)
