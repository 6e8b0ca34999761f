"""Folders of posed RGB-D views: camera.json, poses.csv, depth/NAME.png, color/NAME.png or .jpg, perhaps table.json.

Images, colour of 8 bits (PNG, JPEG) and depth of 16 (PNG): the one module that imports pillow (extra `images`).
"""

from __future__ import annotations

import csv
import io
import itertools
import json
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from steelyard.errors import BadFile, MissingDependency
from steelyard.io.contents import in_file, load_json, read_whole, require_bounded, small_text
from steelyard.io.entries import is_number
from steelyard.shape.eight_bits import Colours
from steelyard.shape.views import Depths, Intrinsics, TablePlane, Views
from steelyard.spatial import Pose, Rotation
from steelyard.whole_files import whole_folder, write_bytes, write_text

_COLUMNS = ("name", "x", "y", "z", "qw", "qx", "qy", "qz")
_HEADER = ",".join(_COLUMNS)
_CAMERA = ("width", "height", "fx", "fy", "cx", "cy", "depth_unit_m")
_COLOUR = ("png", "jpg", "jpeg")
MOST_VIEWS = 10_000
_LARGEST_CSV = 16_000_000
_UNIT = 1e-3  # how far from 1 the length of a quaternion may be

MOST_PIXELS = 64_000_000


def read_views(folder: Path | str, progress: Callable[[int, int], None] | None = None) -> Views:
    """Read a folder of views; colour is optional, all or none. Raises BadFile with the file and what is wrong."""
    folder = Path(folder)
    if not folder.is_dir():
        raise BadFile(f"{folder}: no such folder. Views are a folder with camera.json, poses.csv and depth/.")
    camera = _camera(folder / "camera.json")
    names, X_WC = _poses(folder / "poses.csv")
    size = int(camera["height"]), int(camera["width"])
    lens = [camera[key] for key in ("fx", "fy", "cx", "cy")]
    intrinsics = in_file(folder / "camera.json", lambda: Intrinsics(size[1], size[0], *lens))
    coloured = (folder / "color").is_dir()
    require_bounded(folder, len(names) * size[0] * size[1] * (5 if coloured else 2))
    depth = np.zeros((len(names), *size), np.uint16)
    rgb = np.zeros((len(names), *size, 3), np.uint8) if coloured else None
    for k, name in enumerate(names):
        depth[k] = _sized(folder / "depth" / f"{name}.png", read_depth, size)
        if rgb is not None:
            colours = [folder / "color" / f"{name}.{ending}" for ending in _COLOUR]
            found = next((path for path in colours if path.exists()), colours[0])
            rgb[k] = _sized(found, read_colour, size)
        if progress:
            progress(k + 1, len(names))
    table = _table(folder / "table.json") if (folder / "table.json").exists() else None
    return in_file(
        folder, lambda: Views(depth, rgb, intrinsics, X_WC, float(camera["depth_unit_m"]), table, tuple(names))
    )


def _object(path: Path, what: str, keys: tuple[str, ...]) -> dict[str, Any]:
    """Return a JSON object, `what` of the views in words, that has all `keys`."""
    if not path.exists():
        raise BadFile(f"{path}: this file is missing. It needs {', '.join(keys)}.")
    values = load_json(path, f"the {what} of views", f"It needs {', '.join(keys)}.")
    if missing := [key for key in keys if key not in values]:
        raise BadFile(f"{path}: {_named(missing)} missing. It needs {', '.join(keys)}.")
    return values


def _named(missing: list[str]) -> str:
    """Return what is missing, as the subject of a sentence."""
    return ", ".join(f'"{key}"' for key in missing) + (" is" if len(missing) == 1 else " are")


def _number(path: Path, key: str, value: Any) -> float:
    if not is_number(value):
        raise BadFile(f'{path}: "{key}" must be a finite number; got {value!r}.')
    return float(value)


def _camera(path: Path) -> dict[str, float]:
    values = _object(path, "camera", _CAMERA)
    camera = {key: _number(path, key, values[key]) for key in _CAMERA}
    if any(camera[key] != int(camera[key]) for key in ("width", "height")):
        raise BadFile(f"{path}: width and height must be whole numbers of pixels.")
    if camera["width"] * camera["height"] > MOST_PIXELS:
        raise BadFile(
            f"{path}: {camera['width']:.0f} x {camera['height']:.0f} pixels are more than any depth camera has."
        )
    if not 0 < camera["depth_unit_m"] < 1:
        raise BadFile(
            f'{path}: "depth_unit_m" must be metres per step, 0.001 for millimetres; got {camera["depth_unit_m"]:g}.'
        )
    return camera


def _rows(path: Path) -> list[tuple[int, dict[str, Any]]]:
    """Return the rows of a table of poses by column, each with its line in the file."""
    if not path.exists():
        raise BadFile(f"{path}: this file is missing. It needs the columns {', '.join(_COLUMNS)}.")
    try:
        lines = io.StringIO(small_text(path, "a table of poses", "CSV", _LARGEST_CSV), newline="")
        reader = csv.DictReader(lines, skipinitialspace=True)
        # blank lines are passed over
        numbered = [(reader.line_num, row) for row in itertools.islice(reader, MOST_VIEWS + 1)]
    except (UnicodeDecodeError, csv.Error) as error:
        raise BadFile(f"{path}: cannot be read as CSV; {error}.") from None
    if len(numbered) > MOST_VIEWS:
        raise BadFile(f"{path}: these are more than {MOST_VIEWS} views. Leave views out.")
    missing = [key for key in _COLUMNS if not numbered or key not in numbered[0][1]]
    if len(missing) == len(_COLUMNS):
        raise BadFile(f"{path}: expected the columns {', '.join(_COLUMNS)} and a row per view.")
    if missing:
        raise BadFile(f"{path}: {_named(missing)} missing among its columns. It needs {', '.join(_COLUMNS)}.")
    return numbered


def _poses(path: Path) -> tuple[list[str], Pose]:
    """Return the names of the views and the poses (V,) of the camera in W."""
    rows = _rows(path)
    line = [number for number, _ in rows]
    names, numbers = [], np.empty((len(rows), 7))
    for k, (_, row) in enumerate(rows):
        names.append(_name(path, line[k], str(row["name"] or "")))
        for c, key in enumerate(_COLUMNS[1:]):
            try:
                numbers[k, c] = float(row[key] or "")
            except ValueError:
                raise BadFile(
                    f'{path}: line {line[k]}, column "{key}": expected a number; found "{row[key]}".'
                ) from None
    for name, times in Counter(names).items():
        if times > 1:
            raise BadFile(f'{path}: the view "{name}" is named {times} times. Give each view its own name.')
    bad = np.flatnonzero(~np.isfinite(numbers).all(1))
    if len(bad):
        raise BadFile(f"{path}: line {line[bad[0]]} holds NaN or infinity; {len(bad)} of {len(rows)} poses do.")
    length = np.linalg.norm(numbers[:, 3:], axis=1)
    off = np.flatnonzero(np.abs(length - 1) > _UNIT)
    if len(off):
        raise BadFile(
            f"{path}: line {line[off[0]]}: the quaternion qw, qx, qy, qz must have length 1; "
            f"it has {length[off[0]]:.4g}."
        )
    return names, Pose(Rotation.from_quaternion_wxyz(numbers[:, 3:] / length[:, None]), numbers[:, :3])


def _name(path: Path, line: int, name: str) -> str:
    """Return the name of a view, which must be a file's name inside the folder."""
    if not name or name.startswith(".") or any(mark in name for mark in ("/", "\\", ":", "\0")):
        raise BadFile(
            f'{path}: line {line}: "{name}" is no name of a view. Use letters, digits, - and _ without folders.'
        )
    return name


def _sized(path: Path, read: Callable[[Path], Any], size: tuple[int, int]) -> Any:
    pixels = read(path)
    if pixels.shape[:2] != size:
        raise BadFile(
            f"{path}: this image has {pixels.shape[1]} x {pixels.shape[0]} pixels; "
            f"camera.json says {size[1]} x {size[0]}."
        )
    return pixels


def _table(path: Path) -> TablePlane:
    values = _object(path, "table", ("normal", "offset_m"))
    normal = values["normal"]
    if not isinstance(normal, list) or len(normal) != 3:
        raise BadFile(f'{path}: "normal" must be three numbers; got {normal!r}.')
    axes = np.array([_number(path, "normal", value) for value in normal])
    return in_file(path, lambda: TablePlane(axes, _number(path, "offset_m", values["offset_m"])))


def write_views(views: Views, folder: Path | str, beside: Mapping[str, str] | None = None) -> None:
    """Write views as a folder, all of it or nothing; images are named 0000, 0001, ... Raises BadFile.

    beside  text files of the same folder by name

    Of views written here before, what these lack goes: their table, colours and further images. Other files stay, and
    where they would be read as a table or colours that these views lack, nothing is written.
    """
    require_images()
    folder = Path(folder)
    names = [f"{k:04d}" for k in range(len(views))]
    old = [path for path in _written_before(folder) if path.exists()]
    _require_unread(views, folder, old)
    with whole_folder(folder) as new:
        for k, name in enumerate(names):
            for kind, images in (("depth", views.depth), ("color", views.rgb)):
                if images is not None:
                    (new / kind).mkdir(exist_ok=True)
                    write_image(new / kind / f"{name}.png", images[k])
        lens = views.intrinsics
        camera = {key: getattr(lens, key) for key in _CAMERA[:-1]} | {"depth_unit_m": views.depth_unit}
        write_text(new / "camera.json", json.dumps(camera, indent=1))
        numbers = np.column_stack([views.X_WC.position, views.X_WC.rotation.quaternion_wxyz()])
        lines = [",".join([name, *map(repr, row)]) for name, row in zip(names, numbers.tolist(), strict=True)]
        write_text(new / "poses.csv", "\n".join([_HEADER, *lines]) + "\n")
        if views.table is not None:
            table = {"normal": views.table.normal.tolist(), "offset_m": views.table.offset}
            write_text(new / "table.json", json.dumps(table))
        for name, text in (beside or {}).items():
            write_text(new / name, text)
        stale = [path for path in old if not (new / path.relative_to(folder)).exists()]
    for path in stale:
        path.unlink(missing_ok=True)
    if views.rgb is None and (folder / "color").is_dir():
        (folder / "color").rmdir()


def _written_before(folder: Path) -> list[Path]:
    """Return the files that `write_views` may have left in a folder and would not always replace."""
    try:
        lines = (folder / "poses.csv").read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError):
        return []
    names = [line.partition(",")[0] for line in lines[1:]]
    if lines[:1] != [_HEADER] or names != [f"{k:04d}" for k in range(len(names))]:
        return []
    return [folder / "table.json", *(folder / kind / f"{name}.png" for kind in ("depth", "color") for name in names)]


def _require_unread(views: Views, folder: Path, old: list[Path]) -> None:
    """Raise BadFile where files of someone else would be read as the colour or the table that the views lack."""
    colour = sorted((folder / "color").iterdir()) if (folder / "color").is_dir() else []
    table = [path for path in (folder / "table.json",) if path.exists()]
    for what, lacks, there in (("colour", views.rgb is None, colour), ("table", views.table is None, table)):
        if lacks and (others := [path for path in there if path not in old]):
            raise BadFile(f"{others[0]}: these views have no {what}; move this file away or write into another folder.")


def require_images() -> Any:
    """Return what reads and writes images; raises MissingDependency where nothing does here."""
    try:
        import PIL.Image
    except ImportError:
        raise MissingDependency.of("pillow", "images", "Reading and writing images") from None
    return PIL.Image


def read_depth(path: Path) -> Depths:
    """Return a depth image (H, W) uint16; raises BadFile where it has not one channel of 16 bits."""
    image = _opened(path, ("PNG",))
    if not image.mode.startswith("I"):
        raise BadFile(f"{path}: depth must be a PNG with one channel of 16 bits; this one has mode {image.mode}.")
    return np.asarray(_pixels(path, image), np.uint16)


def read_colour(path: Path) -> Colours:
    """Return a colour image (H, W, 3) uint8; raises BadFile."""
    image = _opened(path, ("PNG", "JPEG"))
    if image.mode not in ("RGB", "RGBA", "L", "P", "LA"):
        raise BadFile(f"{path}: colour must be RGB or grey with 8 bits per channel; this image has mode {image.mode}.")
    return np.asarray(_pixels(path, image, "RGB"), np.uint8)


def _opened(path: Path, formats: tuple[str, ...]) -> Any:
    pillow = require_images()
    if not path.exists():
        raise BadFile(f"{path}: this image is missing.")
    content = read_whole(path)
    try:
        image = pillow.open(io.BytesIO(content), formats=formats)
    except pillow.DecompressionBombError:
        raise BadFile(f"{path}: this image has more pixels than any depth camera.") from None
    except (OSError, ValueError, SyntaxError):
        raise BadFile(f"{path}: expected a {' or '.join(formats)} image; found something else.") from None
    if image.width * image.height > MOST_PIXELS:
        raise BadFile(f"{path}: {image.width} x {image.height} pixels are more than any depth camera has.")
    return image


def _pixels(path: Path, image: Any, mode: str | None = None) -> Any:
    try:
        return np.asarray(image if mode is None else image.convert(mode))
    except (OSError, ValueError, SyntaxError) as error:
        raise BadFile(f"{path}: this image is damaged ({error}). Save it again.") from None


def write_image(path: Path, pixels: Depths | Colours) -> None:
    """Write (H, W) uint16 or (H, W, 3) uint8 as PNG; raises BadFile."""
    content = io.BytesIO()
    require_images().fromarray(np.ascontiguousarray(pixels)).save(content, "PNG", compress_level=1)
    write_bytes(path, content.getvalue())
