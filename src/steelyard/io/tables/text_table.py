"""CSV, TSV and other text tables (also gzipped), read in blocks by numpy's C reader.

The head decides: it must be text with line ends, its delimiter is found, and its header is the first line, the last
comment line above the numbers, or the first line of words as wide as the rows, where others stand above (a preamble).
A file that is not text is refused there, however large it is.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from operator import methodcaller
from pathlib import Path

import numpy as np

from steelyard.errors import BadFile, BadValue
from steelyard.io.contents import require_bounded
from steelyard.io.tables.files import Columns, Header
from steelyard.io.tables.text_blocks import blocks, decoded, head_lines
from steelyard.io.tables.text_cells import (
    STAMP_TYPE,
    are_data,
    are_words,
    completed,
    filled,
    has_commas,
    holds_row,
    is_decimal_comma,
    is_number,
    is_other_date,
    is_stamp,
    may_have_commas,
    split,
    spread,
    spread_names,
    stamps_of,
    with_commas,
    with_points,
)

_WITH_COMMAS = "If its decimals have commas (0,5), save it with points, or with semicolons between cells. "
_INTEGER = re.compile(r"[+-]?\d+")


@dataclass(frozen=True)
class _Reading:
    """Which columns are read: `integers` and `stamps` of them as such, `commas` where decimals have one."""

    order: list[int]
    integers: set[int]
    stamps: set[int]
    commas: bool


@dataclass(frozen=True)
class TextTable:
    """A text table: `delimiter` (None = whitespace), and `skip` lines above the first row of numbers.

    `lists` says that cells hold lists of numbers; `header` and `first` have their items apart.
    """

    path: Path
    header: Header
    delimiter: str | None
    skip: int
    first: tuple[str, ...]
    lists: bool = False

    @classmethod
    def open(cls, path: Path) -> TextTable:
        """Look at the first 64 kB; raises BadFile when that is not a text table."""
        lines = head_lines(path)
        rows = [i for i, line in enumerate(lines) if holds_row(line)]
        if not rows:
            raise BadFile(f"{path}: the file has no rows, only blank lines or comments.")
        rows = _below_preamble(lines, rows)
        delimiter = _delimiter(lines[rows[0]])
        cells = split(lines[rows[0]], delimiter)
        below = split(lines[rows[1]], delimiter) if len(rows) > 1 else ()
        if (are_data(cells, delimiter) or _alike(cells, below)) and not _counted(cells):
            names = _comment_header(lines[: rows[0]], delimiter, len(cells))
            return cls(path, Header(names, len(cells), words=_words(cells, delimiter)), delimiter, rows[0], cells)
        if len(rows) < 2:
            raise BadFile(f"{path}: the file has a header but no rows. Record again, or correct the path.")
        skip, first, units = rows[0] + 1, split(lines[rows[1]], delimiter), tuple[str, ...]()
        if len(rows) > 2 and are_words(first, delimiter) and are_data(split(lines[rows[2]], delimiter), delimiter):
            skip, first, units = rows[1] + 1, split(lines[rows[2]], delimiter), first
        if len(first) != len(cells) and not (len(first) == len(cells) + 1 and not first[-1]):
            raise BadFile(
                f"{path}: the header has {len(cells)} names, but its rows have {len(first)} cells. "
                f"{_WITH_COMMAS if delimiter == ',' and 1.5 * len(cells) < len(first) <= 2 * len(cells) else ''}"
                "Write one name per column, or a description with column numbers and no header."
            )
        names, groups = spread_names(cells, first) if len(first) == len(cells) else (cells, {})
        if groups:
            first = split(spread(lines[skip], delimiter), delimiter)
        dates = tuple(n for n, cell in enumerate(first) if is_stamp(cell))
        units = _of_columns(units, len(names), delimiter)
        header = Header(names, len(names), groups, dates, _words(first, delimiter), units)
        return cls(path, header, delimiter, skip, first, bool(groups))

    def read(self, columns: Sequence[int], exact: Sequence[int] = ()) -> Columns:
        """Return columns by number; raises BadFile at a cell that is not a number, with its line and text."""
        how = self._how(sorted(set(columns)), exact)
        parts: list[Columns] = []
        line, size = self.skip + 1, 0
        for block in blocks(self.path, self.skip):
            block = spread(block, self.delimiter) if self.lists else block
            whole = block if block.endswith("\n") else completed(block, self.delimiter, self.first)
            part = self._parse(with_points(whole) if how.commas else whole, how, line)
            if part:
                parts.append(part)
                size += sum(column.nbytes for column in part.values())
                require_bounded(self.path, size)
            line += block.count("\n")
        if not parts:
            raise BadFile(f"{self.path}: the file has no rows.")
        return {n: np.concatenate([part[n] for part in parts]) for n in how.order}

    def _how(self, order: list[int], exact: Sequence[int]) -> _Reading:
        known = [n for n in exact if n in order and n < len(self.first)]
        integers = {n for n in known if _INTEGER.fullmatch(self.first[n])}
        stamps = {n for n in known if is_stamp(self.first[n])}
        plain = [n for n in order if n not in stamps]
        head = head_lines(self.path)[self.skip :] if may_have_commas(self.delimiter) else ()
        return _Reading(order, integers, stamps, has_commas(filter(holds_row, head), self.delimiter, plain))

    def _parse(self, block: str, how: _Reading, line: int) -> Columns:
        """Return the columns of one block of lines, the first of which is `line`."""
        lines = block.removesuffix("\n").split("\n")
        if not any(holds_row(text) for text in lines):
            return {}
        self._check_width(lines, line)
        comments, quote = ("#" if "#" in block else None), ('"' if '"' in block else None)
        kinds = dict.fromkeys(how.order, np.float64) | dict.fromkeys(how.integers, np.int64)
        kind = np.dtype([(str(n), k) for n, k in (kinds | dict.fromkeys(how.stamps, STAMP_TYPE)).items()])
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error", DeprecationWarning)  # an integer that is written as 1.5
                rows = np.loadtxt(lines, kind, comments, self.delimiter, usecols=how.order, ndmin=1, quotechar=quote)
            return {n: stamps_of(rows[str(n)]) if n in how.stamps else np.ascontiguousarray(rows[str(n)])
                    for n in how.order}  # fmt: skip
        except (ValueError, OverflowError, DeprecationWarning, BadValue) as error:
            without_holes = filled(block, self.delimiter)
            if without_holes != block:
                return self._parse(without_holes, how, line)
            if how.integers:
                return self._parse(block, replace(how, integers=set()), line)
            raise self._explain(lines, how, line, str(error)) from None

    def _check_width(self, lines: list[str], line: int) -> None:
        """Raise BadFile at a row with more or fewer cells than the first: its names may be wrong."""
        width = len(self.first)
        if self.delimiter is None or set(map(methodcaller("count", self.delimiter), lines)) <= {width - 1}:
            return
        for offset, text in enumerate(lines):
            if text.count(self.delimiter) + 1 != width and holds_row(text):
                cells = split(text.split("#")[0], self.delimiter)
                if len(cells) != width:
                    raise self._ragged(line + offset, len(cells))

    def _ragged(self, line: int, found: int) -> BadFile:
        return BadFile(
            f"{self.path}: line {line} has {found} cells, the rows before it have {len(self.first)}. "
            "Complete or delete that line."
        )

    def _explain(self, lines: list[str], how: _Reading, line: int, reason: str) -> BadFile:
        """Return the error that names the first cell that is not a number."""
        for offset, text in enumerate(lines):
            text = text.split("#")[0]
            if not text.strip():
                continue
            cells = split(text, self.delimiter)
            if max(how.order) >= len(cells):
                return self._ragged(line + offset, len(cells))
            for n in how.order:
                cell = with_commas(cells[n]) if how.commas else cells[n]
                if not (is_number(cells[n]) or (n in how.stamps and is_stamp(cell))):
                    return self._bad_cell(line + offset, n, cell, how.commas)
        return BadFile(f"{self.path}: cannot be read as a table of numbers ({reason}).")

    def _bad_cell(self, line: int, column: int, cell: str, commas: bool) -> BadFile:
        names = self.header.names
        name = f'"{names[column]}"' if names and column < len(names) else str(column)
        cell = decoded(cell.encode("latin-1", "replace"))
        shown = f'"{cell[:40]}", which is not a number' if cell else "nothing"
        hint = "Correct or delete that line."
        if commas and is_number(cell):
            shown, hint = f'"{cell[:40]}", but other decimals of the file have commas', "Write all of them alike."
        elif is_decimal_comma(cell):
            hint = "Write decimals with a point."
        elif is_other_date(cell):
            hint = "Write the time in seconds, or as 2024-05-01T12:00:00.123."
        return BadFile(f"{self.path}: line {line}, column {name} holds {shown}. {hint}")


def _below_preamble(lines: list[str], rows: list[int]) -> list[int]:
    """Return the rows (numbers of lines) from the header on, without lines of another shape that loggers write above.

    That is the first line of words with as many cells as the last whole line, where no row of numbers stands above.
    """
    last = lines[rows[-2 if len(rows) > 2 else -1]]  # the last one may be cut off
    delimiter = _delimiter(last)
    width = len(split(last, delimiter))
    for k, row in enumerate(rows):
        cells = split(lines[row], delimiter)
        if len(cells) == width:
            return rows[k:] if k and are_words(cells, delimiter) else rows
    return rows


def _of_columns(units: tuple[str, ...], count: int, delimiter: str | None) -> tuple[str, ...]:
    """Return a row of units with one for each of `count` columns, none where it does not say which is whose."""
    while len(units) > count and not units[-1]:
        units = units[:-1]
    if units and delimiter is not None:
        units += ("",) * (count - len(units))
    return units if len(units) == count else ()


def _words(cells: Sequence[str], delimiter: str | None) -> tuple[int, ...]:
    return tuple(n for n, cell in enumerate(cells) if are_words([cell], delimiter))


def _alike(cells: Sequence[str], below: Sequence[str]) -> bool:
    """Whether a line with words and mostly numbers is a row, not a header: the next has them in the same places."""
    numbers = [is_number(cell) for cell in cells]
    mostly = 2 * sum(numbers) > len(cells) and numbers == [is_number(cell) for cell in below]
    return mostly and not _counted([cell for cell in cells if is_number(cell)])


def _delimiter(line: str) -> str | None:
    plain = re.sub(r'"[^"]*"', "", line)
    return next((mark for mark in ("\t", ";", ",") if mark in plain), None)


def _comment_header(lines: list[str], delimiter: str | None, count: int) -> tuple[str, ...] | None:
    """Return the names in the last comment line with as many cells as the rows; None where there is none."""
    for line in reversed(lines):
        for mark in (delimiter, None):
            names = split(line.strip().lstrip("#").strip(), mark)
            if len(names) == count and not are_data(names, mark):
                return names
    return None


def _counted(cells: Sequence[str]) -> bool:
    """Whether the cells are 0, 1, 2, ..: the header that pandas writes for columns without names."""
    named = [cell for cell in cells if cell]
    return len(named) > 2 and named == [str(i) for i in range(len(named))]
