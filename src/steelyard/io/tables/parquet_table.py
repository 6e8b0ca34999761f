"""Parquet files as tables: the one module that imports pyarrow (extra `parquet`)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from steelyard.errors import BadFile, MissingDependency
from steelyard.io.contents import require_bounded
from steelyard.io.tables.files import Columns, Header


def _pyarrow() -> tuple[Any, Any]:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise MissingDependency.of("pyarrow", "parquet", "Reading .parquet files") from None
    return pyarrow, pyarrow.parquet


@dataclass(frozen=True)
class ParquetTable:
    """A Parquet file; stamps of a timestamp type are dates, whatever unit that type counts in."""

    path: Path
    header: Header

    @classmethod
    def open(cls, path: Path) -> ParquetTable:
        """Read the schema only; raises BadFile or MissingDependency."""
        arrow, parquet = _pyarrow()
        try:
            schema = parquet.read_schema(path)
        except (arrow.ArrowException, OSError):
            raise BadFile(f"{path}: expected a Parquet file; found something else.") from None
        names = tuple(schema.names)
        dates = tuple(n for n, name in enumerate(names) if arrow.types.is_timestamp(schema.field(name).type))
        return cls(path, Header(names, len(names), dates=dates))

    def read(self, columns: Sequence[int], exact: Sequence[int] = ()) -> Columns:
        """Return columns by number; nulls become NaN, dates in `exact` datetime64[ns]. Raises BadFile."""
        arrow, parquet = _pyarrow()
        names = self.header.names or ()
        wanted = sorted({names[n] for n in columns})
        try:
            said = parquet.read_metadata(self.path)
            require_bounded(self.path, 8 * len(wanted) * said.num_rows)
            self._require_numbers(arrow, parquet.read_schema(self.path), wanted)
            table = parquet.read_table(self.path, columns=wanted)
        except (arrow.ArrowException, OSError) as error:
            raise BadFile(f"{self.path}: this Parquet file is damaged ({error}).") from None
        return {n: self._column(arrow, table.column(names[n]), n in exact) for n in columns}

    def _require_numbers(self, arrow: Any, schema: Any, names: Sequence[str]) -> None:
        """Raise BadFile where a column holds anything else, before its rows are unpacked: texts have no bound."""
        number = (arrow.types.is_timestamp, arrow.types.is_decimal, arrow.types.is_integer, arrow.types.is_floating)
        for name in names:
            kind = schema.field(name).type
            if not any(is_one(kind) for is_one in number):
                raise BadFile(f'{self.path}: column "{name}" must hold numbers; it holds {kind}.')

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
