"""What a table holds before its rows are read, and columns once they are."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

Column = str | int  # as a description names one
Columns = dict[int, np.ndarray[Any, np.dtype[Any]]]


@dataclass(frozen=True)
class Header:
    """What a table holds before its rows are read.

    names   one per column; None where a text file has no header
    count   number of columns
    groups  arrays with several columns (NPZ, lists in cells): name -> its column numbers
    dates   numbers of the columns of a text that hold dates
    words   numbers of the columns of a text that hold neither numbers nor dates
    shapes  shape of every array of an NPZ, also of those that are no columns
    """

    names: tuple[str, ...] | None
    count: int
    groups: dict[str, tuple[int, ...]] = field(default_factory=dict)
    dates: tuple[int, ...] = ()
    words: tuple[int, ...] = ()
    shapes: dict[str, tuple[int, ...]] = field(default_factory=dict)

    def shown(self) -> list[str]:
        """Return the names to list in a message: arrays with several columns appear once."""
        inner = {n for group in self.groups.values() for n in group}
        return [*self.groups, *(name for n, name in enumerate(self.names or ()) if n not in inner)]
