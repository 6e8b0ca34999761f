"""NPZ files as tables.

A key with shape (N,) is one column. A key with shape (N, k) or (N, a, b) is k or a*b columns: its name alone
means all of them, in order, and "name[0]" one of them.
"""

from __future__ import annotations

import io
import math
import zipfile
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tokenize import TokenError
from typing import Any, NamedTuple

import numpy as np
from numpy.lib import format as npy

from steelyard.errors import BadFile
from steelyard.io.contents import require_bounded
from steelyard.io.tables.files import WIDEST, Columns, Header, spread_columns

_MOST_COLUMNS = 65_536
_NUMBERS = "fiub"  # kinds of dtype
_PACKINGS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)  # those of numpy
# What reading an array of a damaged NPZ raises, and what Python's parser does at the text of its header.
_DAMAGED = (ValueError, TypeError, OSError, EOFError, RuntimeError, KeyError, zlib.error, zipfile.BadZipFile)
_NO_HEADER = (*_DAMAGED, TokenError, MemoryError)


class ArrayHeader(NamedTuple):
    """What an array says of itself before it is read: its shape, and its size [bytes]."""

    shape: tuple[int, ...]
    size: int


@dataclass(frozen=True)
class ArrayTable:
    """An NPZ file; nothing in it is ever unpickled."""

    path: Path
    header: Header
    sources: tuple[tuple[str, int], ...]  # per column: array key and the column inside it

    @classmethod
    def open(cls, path: Path) -> ArrayTable:
        """Read the array headers only; raises BadFile."""
        shapes = {key: array.shape for key, array in array_headers(path).items()}
        widths = {key: math.prod(shape[1:]) if len(shape) > 1 else None for key, shape in shapes.items() if shape}
        widths = {key: width for key, width in widths.items() if width is None or width <= WIDEST}
        if sum(1 if width is None else width for width in widths.values()) > _MOST_COLUMNS:
            raise BadFile(f"{path}: holds more than {_MOST_COLUMNS} columns. Save the quantities of the log alone.")
        names, groups = spread_columns(widths.items())
        sources = tuple((key, i) for key, width in widths.items() for i in range(1 if width is None else width))
        if not names:
            raise BadFile(f"{path}: no array with rows is in this NPZ. Save one array per quantity, rows first.")
        return cls(path, Header(names, len(names), groups, shapes=shapes), sources)

    def read(self, columns: Sequence[int], exact: Sequence[int] = ()) -> Columns:
        """Return columns by number, dates in `exact` as datetime64[ns]; raises BadFile where an array is damaged or not
        of numbers."""
        out: Columns = {}
        arrays = read_arrays(self.path, list(dict.fromkeys(self.sources[number][0] for number in columns)))
        stamps = {self.sources[number][0] for number in exact}
        for key, array in arrays.items():
            _require_numbers(self.path, key, array, f"{_NUMBERS}M" if key in stamps else _NUMBERS)
        for number in columns:
            key, inner = self.sources[number]
            column = arrays[key].reshape(len(arrays[key]), math.prod(arrays[key].shape[1:]))[:, inner]
            kind = column.dtype.kind if number in exact else "f"
            out[number] = column.astype({"i": np.int64, "u": np.int64, "M": "M8[ns]"}.get(kind, np.float64))
        return out


def read_numbers(path: Path, names: Sequence[str]) -> dict[str, Any]:
    """Return named arrays of an NPZ file; raises BadFile where one is missing, damaged or not of real numbers."""
    found = read_arrays(path, names)
    for name, array in found.items():
        _require_numbers(path, name, array)
    return found


def _require_numbers(path: Path, name: str, array: Any, kinds: str = _NUMBERS) -> None:
    if array.dtype.kind not in kinds:
        raise BadFile(f'{path}: array "{name}" must hold real numbers; it holds {array.dtype}.')


def read_arrays(path: Path, names: Sequence[str] = (), of: str = "It needs", most: int | None = None) -> dict[str, Any]:
    """Return arrays of an NPZ file by name, all where none is named; raises BadFile where one is missing or damaged.

    of    begins what is said of the names where one of them is missing
    most  [bytes] that the arrays may have together; raises BadFile where they have more, before one is unpacked
    """
    ArrayTable.open(path)  # refuses what is no NPZ, and pickles by their header
    held = array_headers(path)  # other members of the zip are passed over
    if missing := [name for name in names if name not in held]:
        raise BadFile(f'{path}: array "{missing[0]}" is missing. {of} {", ".join(names)}.')
    wanted = names or list(held)
    require_bounded(path, sum(held[name].size for name in wanted), most)
    with np.load(path, allow_pickle=False) as archive:
        return {name: _array(path, name, archive) for name in wanted}


def npz(arrays: Mapping[str, Any]) -> bytes:
    """Return the content of an NPZ file of these arrays, packed."""
    content = io.BytesIO()
    np.savez_compressed(content, allow_pickle=False, **arrays)
    return content.getvalue()


def _array(path: Path, name: str, archive: Any) -> np.ndarray[Any, np.dtype[Any]]:
    try:
        array: np.ndarray[Any, np.dtype[Any]] = archive[f"{name}.npy"]
    except _DAMAGED as error:
        raise BadFile(f'{path}: array "{name}" is damaged ({error}). Save the file again.') from None
    return array


def array_headers(path: Path) -> dict[str, ArrayHeader]:
    """Return what every array of an NPZ file says of itself, pickles refused by it; raises BadFile."""
    try:
        with zipfile.ZipFile(path) as archive:
            members = [name for name in archive.namelist() if name.endswith(".npy")]
            return {name.removesuffix(".npy"): _header(path, archive, name) for name in members}
    except OSError as error:
        raise BadFile(f"{path}: cannot be read ({error.strerror}).") from None
    except (zipfile.BadZipFile, RuntimeError):  # the latter of a zip of another make or version
        raise BadFile(
            f"{path}: expected an NPZ file (a zip of arrays); found something else. Save it with numpy.savez."
        ) from None


def _header(path: Path, archive: zipfile.ZipFile, name: str) -> ArrayHeader:
    key, member = name.removesuffix(".npy"), archive.getinfo(name)
    if member.compress_type not in _PACKINGS:
        raise BadFile(f'{path}: array "{key}" is packed as numpy packs none. Save the file with numpy.savez.')
    try:
        with archive.open(name) as content:
            version = npy.read_magic(content)
            read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
            shape, _, dtype = read(content)
    except _NO_HEADER:
        raise BadFile(f'{path}: "{key}" in this NPZ is not an array. Save the file with numpy.savez.') from None
    if dtype.hasobject:
        raise BadFile(
            f'{path}: array "{key}" holds pickled Python objects, which can run code when opened; '
            "it was not opened. Save it as plain numbers (float64)."
        )
    size = max(dtype.itemsize, 1) * math.prod(shape)  # texts of no length count too: each becomes a value
    if size > member.file_size:
        raise BadFile(f'{path}: array "{key}" is damaged (shorter than its header says). Save the file again.')
    return ArrayHeader(tuple(shape), size)
