"""NPZ files as tables.

A key with shape (N,) is one column. A key with shape (N, k) or (N, a, b) is k or a*b columns: its name alone
means all of them, in order, and "name[0]" one of them.
"""

from __future__ import annotations

import math
import zipfile
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy

from steelyard.errors import BadFile
from steelyard.io.table_header import Columns, Header

_WIDEST = 4096
# What reading an array of a damaged NPZ raises.
_DAMAGED = (ValueError, OSError, EOFError, RuntimeError, KeyError, zlib.error, zipfile.BadZipFile)


@dataclass(frozen=True)
class ArrayTable:
    """An NPZ file; nothing in it is ever unpickled."""

    path: Path
    header: Header
    sources: tuple[tuple[str, int], ...]  # per column: array key and the column inside it

    @classmethod
    def open(cls, path: Path) -> ArrayTable:
        """Read the array headers only; raises BadFile."""
        names: list[str] = []
        sources: list[tuple[str, int]] = []
        groups: dict[str, tuple[int, ...]] = {}
        for key, shape in array_shapes(path).items():
            if len(shape) == 1:
                names.append(key)
                sources.append((key, 0))
            elif len(shape) > 1 and (width := int(np.prod(shape[1:]))) <= _WIDEST:
                groups[key] = tuple(range(len(names), len(names) + width))
                names += [f"{key}[{i}]" for i in range(width)]
                sources += [(key, i) for i in range(width)]
        if not names:
            raise BadFile(f"{path}: no array with rows is in this NPZ. Save one array per quantity, rows first.")
        return cls(path, Header(tuple(names), len(names), groups), tuple(sources))

    def read(self, columns: Sequence[int], exact: Sequence[int] = ()) -> Columns:
        """Return columns by number; raises BadFile where an array is not of numbers."""
        out: Columns = {}
        arrays: dict[str, np.ndarray[Any, np.dtype[Any]]] = {}
        with np.load(self.path, allow_pickle=False) as archive:
            for number in columns:
                key, inner = self.sources[number]
                if key not in arrays:
                    arrays[key] = numeric_array(self.path, key, archive)
                column = arrays[key].reshape(len(arrays[key]), math.prod(arrays[key].shape[1:]))[:, inner]
                keep = number in exact and column.dtype.kind in "iu"
                out[number] = column.astype(np.int64 if keep else np.float64)
        return out


def read_arrays(path: Path, names: Sequence[str] = (), of: str = "It needs") -> dict[str, Any]:
    """Return arrays of an NPZ file by name, all where none is named; raises BadFile where one is missing or damaged.

    of  begins what is said of the names where one of them is missing
    """
    ArrayTable.open(path)  # refuses what is no NPZ, and pickles by their header
    held = array_shapes(path)  # other members of the zip are passed over
    if missing := [name for name in names if name not in held]:
        raise BadFile(f'{path}: array "{missing[0]}" is missing. {of} {", ".join(names)}.')
    try:
        with np.load(path, allow_pickle=False) as archive:
            return {name: archive[f"{name}.npy"] for name in names or held}
    except _DAMAGED as error:
        raise BadFile(f"{path}: an array is damaged ({error}). Save the file again.") from None


def numeric_array(path: Path, key: str, archive: Any) -> np.ndarray[Any, np.dtype[Any]]:
    """Return an array of an open NPZ file; raises BadFile where it is damaged or not of real numbers."""
    try:
        array: np.ndarray[Any, np.dtype[Any]] = archive[f"{key}.npy"]
    except _DAMAGED as error:
        raise BadFile(f'{path}: array "{key}" is damaged ({error}). Save the file again.') from None
    require_numbers(path, key, array)
    return array


def require_numbers(path: Path, key: str, array: Any) -> None:
    """Raise BadFile where an array of an NPZ holds anything but real numbers."""
    if array.dtype.kind not in "fiub":
        raise BadFile(f'{path}: array "{key}" must hold real numbers; it holds {array.dtype}.')


def array_shapes(path: Path) -> dict[str, tuple[int, ...]]:
    """Return the shape of every array of an NPZ file, pickles refused by their header; raises BadFile."""
    try:
        with zipfile.ZipFile(path) as archive:
            members = [name for name in archive.namelist() if name.endswith(".npy")]
            return {name.removesuffix(".npy"): _shape(path, archive, name) for name in members}
    except OSError as error:
        raise BadFile(f"{path}: cannot be read ({error.strerror}).") from None
    except (zipfile.BadZipFile, RuntimeError):  # the latter of a zip of another make or version
        raise BadFile(
            f"{path}: expected an NPZ file (a zip of arrays); found something else. Save it with numpy.savez."
        ) from None


def _shape(path: Path, archive: zipfile.ZipFile, name: str) -> tuple[int, ...]:
    key = name.removesuffix(".npy")
    try:
        with archive.open(name) as member:
            version = npy.read_magic(member)
            read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
            shape, _, dtype = read(member)
    except _DAMAGED:
        raise BadFile(f'{path}: "{key}" in this NPZ is not an array. Save the file with numpy.savez.') from None
    size = archive.getinfo(name).file_size
    if dtype.hasobject:
        raise BadFile(
            f'{path}: array "{key}" holds pickled Python objects, which can run code when opened; '
            "it was not opened. Save it as plain numbers (float64)."
        )
    if dtype.itemsize * math.prod(shape) > size:
        raise BadFile(f'{path}: array "{key}" is damaged (shorter than its header says). Save the file again.')
    return tuple(shape)
