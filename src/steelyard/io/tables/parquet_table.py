"""Parquet files as tables: the one module that imports pyarrow (extra `parquet`)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadFile, MissingDependency
from steelyard.io.contents import require_bounded
from steelyard.io.tables.files import WIDEST, Columns, Header, spread_columns

_FIRST = 100  # rows among which a list is sought


def _pyarrow() -> tuple[Any, Any]:
    try:
        import pyarrow
        import pyarrow.compute
        import pyarrow.parquet
    except ImportError:
        raise MissingDependency.of("pyarrow", "parquet", "Reading .parquet files") from None
    return pyarrow, pyarrow.parquet


@dataclass(frozen=True)
class ParquetTable:
    """A Parquet file; stamps of a timestamp type are dates, whatever unit that type counts in.

    Lists that are as long in every row, as LeRobot writes states, have a column per item: force -> force[0], ..
    """

    path: Path
    header: Header
    sources: tuple[tuple[str, int], ...]  # per column: name of the field and the item inside its lists

    @classmethod
    def open(cls, path: Path) -> ParquetTable:
        """Read the schema only, and the first row of lists; raises BadFile or MissingDependency."""
        arrow, parquet = _pyarrow()
        try:
            with parquet.ParquetFile(path) as file:
                fields = list(file.schema_arrow)
                widths = [(field.name, _width(arrow, file, field)) for field in fields]
        except (arrow.ArrowException, OSError):
            raise BadFile(f"{path}: expected a Parquet file; found something else.") from None
        names, groups = spread_columns(widths)
        sources = tuple((name, i) for name, width in widths for i in range(1 if width is None else width))
        stamped = {field.name for field in fields if arrow.types.is_timestamp(field.type)}
        dates = tuple(n for n, (name, _) in enumerate(sources) if name in stamped)
        return cls(path, Header(names, len(names), groups, dates), sources)

    def read(self, columns: Sequence[int], exact: Sequence[int] = ()) -> Columns:
        """Return columns by number; nulls become NaN, dates in `exact` datetime64[ns]. Raises BadFile."""
        arrow, parquet = _pyarrow()
        wanted = sorted({self.sources[n][0] for n in columns})
        items = sum(len(self.header.groups.get(name, "1")) for name in wanted)
        try:
            said = parquet.read_metadata(self.path)
            require_bounded(self.path, 8 * items * said.num_rows)
            self._require_numbers(arrow, parquet.read_schema(self.path), wanted)
            table = parquet.read_table(self.path, columns=wanted)
        except (arrow.ArrowException, OSError) as error:
            raise BadFile(f"{self.path}: this Parquet file is damaged ({error}).") from None
        lists = {name: self._items(arrow, table.column(name), name) for name in wanted if name in self.header.groups}
        out: Columns = {}
        for n in columns:
            name, item = self.sources[n]
            out[n] = lists[name][:, item] if name in lists else self._column(arrow, table.column(name), n in exact)
        return out

    def _require_numbers(self, arrow: Any, schema: Any, names: Sequence[str]) -> None:
        """Raise BadFile where a column holds anything else, before its rows are unpacked: texts have no bound."""
        number = (arrow.types.is_timestamp, arrow.types.is_decimal, arrow.types.is_integer, arrow.types.is_floating)
        for name in names:
            if schema.names.count(name) > 1:
                raise BadFile(f'{self.path}: several columns are called "{name}". Rename all but one.')
            kind = schema.field(name).type
            inner = kind.value_type if name in self.header.groups else kind
            if not any(is_one(inner) for is_one in number):
                raise BadFile(f'{self.path}: column "{name}" must hold numbers; it holds {kind}.')

    def _items(self, arrow: Any, column: Any, name: str) -> Array:
        """Return lists as (N, width), NaN where there is none; raises BadFile where one is longer or shorter."""
        width = len(self.header.groups[name])
        lengths = arrow.compute.list_value_length(column).to_numpy().astype(np.float64)  # NaN of a null
        known = ~np.isnan(lengths)
        other = np.flatnonzero(known & (lengths != width))
        if len(other):
            raise BadFile(
                f'{self.path}: the lists of column "{name}" have {width} items, and {lengths[other[0]]:.0f} in row '
                f"{other[0] + 1}. Write as many in each row."
            )
        out = np.full((len(lengths), width), np.nan)
        items = self._column(arrow, arrow.compute.list_flatten(column), exact=False)
        out[known] = items.reshape(-1, width)
        return out

    @staticmethod
    def _column(arrow: Any, column: Any, exact: bool) -> np.ndarray[Any, np.dtype[Any]]:
        kind = column.type
        if arrow.types.is_timestamp(kind):
            if exact:
                return np.asarray(column.cast(arrow.timestamp("ns"), safe=False).to_numpy(), dtype="M8[ns]")
            column, kind = column.cast(arrow.int64()), arrow.int64()
        if arrow.types.is_decimal(kind):
            column, kind = column.cast(arrow.float64()), arrow.float64()
        if exact and arrow.types.is_integer(kind) and column.null_count == 0:
            return np.asarray(column.to_numpy(), dtype=np.int64)
        return np.asarray(column.to_numpy(), dtype=np.float64)


def _width(arrow: Any, file: Any, field: Any) -> int | None:
    """Return how many items each list of a field has, by the first one; None of a field that holds no such lists."""
    kind = field.type
    if arrow.types.is_fixed_size_list(kind):
        width = int(kind.list_size)
    elif arrow.types.is_list(kind) or arrow.types.is_large_list(kind):
        rows = (batch.column(0)[0] for batch in islice(file.iter_batches(1, columns=[field.name]), _FIRST))
        width = next((len(row) for row in rows if row.is_valid), 0)
    else:
        return None
    return width if width <= WIDEST else None
