"""Means and medians over runs of which some have no number."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np


def middle_of(values: Sequence[Any], middle: Callable[..., Any] = np.mean) -> Any:
    """Return the mean or another `middle` of numbers or lists of them, without those that are None; None for none."""
    known = [value for value in values if value is not None]
    return np.asarray(middle(known, axis=0)).tolist() if known else None
