"""Numbers of a text cloud or mesh, in the type that its header announces."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadFile

_LONGEST_NUMBER = 400  # characters: the longest that Python writes of a double has some 330


def numbers(path: Path, what: str, words: Sequence[bytes]) -> Array:
    """Return words (N,) as numbers; raises BadFile, which names `what` they are of, where one is none."""
    other = BadFile(f"{path}: {what} holds a word that is no number.")
    if max(map(len, words), default=0) > _LONGEST_NUMBER:
        raise other  # an array of words gives each of them the room of the longest
    try:
        return np.array(words, dtype="S").astype(np.float64)
    except ValueError:
        raise other from None


def typed(path: Path, what: str, values: Array, kind: str | np.dtype[Any]) -> np.ndarray[Any, np.dtype[Any]]:
    """Return values (N, ..) as `kind`; raises BadFile where `what` counts in integers and a value does not fit.

    NaN and numbers beyond the range would become any integer, and of fractions the whole part would be left.
    """
    dtype = np.dtype(kind)
    if dtype.kind in "iu":
        low, high = int(np.iinfo(dtype).min), int(np.iinfo(dtype).max)
        good = (values >= low) & (values < float(high) + 1) & (values == np.rint(values))
        if not good.all():
            raise BadFile(
                f"{path}: {what} holds {values[~good].flat[0]:g}; expected integers from {low} to {high}. "
                "Save the file again."
            )
    return values.astype(dtype)
