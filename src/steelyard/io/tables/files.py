"""Data files as named columns: what a table holds before its rows are read, finding the file, choosing its columns."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from steelyard.errors import BadDescription, BadFile
from steelyard.io.entries import close_match, listed
from steelyard.io.units import apart

Column = str | int  # as a description names one
Columns = dict[int, np.ndarray[Any, np.dtype[Any]]]

TEXT = (".csv", ".tsv", ".txt")
WIDEST = 4096  # an array with more columns is no quantity of a log


@dataclass(frozen=True)
class Header:
    """What a table holds before its rows are read.

    names   one per column; None where a text file has no header
    count   number of columns
    groups  arrays with several columns (NPZ, lists in cells): name -> its column numbers
    dates   numbers of the columns of a text that hold dates
    words   numbers of the columns of a text that hold neither numbers nor dates
    units   words of a row of units under the header, one per column; none where there is no such row
    shapes  shape of every array of an NPZ, also of those that are no columns
    """

    names: tuple[str, ...] | None
    count: int
    groups: dict[str, tuple[int, ...]] = field(default_factory=dict)
    dates: tuple[int, ...] = ()
    words: tuple[int, ...] = ()
    units: tuple[str, ...] = ()
    shapes: dict[str, tuple[int, ...]] = field(default_factory=dict)

    def unit(self, column: int) -> str:
        """Return the unit over a column, in brackets behind its name or in a row of units; "" where there is none."""
        if self.names is None or any(column in group for group in self.groups.values()):
            return ""
        return apart(self.names[column])[1] or (self.units[column].strip("[]() ") if self.units else "")

    def shown(self) -> list[str]:
        """Return the names to list in a message: arrays with several columns appear once, as "data[0..5]"."""
        inner = {n for group in self.groups.values() for n in group}
        arrays = (self._range(name, group) for name, group in self.groups.items())
        return [*arrays, *(name for n, name in enumerate(self.names or ()) if n not in inner)]

    def _range(self, name: str, group: tuple[int, ...]) -> str:
        """Return an array's name with the first and the last of its columns, where they are called by it."""
        first, last = ((self.names or ())[n].removeprefix(name) for n in (group[0], group[-1]))
        return f"{name}{first[:-1]}..{last[1:]}" if first.startswith("[") else name


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


def data_folder(data: Path | str | None) -> Path | None:
    """Return the folder of data that was given, if one was; raises BadFile where there is none."""
    if data is not None and not Path(data).is_dir():
        raise BadFile(f"--data (in Python data): {data}: no such folder. Correct it, or leave it out.")
    return None if data is None else Path(data)


def find_file(name: str, folder: Path, data: Path | None, asked: str = "") -> Path:
    """Return the file `name`, sought in `data`, $STEELYARD_DATA, `folder`; raises BadFile naming them.

    asked  the place of the description that asks for it; empty where a person does
    """
    by = f"{asked}: " if asked else ""
    if Path(name).is_absolute():
        if Path(name).exists():
            return Path(name)
        raise BadFile(f"{by}{name}: no such file.")
    folders = [*(Path(each) for each in (data, os.environ.get("STEELYARD_DATA")) if each), folder]
    for each in folders:
        if (each / name).exists():
            return each / name
    raise BadFile(
        f'{by}"{name}" was not found. Searched: {", ".join(str(each.absolute()) for each in folders)}. '
        "Correct the path, or give the folder of the data with --data DIR or STEELYARD_DATA."
    )


def spread_columns(widths: Iterable[tuple[str, int | None]]) -> tuple[tuple[str, ...], dict[str, tuple[int, ...]]]:
    """Return the names of all columns, and the groups of those that an array or a list holds: force -> force[0], ..

    widths  name and number of columns of each array, None of one that is a column itself
    """
    names: list[str] = []
    groups: dict[str, tuple[int, ...]] = {}
    for name, width in widths:
        if width is not None:
            groups[name] = tuple(range(len(names), len(names) + width))
        names += [name] if width is None else [f"{name}[{i}]" for i in range(width)]
    return tuple(names), groups


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
    there = [*header.groups, *header.names]
    raise BadDescription(
        f'{where}: there is no column "{column}".{close_match(column, there)} Columns here: {listed(header.shown())}.'
    )
