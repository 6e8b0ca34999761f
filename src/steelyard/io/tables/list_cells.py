"""Lists in the cells of a text table, as pandas writes columns of arrays: "[0.1, 0.2]" becomes cells of their own."""

from __future__ import annotations

import re
from collections.abc import Sequence

from steelyard.io.tables.text_cells import is_number

# Numbers between brackets, in quotes where the delimiter may stand among them; matrices are lists of lists.
_LIST = re.compile(r'"\s*(\[[^"]*\])\s*"|(\[[^"\[\];\t]*\])')
_BETWEEN = re.compile(r"[\[\],;\s]+")


def is_list(cell: str) -> bool:
    """Whether a cell without its quotes holds a list of numbers."""
    found = items(cell) if cell.startswith("[") and cell.endswith("]") else []
    return bool(found) and all(map(is_number, found))


def items(cell: str) -> list[str]:
    """Return what stands in a list, row by row where it is one of lists."""
    return [item for item in _BETWEEN.split(cell) if item]


def spread(text: str, delimiter: str | None) -> str:
    """Return lines with each item of their lists in a cell of its own."""
    mark = " " if delimiter is None else delimiter
    return _LIST.sub(lambda found: mark.join(items(found[1] or found[2])), text)


def spread_names(names: Sequence[str], cells: Sequence[str]) -> tuple[tuple[str, ...], dict[str, tuple[int, ...]]]:
    """Return the names of all columns and the groups of those that stood in one cell: force -> force[0], force[1] ..

    cells  the first row, with its lists
    """
    out: list[str] = []
    groups: dict[str, tuple[int, ...]] = {}
    for name, cell in zip(names, cells, strict=True):
        count = len(items(cell)) if is_list(cell) else 0
        if count:
            groups[name] = tuple(range(len(out), len(out) + count))
        out += [f"{name}[{i}]" for i in range(count)] if count else [name]
    return tuple(out), groups
