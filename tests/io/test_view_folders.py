"""View folders: what is written is read again; each wrong file has its one sentence."""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from steelyard.errors import BadFile
from steelyard.io import contents, view_folders
from steelyard.io.object_folders import write_object_views
from steelyard.io.recordings.description import read_object_pose
from steelyard.io.view_folders import read_views, write_views
from steelyard.shape.views import Intrinsics, TablePlane, Views
from steelyard.spatial import Pose, Rotation

pytest.importorskip("PIL")
RNG = np.random.default_rng(0)
VIEWS = Views(
    RNG.integers(300, 500, (3, 24, 32)).astype(np.uint16),
    RNG.integers(0, 255, (3, 24, 32, 3)).astype(np.uint8),
    Intrinsics(32, 24, 30.0, 31.0, 15.5, 11.5),
    Pose(Rotation.exp(RNG.normal(size=(3, 3))), RNG.normal(size=(3, 3))),
    0.001,
    TablePlane(np.array([0.0, 0.0, 1.0]), 0.1),
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_views(VIEWS, tmp_path)
    return tmp_path


def test_written_views_are_read_again(folder: Path) -> None:
    read = read_views(folder)
    assert np.array_equal(read.depth, VIEWS.depth)
    assert np.array_equal(read.rgb, VIEWS.rgb)
    assert read.intrinsics == VIEWS.intrinsics
    assert read.X_WC.matrix() == pytest.approx(VIEWS.X_WC.matrix(), abs=1e-12)
    assert read.table is not None
    assert read.table.offset == 0.1


@pytest.mark.parametrize("ending", ["jpg", "jpeg"])
def test_colours_may_be_jpeg(folder: Path, ending: str) -> None:
    """As Open3D, COLMAP and most cameras write them; PNG stands first where both lie there."""
    from PIL import Image

    for path in (folder / "color").iterdir():
        Image.fromarray(np.full((24, 32, 3), 90, np.uint8)).save(path.with_suffix(f".{ending}"))
    assert np.array_equal(read_views(folder).rgb, VIEWS.rgb)
    for path in (folder / "color").glob("*.png"):
        path.unlink()
    rgb = read_views(folder).rgb
    assert rgb is not None
    assert np.abs(rgb.astype(float) - 90).max() <= 1


def test_depth_may_not_be_jpeg(folder: Path) -> None:
    from PIL import Image

    Image.fromarray(np.full((24, 32), 90, np.uint8)).save(folder / "depth" / "0000.png", "JPEG")
    with pytest.raises(BadFile, match=r"depth/0000\.png: expected a PNG image; found something else\.$"):
        read_views(folder)


def names(folder: Path) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())


def test_what_other_views_left_goes_and_other_files_stay(folder: Path) -> None:
    for name in ("notes.txt", "depth/notes.txt", "depth/0009.png"):
        (folder / name).write_text("mine")
    plain = Views(VIEWS.depth[:2], None, VIEWS.intrinsics, VIEWS.X_WC[:2], 0.001)
    write_views(plain, folder)
    mine = ["depth/0009.png", "depth/notes.txt", "notes.txt"]
    assert names(folder) == sorted(["camera.json", "depth/0000.png", "depth/0001.png", "poses.csv", *mine])
    read = read_views(folder)
    assert read.rgb is None
    assert read.table is None
    assert np.array_equal(read.depth, plain.depth)


@pytest.mark.parametrize(("name", "what"), [("color/mine.png", "colour"), ("table.json", "table")])
def test_what_someone_else_left_does_not_pass_for_colour_or_table(folder: Path, name: str, what: str) -> None:
    poses = (folder / "poses.csv").read_text()
    (folder / "poses.csv").write_text(poses.replace("\n0000,", "\nleft,") if what == "table" else poses)
    (folder / name).write_text("mine")
    before = {path: (folder / path).read_bytes() for path in names(folder)}
    plain = Views(VIEWS.depth, None if what == "colour" else VIEWS.rgb, VIEWS.intrinsics, VIEWS.X_WC, 0.001)
    with pytest.raises(BadFile) as caught:
        write_views(plain, folder)
    said = f"these views have no {what}; move this file away or write into another folder."
    assert str(caught.value) == f"{folder}/{name}: {said}"
    assert {path: (folder / path).read_bytes() for path in names(folder)} == before


def test_a_folder_of_someone_else_loses_nothing_but_what_is_written_over(folder: Path) -> None:
    poses = (folder / "poses.csv").read_text()
    (folder / "poses.csv").write_text(poses.replace("\n0000,", "\nleft,"))
    write_views(Views(VIEWS.depth[:1], VIEWS.rgb[:1], VIEWS.intrinsics, VIEWS.X_WC[:1], 0.001, VIEWS.table), folder)
    assert {"depth/0002.png", "color/0002.png"} <= set(names(folder))


def test_views_are_written_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from steelyard.io import view_folders

    def fails(path: Path, pixels: np.ndarray) -> None:
        raise BadFile(f"{path.name}: cannot be written (the disk is full).")

    monkeypatch.setattr(view_folders, "write_image", fails)
    for write in (write_views, lambda views, folder: write_object_views(views, Pose.identity(), folder)):
        with pytest.raises(BadFile, match="the disk is full"):
            write(VIEWS, tmp_path / "new")
        assert list(tmp_path.iterdir()) == []


def test_views_of_an_object_lie_beside_where_they_sit(tmp_path: Path) -> None:
    write_object_views(VIEWS, Pose.identity(), tmp_path)
    assert len(read_views(tmp_path)) == 3
    assert read_object_pose(str(tmp_path / "object.toml")).pose.position.tolist() == [0, 0, 0]


def camera(**change: object) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        path = folder / "camera.json"
        path.write_text(json.dumps(json.loads(path.read_text()) | change))

    return make


def bomb(size: int) -> bytes:
    """Return a PNG of so many pixels across and down that holds none of them."""

    def chunk(kind: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    header = struct.pack(">IIBBBBB", size, size, 16, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(b"")) + chunk(b"IEND", b"")


CAMERA = "width, height, fx, fy, cx, cy, depth_unit_m"
COLUMNS = "name, x, y, z, qw, qx, qy, qz"


def without(*keys: str) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        path = folder / "camera.json"
        path.write_text(json.dumps({k: v for k, v in json.loads(path.read_text()).items() if k not in keys}))

    return make


def headed(old: str, new: str) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        path = folder / "poses.csv"
        path.write_text(path.read_text().replace(old, new, 1))

    return make


def pose(old: str, new: str) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        lines = (folder / "poses.csv").read_text().splitlines()
        row = dict(zip(lines[0].split(","), lines[2].split(","), strict=True)) | {old: new}
        lines[2] = ",".join(row.values())
        (folder / "poses.csv").write_text("\n".join(lines))

    return make


WRONG: list[tuple[str, Callable[[Path], object], str]] = [
    ("no depth", lambda f: (f / "depth" / "0001.png").unlink(), "0001.png: this image is missing"),
    ("no picture", lambda f: (f / "depth" / "0001.png").write_bytes(b"x"), "expected a PNG image"),
    ("colour as depth", lambda f: (f / "color" / "0001.png").replace(f / "depth" / "0001.png"), "16 bits"),
    ("other size", camera(width=64, cx=30), "32 x 24 pixels; camera.json says 64 x 24"),
    ("too many pixels", camera(width=10**9, height=10**9), "camera.json: 1000000000 x 1000000000 pixels are more than"),
    ("a bomb", lambda f: (f / "depth" / "0001.png").write_bytes(bomb(20_000)), "0001.png: this image has more pixels"),
    ("no lens", camera(fx=0), "fx must be a focal length"),
    ("centre outside", camera(cx=99), "cx must lie inside the image"),
    ("not a number", camera(fy="wide"), '"fy" must be a finite number'),
    ("kilometres", camera(depth_unit_m=0.9), "puts the scene"),
    ("no camera", lambda f: (f / "camera.json").unlink(), "this file is missing"),
    ("no fx", without("fx"), rf'camera.json: "fx" is missing\. It needs {CAMERA}\.$'),
    ("no fx, no cy", without("cy", "fx"), rf'camera.json: "fx", "cy" are missing\. It needs {CAMERA}\.$'),
    ("camera a list", lambda f: (f / "camera.json").write_text("[]"), rf"one JSON object\. It needs {CAMERA}\.$"),
    ("no x", headed("name,x,", "name,a,"), rf'poses.csv: "x" is missing among its columns\. It needs {COLUMNS}\.$'),
    ("no header", headed(COLUMNS.replace(" ", ""), "1,2"), rf"expected the columns {COLUMNS} and a row per view\.$"),
    ("no poses", lambda f: (f / "poses.csv").unlink(), "this file is missing"),
    ("long quaternion", pose("qw", "3"), "must have length 1"),
    ("nan", pose("x", "nan"), "line 3 holds NaN"),
    ("word", pose("x", "here"), 'expected a number; found "here"'),
    ("leaves the folder", pose("name", "../../etc/passwd"), "is no name of a view"),
    ("twice", pose("name", "0000"), "named 2 times"),
    ("bad table", lambda f: (f / "table.json").write_text('{"normal": [0, 0, 2], "offset_m": 0}'), "unit vector"),
    ("table without offset", lambda f: (f / "table.json").write_text('{"normal": [0, 0, 1]}'),
     r'table.json: "offset_m" is missing\. It needs normal, offset_m\.$'),
]  # fmt: skip


def test_lines_are_those_of_the_file_where_some_are_blank(folder: Path) -> None:
    pose("x", "here")(folder)
    text = (folder / "poses.csv").read_text().replace("\n", "\n\n")
    (folder / "poses.csv").write_text(text)
    with pytest.raises(BadFile, match='line 5, column "x": expected a number; found "here"'):
        read_views(folder)


@pytest.mark.parametrize(("make", "message"), [row[1:] for row in WRONG], ids=[row[0] for row in WRONG])
def test_wrong_folders(folder: Path, make: Callable[[Path], object], message: str) -> None:
    make(folder)
    with pytest.raises(BadFile, match=message):
        read_views(folder)


def test_more_views_than_fit_are_refused_before_one_is_read(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(contents, "MOST_BYTES", 3 * 24 * 32 * 5 - 1)
    with pytest.raises(BadFile, match=r"holds 0 MiB, more than the 0 MiB that are read\. Give fewer rows, points or"):
        read_views(folder)
    monkeypatch.setattr(view_folders, "MOST_VIEWS", 2)
    with pytest.raises(BadFile, match=r"poses\.csv: these are more than 2 views\. Leave views out\."):
        read_views(folder)


@pytest.mark.skipif(not Path("/dev/zero").is_char_device(), reason="there are no devices here")
def test_links_to_a_device_are_refused(folder: Path) -> None:
    for name in ("depth/0001.png", "poses.csv"):
        path = folder / name
        path.unlink()
        path.symlink_to("/dev/zero")
        with pytest.raises(BadFile, match=r"0001\.png: this is a device|poses\.csv: a table of poses is a small CSV"):
            read_views(folder)
