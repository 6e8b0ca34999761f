"""PCD files, the clouds of the Point Cloud Library: ascii, binary and binary_compressed."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numba
import numpy as np

from steelyard.errors import BadFile
from steelyard.io.contents import numbers, read_whole, require_bounded, typed

_TYPES = {
    ("F", "4"): "<f4", ("F", "8"): "<f8", ("U", "1"): "u1", ("U", "2"): "<u2", ("U", "4"): "<u4", ("U", "8"): "<u8",
    ("I", "1"): "i1", ("I", "2"): "<i2", ("I", "4"): "<i4", ("I", "8"): "<i8",
}  # fmt: skip
_WIDEST = 65_536  # numbers in one field of a point
_MOST_FIELDS = 1000
_DENSEST = 88  # LZF writes at most 264 bytes for three


def read_pcd(path: Path) -> dict[str, Any]:
    """Return field -> values (N,), padding left out; raises BadFile."""
    content = read_whole(path)
    mark = content.find(b"\nDATA ")
    end = content.find(b"\n", mark + 1)
    if mark < 0 or end < 0:
        raise BadFile(f"{path}: expected a PCD file, whose header ends in a DATA line; found something else.")
    lines = [line.split() for line in content[:end].decode("latin-1").splitlines() if line and line[0] != "#"]
    header = {words[0].upper(): words[1:] for words in lines if words}
    dtype, count = _layout(path, header)
    body = content[end + 1 :]
    kind = (header["DATA"] or [""])[0].lower()
    match kind:
        case "ascii":
            table = _ascii(path, body, dtype, count)
        case "binary":
            table = _whole(path, body, dtype, count)
        case "binary_compressed":
            table = _compressed(path, body, dtype, count)
        case _:
            raise BadFile(f'{path}: DATA must be ascii, binary or binary_compressed; got "{kind}".')
    return {name: table[name] for name in dtype.names or () if not name.startswith("_") and table[name].ndim == 1}


def _layout(path: Path, header: dict[str, list[str]]) -> tuple[np.dtype[Any], int]:
    """Return the record of one point and the number of points.

    Read as the Point Cloud Library does: COLUMNS is what FIELDS was called once, and WIDTH x HEIGHT stands for POINTS.
    """
    names = header.get("FIELDS", header.get("COLUMNS", []))
    counts = header.get("COUNT", ["1"] * len(names))
    kinds = list(zip(header.get("TYPE", []), header.get("SIZE", []), strict=False))
    unfit = BadFile(
        f"{path}: the PCD header needs FIELDS, SIZE, TYPE and POINTS (or WIDTH and HEIGHT) that fit each other; "
        f"found {', '.join(header)}."
    )
    try:
        points = int(header["POINTS"][0]) if "POINTS" in header else int(header["WIDTH"][0]) * int(header["HEIGHT"][0])
        widths = [int(width) for width in counts]
        types = [_TYPES[kind] for kind in kinds]
    except (KeyError, IndexError, ValueError):
        raise unfit from None
    if len(names) > _MOST_FIELDS:
        raise BadFile(f"{path}: the PCD header has {len(names)} fields, more than the {_MOST_FIELDS} that are read.")
    sound = points >= 0 and all(1 <= width <= _WIDEST for width in widths)
    if not names or len({len(names), len(types), len(widths)}) > 1 or not sound:
        raise unfit
    # padding fields are all called "_", and are left out like all that begin so: number them
    named = [name if name[0] != "_" and names.count(name) == 1 else f"_{k}" for k, name in enumerate(names)]
    fields: list[Any] = [
        (name, kind) if width == 1 else (name, kind, (width,))
        for name, kind, width in zip(named, types, widths, strict=True)
    ]
    return np.dtype(fields), points


def _short(path: Path, count: int) -> BadFile:
    return BadFile(f"{path}: the file ends before its {count} points.")


def _damaged(path: Path) -> BadFile:
    return BadFile(f"{path}: the compressed points are damaged. Save the file again.")


def _whole(path: Path, body: bytes, dtype: np.dtype[Any], count: int) -> Any:
    if len(body) < count * dtype.itemsize:
        raise _short(path, count)
    return np.frombuffer(body[: count * dtype.itemsize], dtype)


def _ascii(path: Path, body: bytes, dtype: np.dtype[Any], count: int) -> Any:
    width = sum(int(np.prod(dtype[name].shape)) for name in dtype.names or ())
    words = body.split()
    if len(words) < count * width:
        raise _short(path, count)
    values = numbers(path, "a point", words[: count * width]).reshape(count, width)
    table, column = np.zeros(count, dtype), 0
    for name in dtype.names or ():
        size = int(np.prod(dtype[name].shape))
        found = values[:, column : column + size]
        column += size
        if name[0] != "_":  # padding may hold anything
            table[name] = typed(path, f'field "{name}"', found, dtype[name].base).reshape(table[name].shape)
    return table


def _compressed(path: Path, body: bytes, dtype: np.dtype[Any], count: int) -> Any:
    """Return the points of an LZF-compressed body, in which each field lies whole behind the other."""
    if len(body) < 8:
        raise _short(path, count)
    packed, size = struct.unpack("<II", body[:8])
    if size != count * dtype.itemsize or len(body) < 8 + packed:
        raise _short(path, count)
    require_bounded(path, size)
    if size > _DENSEST * packed:
        raise _damaged(path)
    out = np.zeros(size, np.uint8)
    if _inflate(np.frombuffer(body[8 : 8 + packed], np.uint8), out) != size:
        raise _damaged(path)
    table, place = np.zeros(count, dtype), 0
    for name in dtype.names or ():
        length = count * dtype[name].itemsize
        table[name] = out[place : place + length].view(dtype[name].base).reshape(table[name].shape)
        place += length
    return table


@numba.njit(cache=True, nogil=True)
def _inflate(packed: Any, out: Any) -> int:
    """Undo LZF into `out`; return the bytes written, -1 where the data are damaged."""
    i, o = 0, 0
    while i < len(packed):
        control = int(packed[i])
        i += 1
        if control < 32:  # a run of plain bytes
            run = control + 1
            if i + run > len(packed) or o + run > len(out):
                return -1
            out[o : o + run] = packed[i : i + run]
            i, o = i + run, o + run
            continue
        run = control >> 5
        if run == 7:
            if i >= len(packed):
                return -1
            run += int(packed[i])
            i += 1
        if i >= len(packed):
            return -1
        back = o - ((control & 31) << 8) - int(packed[i]) - 1
        i += 1
        run += 2
        if back < 0 or o + run > len(out):
            return -1
        for k in range(run):  # may overlap what it writes
            out[o + k] = out[back + k]
        o += run
    return o
