"""Data files as named columns: finding the file, choosing its reader, choosing its columns."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

from steelyard.errors import BadDescription, BadFile
from steelyard.io.entries import close_match, listed
from steelyard.io.table_header import Column, Columns, Header

TEXT = (".csv", ".tsv", ".txt")
KINDS = ".csv, .tsv, .txt (also .gz), .npz, .parquet, and bags: .mcap, .db3, .bag"


class Table(Protocol):
    """A data file that is open for reading columns."""

    @property
    def path(self) -> Path:
        """The file."""

    @property
    def header(self) -> Header:
        """Its columns."""

    def read(self, columns: Sequence[int], exact: Sequence[int] = ()) -> Columns:
        """Return columns by number, float64; those in `exact` stay int64 where the file writes integers."""


def open_table(path: Path, topic: str | None = None, frames: tuple[str, str] | None = None) -> Table:
    """Look at the head of a data file and return its table; raises BadFile.

    topic   that of a bag
    frames  of a topic of transforms: the pose of the second in the first
    """
    from steelyard.io import bags
    from steelyard.io.tables import array_table, bag_table, parquet_table, text_table, transform_table

    suffix = (Path(path.stem) if path.suffix.lower() == ".gz" else path).suffix.lower()
    if bags.is_bag(path):
        if topic is not None and frames is not None:
            return transform_table.TransformTable.open(path, topic, frames)
        return bag_table.BagTable.open(path, topic)
    if path.is_dir() and (inside := bags.bag_in(path)):
        raise BadFile(f"{path}: the folder of a bag, without its metadata.yaml. Name the file in it: {inside.name}")
    if topic is not None:
        raise BadDescription(f'{path}: "topic" belongs to a bag ({", ".join(bags.SUFFIXES)}, or the folder of one).')
    if path.is_dir():
        raise BadFile(f"{path}: this is a folder, not a file of data. Name the file in it.")
    if suffix not in (*TEXT, ".npz", ".parquet"):
        raise BadFile(f'{path}: unknown kind of data file "{suffix or path.name}". Readable are {KINDS}.')
    if path.stat().st_size == 0:
        raise BadFile(f"{path}: the file is empty (0 bytes). Record again, or correct the path.")
    if suffix == ".npz":
        return array_table.ArrayTable.open(path)
    if suffix == ".parquet":
        return parquet_table.ParquetTable.open(path)
    return text_table.TextTable.open(path)


def find_file(name: str, folder: Path, data: Path | None, asked: str = "") -> Path:
    """Return the file `name`, sought in `data`, $STEELYARD_DATA, `folder`; raises BadFile naming them.

    asked  the place of the description that asks for it; empty where a person does
    """
    by = f"{asked}: " if asked else ""
    if Path(name).is_absolute():
        if Path(name).exists():
            return Path(name)
        raise BadFile(f"{by}{name}: no such file.")
    environment = os.environ.get("STEELYARD_DATA")
    folders = [data] if data else []
    folders += [Path(environment)] if environment else []
    folders.append(folder)
    for each in folders:
        if (each / name).exists():
            return each / name
    raise BadFile(
        f'{by}"{name}" was not found. Searched: {", ".join(str(each.absolute()) for each in folders)}. '
        "Correct the path, or give the folder of the data with --data DIR or STEELYARD_DATA."
    )


def choose_columns(header: Header, wanted: Sequence[Column], count: int | None, where: str) -> tuple[int, ...]:
    """Return the numbers of the `count` columns (any, if None) that `wanted` names; raises BadDescription."""
    numbers = [n for column in wanted for n in _find(header, column, where)]
    if count is not None and len(numbers) != count:
        raise BadDescription(f"{where}: {count} columns are needed; {list(wanted)} gives {len(numbers)}.")
    return tuple(numbers)


def _find(header: Header, column: Column, where: str) -> tuple[int, ...]:
    if isinstance(column, int):
        if column >= header.count:
            raise BadDescription(
                f"{where}: there is no column {column}; the file has {header.count}, 0 to {header.count - 1}."
            )
        return (column,)
    if header.names is None:
        raise BadDescription(
            f'{where}: there is no column "{column}", because the file has no header. '
            f"Give column numbers from 0 to {header.count - 1}."
        )
    if column in header.groups:
        return header.groups[column]
    found = header.names.count(column)
    if found == 1:
        return (header.names.index(column),)
    if found:
        raise BadDescription(
            f'{where}: the name "{column}" stands over {found} columns. Rename all but one, or give column numbers.'
        )
    there = header.shown()
    raise BadDescription(
        f'{where}: there is no column "{column}".{close_match(column, there)} Columns here: {listed(there)}.'
    )
