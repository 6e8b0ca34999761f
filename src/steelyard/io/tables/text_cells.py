"""What a cell of a text table may be, and blocks of such cells made plain for numpy's reader.

A cell is a number, nothing or a word for it (NA, null), a stamp as ISO 8601 or a time of day, or, between semicolons or
tabs, a number with a decimal comma. It may hold a list of numbers, as pandas writes columns of arrays: "[0.1, 0.2]"
becomes cells of their own.
"""

from __future__ import annotations

import csv
import re
import warnings
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from steelyard.errors import BadValue
from steelyard.io.tables.files import spread_columns

STAMP_TYPE = "U48"  # longer than any stamp of the form below
_WORDS = re.compile(r'"[^"]*"|\S+')
_EXPONENT = r"(?:[eE][+-]?\d+)?"
_DECIMAL_COMMA = re.compile(rf"[+-]?\d*,\d+{_EXPONENT}")
_DECIMAL_POINT = re.compile(rf"[+-]?(?:\d+\.\d*|\.\d+){_EXPONENT}")
_TIME_OF_DAY = r"\d\d:\d\d:\d\d(?:[.,]\d{1,9})?"
_STAMP_FORM = rf"\d{{4}}-\d\d-\d\d[T ]{_TIME_OF_DAY}(?:Z|[+-]\d\d:?\d\d)?"
_STAMP = re.compile(f"{_STAMP_FORM}|{_TIME_OF_DAY}")
_STAMPS = re.compile(rf"(?:(?:{_STAMP_FORM}|nan)\n)*")
_TIMES = re.compile(rf"(?:(?:{_TIME_OF_DAY}|nan)\n)*")
_NO_DAY = re.compile(r"^(?=\d)", re.MULTILINE)
_DATE = re.compile(r"\d{1,4}[./-]\d{1,2}[./-]\d{1,4}\b.*|\d{1,2}:\d\d\b.*")
# What a decimal point becomes where commas are the decimals: 1.234,5 or 1.234 may mean thousands, so is no number.
_NO_POINT = "\x01"  # binary, so in no text

# What R, pandas, SQL, spreadsheets and the C library of Windows write where a number is missing.
_MISSING = re.compile(r'(?<![^\s,;"])(?:NA|<NA>|N/A|n/a|#N/A|NULL|null|None|-?nan\(ind\))(?![^\s,;"])')
_BLANK = re.compile("^ ++$", re.MULTILINE)

# Numbers between brackets, in quotes where the delimiter may stand among them; matrices are lists of lists.
_LIST = re.compile(r'"\s*(\[[^"]*\])\s*"|(\[[^"\[\];\t]*\])')
_BETWEEN_ITEMS = re.compile(r"[\[\],;\s]+")


def split(line: str, delimiter: str | None) -> tuple[str, ...]:
    """Return the cells of a line without blanks and quotes around them."""
    if delimiter is None:
        return tuple(word.strip('"') for word in _WORDS.findall(line))
    if len(line) > csv.field_size_limit():  # the reader of csv refuses longer cells, which are no data
        return tuple(cell.strip().strip('"') for cell in line.split(delimiter))
    return tuple(cell.strip() for cell in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True)))


def holds_row(line: str) -> bool:
    """Whether a line is neither blank nor a comment."""
    line = line.lstrip()
    return bool(line) and line[0] != "#"


def is_number(cell: str) -> bool:
    """Whether numpy reads the cell as a number."""
    try:
        float(cell)
    except ValueError:
        return False
    return "_" not in cell


def is_stamp(cell: str) -> bool:
    """Whether the cell is a date with a time of day as ISO 8601, or a time of day alone."""
    return _STAMP.fullmatch(cell) is not None


def is_decimal_comma(cell: str) -> bool:
    """Whether the cell is a number with a decimal comma."""
    return _DECIMAL_COMMA.fullmatch(cell) is not None


def is_other_date(cell: str) -> bool:
    """Whether the cell looks like a date or a time of day that is not read."""
    return _DATE.fullmatch(cell) is not None


def are_data(cells: Sequence[str], delimiter: str | None) -> bool:
    """Whether a line of cells is a row: each that is not empty a number or a stamp."""
    return any(cells) and all(_is_datum(cell, delimiter) for cell in cells if cell)


def are_words(cells: Sequence[str], delimiter: str | None) -> bool:
    """Whether no cell of a line is a number or a stamp."""
    return any(cells) and not any(_is_datum(cell, delimiter) for cell in cells if cell)


def _is_datum(cell: str, delimiter: str | None) -> bool:
    return is_number(cell) or is_stamp(cell) or (may_have_commas(delimiter) and is_decimal_comma(cell))


def may_have_commas(delimiter: str | None) -> bool:
    """Whether a comma in a number can only be the decimal one, because something else stands between the cells."""
    return delimiter in (";", "\t")


def has_commas(lines: Iterable[str], delimiter: str | None, columns: Sequence[int]) -> bool:
    """Whether the cells of `columns` have decimal commas, and none has a decimal point."""
    if not may_have_commas(delimiter):
        return False
    rows = [split(line, delimiter) for line in lines if "," in line or "." in line]
    cells = [row[n] for row in rows for n in columns if n < len(row)]
    return any(map(is_decimal_comma, cells)) and not any(map(_DECIMAL_POINT.fullmatch, cells))


def with_points(block: str) -> str:
    """Return a block with decimal commas as decimal points; what was a point is then no number."""
    return block.replace(".", _NO_POINT).replace(",", ".")


def with_commas(cell: str) -> str:
    """Return a cell of such a block as it was."""
    return cell.replace(".", ",").replace(_NO_POINT, ".")


def filled(block: str, delimiter: str | None) -> str:
    """Return a block with nan in cells that are empty or hold a word for it, and nothing in lines of blanks."""
    block = _BLANK.sub("", _MISSING.sub("nan", block))
    if delimiter is None:
        return block
    mark = re.escape(delimiter)
    cell = r' *+(?:"" *+)?+'  # never tried again shorter: a million blanks would take their square of steps
    empty = rf"^{cell}(?={mark})|(?<={mark}){cell}(?={mark}|$)"
    return re.sub(empty, "nan", block, flags=re.MULTILINE)


def completed(block: str, delimiter: str | None, first: Sequence[str]) -> str:
    """Return the end of a file with nan where its last line was cut off, as by a logger that was killed.

    Such a line has no line end, and fewer cells than the `first` row or half a number in the last. Of its cells those
    before the last are whole.
    """
    start = block.rfind("\n") + 1
    line = block[start:]
    if not holds_row(line) or "#" in line:
        return block
    cells = line.split() if delimiter is None else line.split(delimiter)
    last = cells[-1].strip().strip('"')
    half = last and not _is_datum(last, delimiter)  # of a column of words, which nobody reads, no matter
    if len(cells) > len(first) or (len(cells) == len(first) and not half):
        return block
    mark = " " if delimiter is None else delimiter
    return block[:start] + mark.join([*cells[:-1], *["nan"] * (len(first) - len(cells) + 1)])


def stamps_of(cells: np.ndarray[Any, np.dtype[Any]]) -> np.ndarray[Any, np.dtype[Any]]:
    """Return stamps (N,) as datetime64[ns] in UTC, NaT where missing; raises BadValue where one is of another form.

    Without a zone they are taken as they stand: only their differences count.
    """
    text = "\n".join([*cells.tolist(), ""]).replace(_NO_POINT, ".").replace(",", ".")
    if _TIMES.fullmatch(text):  # all of one day: only their differences count
        text = _NO_DAY.sub("1970-01-01T", text)
    elif not _STAMPS.fullmatch(text):
        raise BadValue("a stamp is of another form")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # numpy turns zones into UTC, and says that it keeps none
        return np.array(text.replace("nan", "NaT").split("\n")[:-1]).astype("M8[ns]")


def is_list(cell: str) -> bool:
    """Whether a cell without its quotes holds a list of numbers."""
    found = items(cell) if cell.startswith("[") and cell.endswith("]") else []
    return bool(found) and all(map(is_number, found))


def items(cell: str) -> list[str]:
    """Return what stands in a list, row by row where it is one of lists."""
    return [item for item in _BETWEEN_ITEMS.split(cell) if item]


def spread(text: str, delimiter: str | None) -> str:
    """Return lines with each item of their lists in a cell of its own."""
    mark = " " if delimiter is None else delimiter
    return _LIST.sub(lambda found: mark.join(items(found[1] or found[2])), text)


def spread_names(names: Sequence[str], cells: Sequence[str]) -> tuple[tuple[str, ...], dict[str, tuple[int, ...]]]:
    """Return the names of all columns and the groups of those that stood in one cell: force -> force[0], force[1] ..

    cells  the first row, with its lists
    """
    widths = (len(items(cell)) if is_list(cell) else None for cell in cells)
    return spread_columns(zip(names, widths, strict=True))
