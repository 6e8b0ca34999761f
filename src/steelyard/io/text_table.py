"""CSV, TSV and other text tables (also gzipped), read in blocks by numpy's C reader.

The head decides: it must be text with line ends, its delimiter is found, and its header is the first line or the last
comment line above the numbers. A file that is not text is refused there, however large it is.
"""

from __future__ import annotations

import csv
import gzip
import re
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np

from steelyard.errors import BadFile
from steelyard.io.tables import Columns, Header

_HEAD = 1 << 16
_BLOCK = 1 << 23
_LONGEST_LINE = 1 << 20
_BOM = b"\xef\xbb\xbf"
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
        lines = _head_lines(path)
        rows = [i for i, line in enumerate(lines) if line.strip() and not line.lstrip().startswith("#")]
        if not rows:
            raise BadFile(f"{path}: the file has no rows, only blank lines or comments.")
        delimiter = _delimiter(lines[rows[0]])
        cells = split(lines[rows[0]], delimiter)
        if _all_numbers(cells):
            names = _comment_header(lines[: rows[0]], delimiter, len(cells))
            return cls(path, Header(names, len(cells), {}), delimiter, rows[0], cells)
        if len(rows) < 2:
            raise BadFile(f"{path}: the file has a header but no rows. Record again, or correct the path.")
        first = split(lines[rows[1]], delimiter)
        return cls(path, Header(cells, len(cells), {}), delimiter, rows[0] + 1, first)

    def read(self, columns: Sequence[int], exact: Sequence[int] = ()) -> Columns:
        """Return columns by number; raises BadFile at a cell that is not a number, with its line and text."""
        order = sorted(set(columns))
        integers = {n for n in exact if n < len(self.first) and _INTEGER.fullmatch(self.first[n])}
        parts: list[Columns] = []
        line = self.skip + 1
        for block in _blocks(self.path, self.skip):
            lines = block.replace("\r\n", "\n").replace("\r", "\n").split("\n")
            part = self._parse(lines, order, integers, line)
            if part:
                parts.append(part)
            line += len(lines) - 1
        if not parts:
            raise BadFile(f"{self.path}: the file has no rows.")
        return {n: np.concatenate([part[n] for part in parts]) for n in order}

    def _parse(self, lines: list[str], order: list[int], integers: set[int], line: int) -> Columns:
        """Return one block; a number that does not fit int64 turns its column into float64."""
        if not any(map(str.strip, lines[:4])) and not any(map(str.strip, lines)):
            return {}
        comments = "#" if any("#" in text for text in lines) else None
        quote = '"' if any('"' in text for text in lines) else None
        kind = np.dtype([(str(n), np.int64 if n in integers else np.float64) for n in order])
        try:
            block = np.loadtxt(lines, kind, comments, self.delimiter, usecols=order, quotechar=quote, ndmin=1)
        except (ValueError, OverflowError) as error:
            if integers:
                return self._parse(lines, order, set(), line)
            raise self._explain(lines, order, line, str(error)) from None
        self._check_width(lines, line)
        return {n: np.ascontiguousarray(block[str(n)]) for n in order}

    def _check_width(self, lines: list[str], line: int) -> None:
        """Raise BadFile at a row with more or fewer cells than the header: its numbers may be under wrong names."""
        if self.delimiter is None:
            return
        width = len(self.first)
        for offset, text in enumerate(lines):
            if text.count(self.delimiter) + 1 != width and text.strip() and not text.lstrip().startswith("#"):
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
        shown = f'"{cell[:40]}", which is not a number' if cell else "nothing"
        hint = (
            "Write decimals with a point."
            if _DECIMAL_COMMA.fullmatch(cell)
            else "Correct or delete that line."
        )
        return BadFile(f"{self.path}: line {line}, column {name} holds {shown}. {hint}")


def split(line: str, delimiter: str | None) -> tuple[str, ...]:
    """Return the cells of a line without blanks and quotes around them."""
    if delimiter is None:
        return tuple(word.strip('"') for word in _WORDS.findall(line))
    return tuple(
        cell.strip() for cell in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))
    )


def _delimiter(line: str) -> str | None:
    plain = re.sub(r'"[^"]*"', "", line)
    return next((mark for mark in ("\t", ";", ",") if mark in plain), None)


def _comment_header(lines: list[str], delimiter: str | None, count: int) -> tuple[str, ...] | None:
    """Return the names in the last comment line that has as many cells as the rows; None where there is none."""
    for line in reversed(lines):
        names = split(line.strip().lstrip("#").strip(), delimiter)
        if len(names) == count and not _all_numbers(names):
            return names
    return None


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return "_" not in cell


def _all_numbers(cells: Sequence[str]) -> bool:
    return all(_is_number(cell) for cell in cells if cell) and any(cells)


def _open(path: Path) -> IO[bytes]:
    return gzip.open(path, "rb") if path.suffix.lower() == ".gz" else path.open("rb")


def _read(path: Path, stream: IO[bytes], size: int) -> bytes:
    try:
        return stream.read(size)
    except (OSError, EOFError, zlib.error) as error:
        raise BadFile(f"{path}: cannot be read ({error}).") from None


def _head_lines(path: Path) -> list[str]:
    """Return the complete lines of the first 64 kB; raises BadFile when they are not text."""
    with _open(path) as stream:
        head = _read(path, stream, _HEAD)
    _require_text(path, head)
    text = head.removeprefix(_BOM).decode("utf-8", "replace").replace("\r\n", "\n").replace("\r", "\n")
    if len(head) == _HEAD:
        text = text[: text.rfind("\n") + 1]
        if not text:
            raise BadFile(
                f"{path}: expected a table with one row per line; found no line end in the first 64 kB."
            )
    return text.split("\n")


def _require_text(path: Path, block: bytes) -> None:
    if block.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise BadFile(f"{path}: the text is in UTF-16. Save it in UTF-8.")
    if b"\0" in block:
        raise BadFile(
            f"{path}: expected a text table; found binary data. Readable are text tables, .npz and .parquet."
        )


def _blocks(path: Path, skip: int) -> Iterator[str]:
    """Yield the text below the header, about 8 MB at a time, cut at line ends."""
    with _open(path) as stream:
        rest = _read(path, stream, _BLOCK)
        rest = _below(rest.removeprefix(_BOM), skip)
        while True:
            more = _read(path, stream, _BLOCK)
            block = rest + more
            _require_text(path, block)
            cut = block.rfind(b"\n") + 1 if more else len(block)
            if more and len(block) - cut > _LONGEST_LINE:
                raise BadFile(f"{path}: a line longer than {_LONGEST_LINE >> 20} MB is not a row of a table.")
            if cut:
                yield block[:cut].decode("latin-1")
            rest = block[cut:]
            if not more:
                return


def _below(block: bytes, skip: int) -> bytes:
    for _ in range(skip):
        newline, carriage = block.find(b"\n"), block.find(b"\r")
        at = newline if newline >= 0 else carriage
        block = block[at + 1 :] if at >= 0 else b""
    return block
