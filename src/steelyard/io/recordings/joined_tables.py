"""Tables of several streams joined by time: a row belongs to the streams that it holds numbers of.

PlotJuggler and pandas write topics so (an outer join): where one has a sample, the cells of the others are empty.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from steelyard.check import Mask
from steelyard.io.recordings.stream_files import time_columns
from steelyard.io.streams.entries import StreamSpec
from steelyard.io.table_header import Columns
from steelyard.io.tables.files import Table


def own_rows(specs: Sequence[StreamSpec], tables: Sequence[Table], cells: Sequence[Columns]) -> list[Columns]:
    """Return the cells of every stream without rows in which all its quantities are empty, where others share its file.

    Streams without stamps keep all: their rows belong to those of the others by number.
    """
    shared = [id(table) for table in tables]
    stamps = [time_columns(spec, table) for spec, table in zip(specs, tables, strict=True)]
    return [
        _own(mine, clock) if clock and shared.count(table) > 1 else mine
        for mine, clock, table in zip(cells, stamps, shared, strict=True)
    ]


def _own(cells: Columns, clock: Sequence[int]) -> Columns:
    """Return the rows that hold a quantity; all where none does, or where lengths differ, which others refuse."""
    if len({len(column) for column in cells.values()}) > 1:
        return cells
    empty: Mask = np.logical_and.reduce([np.isnan(column) for n, column in cells.items() if n not in clock])
    return cells if empty.all() or not empty.any() else {n: column[~empty] for n, column in cells.items()}
