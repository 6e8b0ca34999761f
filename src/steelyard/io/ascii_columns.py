"""Numbers of a text in the type that its header announces."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadFile


def typed(path: Path, what: str, values: Array, kind: str | np.dtype[Any]) -> np.ndarray[Any, np.dtype[Any]]:
    """Return values (N, ..) as `kind`; raises BadFile where `what` counts in integers and a value does not fit.

    NaN and numbers beyond the range would become any integer.
    """
    dtype = np.dtype(kind)
    if dtype.kind in "iu":
        low, high = int(np.iinfo(dtype).min), int(np.iinfo(dtype).max)
        good = (values >= low) & (values < float(high) + 1)
        if not good.all():
            raise BadFile(
                f"{path}: {what} holds {values[~good].flat[0]:g}; expected integers from {low} to {high}. "
                "Save the file again."
            )
    return values.astype(dtype)
