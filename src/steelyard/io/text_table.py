"""CSV, TSV and other text tables (also gzipped), read in blocks by numpy's C reader.

The head decides: it must be text with line ends, its delimiter is found, and its header is the first line or
the last comment line above the numbers. A file that is not text is refused there, however large it is.
"""

from __future__ import annotations

import csv
import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from operator import methodcaller
from pathlib import Path
from typing import Any

import numpy as np

from steelyard.errors import BadFile
from steelyard.io.table_header import Columns, Header
from steelyard.io.text_blocks import blocks, head_lines

_WORDS = re.compile(r'"[^"]*"|\S+')
_INTEGER = re.compile(r"[+-]?\d+")
_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+")

Numbers = np.ndarray[Any, np.dtype[Any]]


@dataclass(frozen=True)
class TextTable:
    """A text table: `delimiter` (None = whitespace), and `skip` lines above the first row of numbers."""

    path: Path
    header: Header
    delimiter: str | None
    skip: int
    first: tuple[str, ...]

    @classmethod
    def open(cls, path: Path) -> TextTable:
        """Look at the first 64 kB; raises BadFile when that is not a text table."""
        lines = head_lines(path)
        rows = [i for i, line in enumerate(lines) if _holds_row(line)]
        if not rows:
            raise BadFile(f"{path}: the file has no rows, only blank lines or comments.")
        delimiter = _delimiter(lines[rows[0]])
        cells = split(lines[rows[0]], delimiter)
        if _all_numbers(cells) and not _counted(cells):
            names = _comment_header(lines[: rows[0]], delimiter, len(cells))
            return cls(path, Header(names, len(cells), {}), delimiter, rows[0], cells)
        if len(rows) < 2:
            raise BadFile(f"{path}: the file has a header but no rows. Record again, or correct the path.")
        first = split(lines[rows[1]], delimiter)
        if len(first) != len(cells) and not (len(first) == len(cells) + 1 and not first[-1]):
            raise BadFile(
                f"{path}: the header has {len(cells)} names, but its rows have {len(first)} cells. "
                "Write one name per column, or a description with column numbers and no header."
            )
        return cls(path, Header(cells, len(cells), {}), delimiter, rows[0] + 1, first)

    def read(self, columns: Sequence[int], exact: Sequence[int] = ()) -> Columns:
        """Return columns by number; raises BadFile at a cell that is not a number, with its line and text."""
        order = sorted(set(columns))
        integers = {n for n in exact if n < len(self.first) and _INTEGER.fullmatch(self.first[n])}
        parts: list[Columns] = []
        line = self.skip + 1
        for block in blocks(self.path, self.skip):
            part = self._parse(block, order, integers, line)
            if part:
                parts.append(part)
            line += block.count("\n")
        if not parts:
            raise BadFile(f"{self.path}: the file has no rows.")
        return {n: np.concatenate([part[n] for part in parts]) for n in order}

    def _parse(self, block: str, order: list[int], integers: set[int], line: int) -> Columns:
        """Return the columns of one block of lines, the first of which is `line`."""
        lines = block.removesuffix("\n").split("\n")
        if not any(_holds_row(text) for text in lines):
            return {}
        self._check_width(lines, line)
        comments, quote = ("#" if "#" in block else None), ('"' if '"' in block else None)
        kind = np.dtype([(str(n), np.int64 if n in integers else np.float64) for n in order])
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error", DeprecationWarning)  # an integer that is written as 1.5
                rows = np.loadtxt(lines, kind, comments, self.delimiter, usecols=order, ndmin=1, quotechar=quote)
        except (ValueError, OverflowError, DeprecationWarning) as error:
            if integers:
                return self._parse(block, order, set(), line)
            raise self._explain(lines, order, line, str(error)) from None
        return {n: np.ascontiguousarray(rows[str(n)]) for n in order}

    def _check_width(self, lines: list[str], line: int) -> None:
        """Raise BadFile at a row with more or fewer cells than the first: its names may be wrong."""
        width = len(self.first)
        if self.delimiter is None or set(map(methodcaller("count", self.delimiter), lines)) <= {width - 1}:
            return
        for offset, text in enumerate(lines):
            if text.count(self.delimiter) + 1 != width and _holds_row(text):
                cells = split(text.split("#")[0], self.delimiter)
                if len(cells) != width:
                    raise self._ragged(line + offset, len(cells))

    def _ragged(self, line: int, found: int) -> BadFile:
        return BadFile(
            f"{self.path}: line {line} has {found} cells, the rows before it have {len(self.first)}. "
            "Complete or delete that line."
        )

    def _explain(self, lines: list[str], order: list[int], line: int, reason: str) -> BadFile:
        """Return the error that names the first cell that is not a number."""
        for offset, text in enumerate(lines):
            text = text.split("#")[0]
            if not text.strip():
                continue
            cells = split(text, self.delimiter)
            if max(order) >= len(cells):
                return self._ragged(line + offset, len(cells))
            for n in order:
                if not _is_number(cells[n]):
                    return self._bad_cell(line + offset, n, cells[n])
        return BadFile(f"{self.path}: cannot be read as a table of numbers ({reason}).")

    def _bad_cell(self, line: int, column: int, cell: str) -> BadFile:
        names = self.header.names
        name = f'"{names[column]}"' if names and column < len(names) else str(column)
        cell = cell.encode("latin-1", "replace").decode("utf-8", "replace")
        shown = f'"{cell[:40]}", which is not a number' if cell else "nothing"
        comma = _DECIMAL_COMMA.fullmatch(cell)
        hint = "Write decimals with a point." if comma else "Correct or delete that line."
        return BadFile(f"{self.path}: line {line}, column {name} holds {shown}. {hint}")


def split(line: str, delimiter: str | None) -> tuple[str, ...]:
    """Return the cells of a line without blanks and quotes around them."""
    if delimiter is None:
        return tuple(word.strip('"') for word in _WORDS.findall(line))
    return tuple(cell.strip() for cell in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True)))


def _holds_row(line: str) -> bool:
    line = line.lstrip()
    return bool(line) and line[0] != "#"


def _delimiter(line: str) -> str | None:
    plain = re.sub(r'"[^"]*"', "", line)
    return next((mark for mark in ("\t", ";", ",") if mark in plain), None)


def _comment_header(lines: list[str], delimiter: str | None, count: int) -> tuple[str, ...] | None:
    """Return the names in the last comment line with as many cells as the rows; None where there is none."""
    for line in reversed(lines):
        for mark in (delimiter, None):
            names = split(line.strip().lstrip("#").strip(), mark)
            if len(names) == count and not _all_numbers(names):
                return names
    return None


def _counted(cells: Sequence[str]) -> bool:
    """Whether the cells are 0, 1, 2, ..: the header that pandas writes for columns without names."""
    named = [cell for cell in cells if cell]
    return (len(named) > 2 or not cells[0]) and named == [str(i) for i in range(len(named))]


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return "_" not in cell


def _all_numbers(cells: Sequence[str]) -> bool:
    return all(_is_number(cell) for cell in cells if cell) and any(cells)
