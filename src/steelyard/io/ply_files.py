"""PLY files: elements of named columns, ascii or binary, read and written; triangle meshes with a part per face."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from steelyard.errors import BadFile
from steelyard.io.contents import in_file, numbers, read_whole, typed
from steelyard.shape.mesh import TriangleMesh
from steelyard.whole_files import write_bytes

Column = np.ndarray[Any, np.dtype[Any]]

_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4",
    "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "float32": "f4", "float64": "f8",
}  # fmt: skip
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_INDICES = ("vertex_indices", "vertex_index")
_MOST_DIGITS = 15  # of a number of rows
_MOST_PROPERTIES = 1000  # of all elements
_ONE_PART = 'its faces have no "part": all of it was taken as one part of one density'


@dataclass(frozen=True)
class _Element:
    name: str
    count: int
    fields: list[tuple[str, str, str]]  # name, type of the values, type of a list's length or ""


@dataclass(frozen=True)
class Ply:
    """A PLY file whose header was read: its byte order ("" for ascii), its elements and what stands behind them."""

    path: Path
    order: str
    elements: list[_Element]
    body: bytes

    @classmethod
    def open(cls, path: Path) -> Ply:
        """Read the header; raises BadFile."""
        content = read_whole(path)
        order, elements, body = _header(path, content)
        return cls(path, order, elements, content[body:])

    def count(self, name: str) -> int:
        """Return how many rows of an element are announced."""
        return sum(element.count for element in self.elements if element.name == name)

    def read(self, *wanted: str) -> dict[str, dict[str, Column]]:
        """Return element -> column -> values as `read_ply`, up to the last that is wanted, all where none is named.

        What stands behind is passed over: its lists may have any lengths. Raises BadFile.
        """
        places = [k for k, element in enumerate(self.elements, 1) if element.name in wanted or not wanted]
        out, rest = {}, self.body
        words = rest.split() if not self.order else []
        for element in self.elements[: max(places, default=0)]:
            if self.order:
                table, used = _binary(self.path, element, rest, self.order)
                rest = rest[used:]
            else:
                table, used = _ascii(self.path, element, words)
                words = words[used:]
            out[element.name] = {name: table[name] for name, _, _ in element.fields}
        return out


def read_ply(path: Path | str) -> dict[str, dict[str, Column]]:
    """Return element -> column -> values (N,) or, for a list of equal lengths, (N, k); raises BadFile."""
    return Ply.open(Path(path)).read()


def _header(path: Path, content: bytes) -> tuple[str, list[_Element], int]:
    """Return byte order ("" for ascii), elements and where the body starts; lines may end in CR LF."""
    if not content.startswith(b"ply"):
        raise BadFile(f'{path}: expected a PLY file, which starts with "ply"; found something else.')
    mark = content.find(b"end_header")
    end = content.find(b"\n", mark)
    if mark < 0 or end < 0:
        raise BadFile(f"{path}: the PLY header has no end_header line. Save the file again.")
    order, elements = None, list[_Element]()
    for line in content[:mark].decode("latin-1").splitlines():
        match line.split():
            case ["format", kind, _]:
                order = _ORDERS.get(kind)
            case ["element", name, count] if count.isdecimal() and len(count) <= _MOST_DIGITS:
                elements.append(_Element(name, int(count), []))
            case ["property", kind, name] if kind in _TYPES and elements:
                elements[-1].fields.append((name, _TYPES[kind], ""))
            case ["property", "list", length, kind, name] if {length, kind} <= set(_TYPES) and elements:
                if _TYPES[length][0] == "f":
                    raise BadFile(f'{path}: the lists "{name}" count in {length}; lengths are whole numbers.')
                elements[-1].fields.append((name, _TYPES[kind], _TYPES[length]))
            case ["ply"] | ["comment", *_] | ["obj_info", *_] | []:
                pass
            case _:
                raise BadFile(f'{path}: the PLY header has a line that means nothing: "{line.strip()[:60]}".')
        if len(elements) + sum(len(element.fields) for element in elements) > _MOST_PROPERTIES:
            raise BadFile(f"{path}: the PLY header has more than {_MOST_PROPERTIES} elements and properties.")
    if order is None:
        raise BadFile(f"{path}: the PLY header names no format among {', '.join(_ORDERS)}.")
    _require_names_apart(path, elements)
    return order, [element for element in elements if element.fields], end + 1


def _require_names_apart(path: Path, elements: list[_Element]) -> None:
    """Raise BadFile where two properties of an element have one name: which of them is meant?"""
    for element in elements:
        names = [name for name, _, _ in element.fields]
        if twice := [name for name in names if names.count(name) > 1]:
            raise BadFile(f'{path}: element "{element.name}" has {names.count(twice[0])} properties "{twice[0]}".')


def _binary(path: Path, element: _Element, data: bytes, order: str) -> tuple[Any, int]:
    """Return the columns of one element and the bytes it took; lists must all be as long as the first."""
    fields: list[Any] = []
    place = 0
    for name, kind, length in element.fields:
        if length:
            size = np.dtype(length).itemsize
            first = data[place : place + size] if element.count else b""
            k = max(int(np.frombuffer(first.ljust(size, b"\0"), order + length)[0]), 0)
            if k * np.dtype(kind).itemsize > len(data):
                raise _short(path, element)
            # No name in a header has a blank.
            fields += [(f"{name} #", order + length), (name, order + kind, (k,))]
        else:
            fields.append((name, order + kind))
        place = np.dtype(fields).itemsize
    used = np.dtype(fields).itemsize * element.count
    if used > len(data):
        raise _short(path, element)
    table = np.frombuffer(data[:used], np.dtype(fields))
    for name, _, length in element.fields:
        if length and element.count and (table[f"{name} #"] != table[name].shape[1]).any():
            raise _ragged(path, name)
    return table, used


def _ascii(path: Path, element: _Element, words: list[bytes]) -> tuple[dict[str, Column], int]:
    """Return the columns of one element and the words it took."""
    slots: list[tuple[str, str, int, int]] = []  # name, type, first word, number of words
    width = 0
    for name, kind, length in element.fields:
        try:
            k = max(int(words[width]), 0) if length and element.count else 1
        except (IndexError, ValueError):
            k = 1
        slots.append((name, kind, width + bool(length), k if length else 0))
        width += k + bool(length)
    used = width * element.count
    if used > len(words):
        raise _short(path, element)
    table = numbers(path, f'element "{element.name}"', words[:used]).reshape(element.count, width)
    out = {}
    for (name, kind, first, k), (_, _, length) in zip(slots, element.fields, strict=True):
        if length and (table[:, first - 1] != k).any():
            raise _ragged(path, name)
        values = table[:, first : first + k] if length else table[:, first]
        out[name] = typed(path, f'property "{name}" of element "{element.name}"', values, kind)
    return out, used


def _short(path: Path, element: _Element) -> BadFile:
    return BadFile(f'{path}: the file ends inside element "{element.name}" ({element.count} announced).')


def _ragged(path: Path, name: str) -> BadFile:
    return BadFile(f'{path}: the lists "{name}" differ in length. Save every face as a triangle.')


def read_mesh(path: Path | str) -> TriangleMesh:
    """Return the triangles of a PLY file, in metres as they stand there; faces without `part` are part 0.

    Raises BadFile where the file is no mesh of triangles.
    """
    return read_mesh_noting(path)[0]


def read_mesh_noting(path: Path | str) -> tuple[TriangleMesh, tuple[str, ...]]:
    """Return the triangles of a PLY file as `read_mesh`, and a note where its faces have no `part`; raises BadFile."""
    path = Path(path)
    elements = read_ply(path)
    vertex, face = elements.get("vertex", {}), elements.get("face", {})
    indices = next((face[name] for name in _INDICES if name in face), None)
    if indices is None or not {"x", "y", "z"} <= set(vertex):
        raise BadFile(
            f"{path}: a mesh needs vertices with x, y, z and faces with vertex_indices; this PLY has not both. "
            "A cloud is given with --scan."
        )
    if len(indices) and indices.shape[1] != 3:
        raise BadFile(f"{path}: faces have {indices.shape[1]} corners. Save every face as a triangle.")
    colours = [face[name] for name in ("red", "green", "blue") if name in face]
    xyz = np.stack([vertex[axis] for axis in "xyz"], axis=1)
    rgb = np.stack(colours, axis=1) if len(colours) == 3 else None
    part = face.get("part", np.zeros(len(indices)))
    notes = () if "part" in face else (f"{path.name}: {_ONE_PART}",)
    return in_file(path, lambda: TriangleMesh(xyz, indices, part, rgb)), notes


def write_mesh(mesh: TriangleMesh, path: Path | str) -> None:
    """Write a mesh as PLY with double coordinates and part, red, green, blue per face; raises BadFile."""
    path = Path(path)
    vertex = np.zeros(len(mesh.vertices), [(axis, "<f8") for axis in "xyz"])
    for k, axis in enumerate("xyz"):
        vertex[axis] = mesh.vertices[:, k]
    face = np.zeros(len(mesh), [("n", "u1"), ("v", "<i4", 3), ("rgb", "u1", 3), ("part", "<i4")])
    face["n"], face["v"], face["rgb"], face["part"] = 3, mesh.triangles, mesh.colours, mesh.part
    colours = (f"uchar {name}" for name in ("red", "green", "blue"))
    places, faces = [f"double {axis}" for axis in "xyz"], ["list uchar int vertex_indices", *colours, "int part"]
    write_bytes(path, ply({"vertex": (places, vertex), "face": (faces, face)}))


def ply(elements: Mapping[str, tuple[Sequence[str], Column]]) -> bytes:
    """Return a binary PLY file of elements: type and name of their properties, and their records (N,), packed alike."""
    lines = ["ply", "format binary_little_endian 1.0", "comment units metres"]
    for name, (properties, records) in elements.items():
        lines += [f"element {name} {len(records)}", *(f"property {each}" for each in properties)]
    body = b"".join(records.tobytes() for _, records in elements.values())
    return "\n".join([*lines, "end_header", ""]).encode() + body
