"""View folders: what is written is read again; each wrong file has its one sentence."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from steelyard.errors import BadFile
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


def camera(**change: object) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        path = folder / "camera.json"
        path.write_text(json.dumps(json.loads(path.read_text()) | change))

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
    ("no lens", camera(fx=0), "fx must be a focal length"),
    ("centre outside", camera(cx=99), "cx must lie inside the image"),
    ("not a number", camera(fy="wide"), '"fy" must be a finite number'),
    ("kilometres", camera(depth_unit_m=0.9), "puts the scene"),
    ("no camera", lambda f: (f / "camera.json").unlink(), "this file is missing"),
    ("no poses", lambda f: (f / "poses.csv").unlink(), "this file is missing"),
    ("long quaternion", pose("qw", "3"), "must have length 1"),
    ("nan", pose("x", "nan"), "line 3 holds NaN"),
    ("word", pose("x", "here"), 'expected a number; found "here"'),
    ("leaves the folder", pose("name", "../../etc/passwd"), "is no name of a view"),
    ("twice", pose("name", "0000"), "named 2 times"),
    ("bad table", lambda f: (f / "table.json").write_text('{"normal": [0, 0, 2], "offset_m": 0}'), "unit vector"),
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
