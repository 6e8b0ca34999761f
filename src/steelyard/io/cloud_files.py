"""Clouds as files: PLY (ascii, binary), PCD (ascii, binary, compressed) and NPZ in; PLY and NPZ out.

What a scan said stands beside its points: bytes of JSON, and one byte for every cell. A file may come from a stranger:
sizes are bounded, findings have codes of ours, and no text steers a terminal.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from steelyard.errors import BadFile, BadValue
from steelyard.findings import REMEDIES, Finding
from steelyard.io.contents import in_file
from steelyard.io.ply_files import Ply, ply
from steelyard.io.shapes.pcd_files import read_pcd
from steelyard.io.tables.array_table import ArrayTable, npz, read_numbers
from steelyard.shape.cloud import Cloud
from steelyard.shape.known_space import Kept, KeptSpace
from steelyard.whole_files import write_bytes

SUFFIXES = (".ply", ".pcd", ".npz")
_FEW = 0.1  # of the points: fewer without a normal are left out, of more no normal is used
_LABELS = ("label", "segmentation", "part")
_COLOURS = (("red", "green", "blue"), ("r", "g", "b"), ("diffuse_red", "diffuse_green", "diffuse_blue"))
_NORMALS = (("nx", "ny", "nz"), ("normal_x", "normal_y", "normal_z"))
# Of an NPZ, ours first: other programs call points, colours and normals by other names.
_ARRAYS = (
    ("xyz", "points", "positions"),
    ("rgb", "colors", "colours", "color", "colour"),
    ("label",),
    ("normals", "normal"),
    ("seen",),
)

# Of a PLY elements, of an NPZ arrays.
SCAN, CELLS = "scan", "cell_emptied"
_MOST_BYTES, _LONGEST = 100_000, 4000
_NUMBERS = ("unseen", "unsure_m3", "skin")


def read_cloud(path: Path | str) -> Cloud:
    """Read a cloud in metres by the ending of its name; raises BadFile.

    Points with NaN or infinity, as in the holes of an organised PCD, are left out and counted, and so are few that have
    no normal among many that have one.
    """
    path, kept = Path(path), None
    if not path.is_file():
        raise BadFile(f"{path}: no such file.")
    match path.suffix.lower():
        case ".ply":
            file = Ply.open(path)
            _require_points_only(path, file.count("face"))
            elements = file.read("vertex", SCAN, CELLS)
            columns = elements.get("vertex", {})
            kept = kept_of(path, *(next(iter(elements.get(name, {}).values()), None) for name in (SCAN, CELLS)))
        case ".pcd":
            columns = read_pcd(path)
        case ".npz":
            return _of_arrays(path)
        case other:
            raise BadFile(f'{path}: "{other}" is no cloud. Give {", ".join(SUFFIXES)}.')
    missing = [axis for axis in "xyz" if axis not in columns]
    if missing:
        raise BadFile(f'{path}: points need x, y and z; "{missing[0]}" is missing.')
    normals = next((names for names in _NORMALS if set(names) <= set(columns)), None)
    label = next((columns[name] for name in _LABELS if name in columns), None)
    turned = None if normals is None else _stacked(columns, normals)
    points = (_stacked(columns, "xyz"), _rgb(columns), label, turned, columns.get("seen"))
    return _checked(path, points, kept)


def _require_points_only(path: Path, faces: int) -> None:
    """Raise BadFile where the file is a mesh: its vertices lie where its maker needed them, not all over."""
    if faces:
        raise BadFile(
            f"{path}: this is a mesh of {faces} faces; a cloud has points alone. Give the mesh with --parts, or save "
            "points spread over its surface."
        )


def _stacked(columns: dict[str, Any], names: Any) -> Any:
    return np.stack([np.asarray(columns[name]) for name in names], axis=1)


def _rgb(columns: dict[str, Any]) -> Any:
    """Return colours (N, 3) as they stand in red, green, blue, or from packed rgb; None where there are none."""
    for names in _COLOURS:
        if set(names) <= set(columns):
            return _stacked(columns, names)
    for name in ("rgb", "rgba"):
        if name in columns:
            bits = _bits(np.ascontiguousarray(columns[name]))
            return np.stack([bits >> shift & 255 for shift in (16, 8, 0)], axis=1).astype(np.uint8)
    return None


def _bits(packed: Any) -> Any:
    """Return packed colours (N,) as whole numbers: as they are, also in floats, or those whose bits floats have.

    A float with the bits of a colour is below 1e-37, negative, or larger than any packed colour.
    """
    if packed.dtype.kind == "f":
        with np.errstate(invalid="ignore"):  # bits of a colour may be those of NaN
            whole = (packed == np.floor(packed)) & (packed >= 0) & (packed < 2**32)
        if not whole.all():
            return packed.astype(np.float32).view(np.uint32)
    return packed.astype(np.uint32)


def _of_arrays(path: Path) -> Cloud:
    header = ArrayTable.open(path).header  # refuses pickles by their header
    wanted = [next((name for name in names if name in header.groups), names[0]) for names in _ARRAYS]
    if wanted[0] not in header.groups:
        parts = "; it holds parts, which --parts takes" if "tets" in header.groups else ""
        raise BadFile(f'{path}: array "xyz" (N, 3) in metres is missing{parts}.')
    found = read_numbers(path, [name for name in (*wanted, SCAN, CELLS) if name in header.shapes])
    kept = kept_of(path, found.get(SCAN), found.get(CELLS))
    return _checked(path, tuple(found.get(name) for name in wanted), kept)


def _checked(path: Path, points: tuple[Any, ...], kept: Kept | None) -> Cloud:
    """Return the cloud of finite points; raises BadFile where none is left or columns differ in length.

    points  xyz, rgb, label, normals, seen; None what is not known
    """
    xyz = np.asarray(points[0], np.float64)
    if xyz.ndim != 2 or xyz.shape[1] != 3:
        raise BadFile(f"{path}: points must have shape (N, 3); got {xyz.shape}.")
    holes: Any = ~np.isfinite(xyz).all(1)
    if holes.all():
        what = f"all {len(xyz)} points are NaN or infinite" if len(xyz) else "the file holds no points"
        raise BadFile(f"{path}: {what}. Write the cloud again, or scan the object again.")
    whole = [None if c is None else np.asarray(c) for c in points[1:]]
    holes |= _without_normal(whole[2], holes)
    if holes.any():
        xyz, whole = xyz[~holes], [c if c is None or len(c) != len(holes) else c[~holes] for c in whole]
    return in_file(path, lambda: Cloud(xyz, *whole, left_out=int(holes.sum()), kept=kept))


def _without_normal(normals: Any, holes: Any) -> Any:
    """Return which points (N,) have no normal where nearly all that have a place have one.

    The Point Cloud Library gives NaN to points with too few neighbours; all zero is a column that nobody filled.
    """
    if normals is None or normals.shape != (len(holes), 3):
        return np.zeros(len(holes), bool)
    none = ~(np.isfinite(normals).all(1) & normals.any(1))
    return none & (none[~holes].mean() < _FEW)


def write_cloud(cloud: Cloud, path: Path | str) -> None:
    """Write a cloud as .ply (binary) or .npz, whole or not at all; raises BadFile."""
    path = Path(path)
    match path.suffix.lower():
        case ".ply":
            write_bytes(path, _ply(cloud))
        case ".npz":
            names = ("xyz", "rgb", "label", "normals", "seen")
            columns = {name: getattr(cloud, name) for name in names if getattr(cloud, name) is not None}
            write_bytes(path, npz({**columns, **_beside(cloud)}))
        case other:
            raise BadFile(f'{path}: a cloud is written as .ply or .npz, not as "{other}".')


def _beside(cloud: Cloud) -> dict[str, Any]:
    """Return the arrays of bytes that keep what a scan said beside its points: none where no scan did."""
    return {} if cloud.kept is None else {SCAN: bytes_of(cloud.kept), CELLS: cloud.kept.space.fifths.astype(np.uint8)}


def _ply(cloud: Cloud) -> bytes:
    fields: list[tuple[str, str, str, Any]] = [(axis, "double", "<f8", cloud.xyz[:, k]) for k, axis in enumerate("xyz")]
    if cloud.normals is not None:
        fields += [(name, "double", "<f8", cloud.normals[:, k]) for k, name in enumerate(_NORMALS[0])]
    if cloud.rgb is not None:
        fields += [(name, "uchar", "u1", cloud.rgb[:, k]) for k, name in enumerate(("red", "green", "blue"))]
    if cloud.label is not None:
        fields.append(("label", "int", "<i4", cloud.label))
    if cloud.seen is not None:
        fields.append(("seen", "uchar", "u1", cloud.seen))
    table = np.zeros(len(cloud), [(name, kind) for name, _, kind, _ in fields])
    for name, _, _, values in fields:
        table[name] = values
    beside = {name: (["uchar value"], values) for name, values in _beside(cloud).items()}
    return ply({"vertex": ([f"{word} {name}" for name, word, _, _ in fields], table), **beside})


def bytes_of(kept: Kept) -> Any:
    """Return what a scan said, but for its cells, as bytes of JSON (B,)."""
    said: dict[str, Any] = {name: getattr(kept.space, name) for name in _NUMBERS}
    said |= {"place_std": list(kept.place_std), "findings": [finding.plain() for finding in kept.findings]}
    return np.frombuffer(json.dumps(said).encode(), np.uint8)


def kept_of(path: Path, said: Any, fifths: Any) -> Kept | None:
    """Return what `bytes_of` and the bytes of cells (T,) keep, None where a file has neither; raises BadFile."""
    if said is None or fifths is None:
        return None
    for name, values in ((SCAN, said), (CELLS, fifths)):
        if values.dtype != np.uint8 or values.ndim != 1:
            raise BadFile(f'{path}: "{name}" must be bytes (N,), uint8; found {values.dtype}, shape {values.shape}.')
    if len(said) > _MOST_BYTES:
        raise BadFile(f'{path}: "{SCAN}" has {len(said)} bytes; what a scan says is shorter.')
    try:
        values = json.loads(said.tobytes())
        numbers = {name: float(values[name]) for name in _NUMBERS}
        shift, turn = map(float, values["place_std"])
        findings = tuple(_finding(each) for each in values["findings"])
    except (ValueError, TypeError, KeyError, OverflowError, RecursionError, BadValue) as error:
        raise BadFile(
            f'{path}: "{SCAN}" is not what `steelyard scan` writes ({error!r}). Scan the object again.'
        ) from None
    return in_file(path, lambda: Kept(findings, KeptSpace(**numbers, fifths=fifths), (shift, turn)))


def _finding(said: Any) -> Finding:
    code, message, remedy = (said[name] for name in ("code", "message", "remedy"))
    texts = (message, remedy)
    if code not in REMEDIES or not all(isinstance(t, str) and t.isprintable() and len(t) < _LONGEST for t in texts):
        raise BadValue(f'no finding of ours: "{str(code)[:80]}"')
    return Finding(code, message, remedy)
