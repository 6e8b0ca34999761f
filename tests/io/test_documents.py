"""JSON and TOML files as Windows editors save them, and those that are something else: one clear error each."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from steelyard.errors import BadInput
from steelyard.io import read_result
from steelyard.io.object_folders import read_truth
from steelyard.io.recordings.description import read_object_pose
from steelyard.io.view_folders import read_views

POSE = "pose_in_sensor = { position = [0, 0, 1], rotation = [1,0,0, 0,1,0, 0,0,1] }"
BODY = {"mass_kg": 1.0, "com_m": [0, 0, 0], "inertia_com_kgm2": np.eye(3).tolist()}
FACTS = {
    "mass_kg": 1.0, "com_mesh_m": [0, 0, 0], "inertia_com_mesh_kgm2": np.eye(3).tolist(),
    "T_mesh_from_grasp": np.eye(4).tolist(), "reference_extents_sensor_m": [1, 1, 1],
}  # fmt: skip
CAMERA = {"width": 8, "height": 8, "fx": 8, "fy": 8, "cx": 4, "cy": 4, "depth_unit_m": 0.001}
FILES = {
    "result.json": json.dumps(BODY),
    "truth.json": json.dumps(FACTS),
    "object.toml": f"[object]\n{POSE}\n",
    "camera.json": json.dumps(CAMERA),
    "table.json": json.dumps({"normal": [0, 0, 1], "offset_m": 0.0}),
    "poses.csv": "name,x,y,z,qw,qx,qy,qz\na,0,0,1,0,1,0,0\n",
}
READ: dict[str, Callable[[Path], object]] = {
    "result.json": lambda d: read_result(d / "result.json"),
    "truth.json": lambda d: read_truth(d / "truth.json"),
    "object.toml": lambda d: read_object_pose(str(d / "object.toml")),
    "camera.json": read_views,
    "table.json": read_views,
    "poses.csv": read_views,
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    (tmp_path / "depth").mkdir()
    Image.fromarray(np.full((8, 8), 900, np.uint16)).save(tmp_path / "depth" / "a.png")
    return tmp_path


@pytest.mark.parametrize("name", FILES)
def test_the_mark_of_windows_editors_is_passed_over(folder: Path, name: str) -> None:
    (folder / name).write_text(FILES[name], encoding="utf-8-sig")
    READ[name](folder)


WHAT = {
    "result.json": ("not a Steelyard result", "Write one with: steelyard identify LOG -o FILE."),
    "truth.json": ("not the truth of an object", f"It needs {', '.join(FACTS)}."),
    "camera.json": ("not the camera of views", f"It needs {', '.join(CAMERA)}."),
    "table.json": ("not the table of views", "It needs normal, offset_m."),
}


def said_of_depth(text: str) -> str:
    """Return what Python says of brackets that nest too deep."""
    with pytest.raises(RecursionError) as caught:
        json.loads(text)
    return str(caught.value)


DEEP = "[" * 100_000


@pytest.mark.parametrize("name", WHAT)
@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"\xff\xfe\x00", "a binary file, where JSON was expected."),
        (DEEP.encode(), f"not valid JSON ({said_of_depth(DEEP)})."),
        (b"[]", "expected one JSON object."),
    ],
    ids=["binary", "deep", "list"],
)
def test_what_is_no_object_of_json_is_named(folder: Path, name: str, content: bytes, said: str) -> None:
    (folder / name).write_bytes(content)
    with pytest.raises(BadInput) as caught:
        READ[name](folder)
    what, hint = WHAT[name]
    assert str(caught.value) == f"{folder / name}: {what}: {said} {hint}"


@pytest.mark.parametrize("name", WHAT)
def test_a_number_of_thousands_of_digits_is_no_traceback(folder: Path, name: str) -> None:
    for digits in (400, 5000):
        key = next(iter(json.loads(FILES[name])))
        (folder / name).write_text(json.dumps(json.loads(FILES[name]) | {key: "long"}).replace('"long"', "1" * digits))
        with pytest.raises(BadInput):
            READ[name](folder)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"\xff\xfe\x00", "DIR/object.toml: expected a TOML text in UTF-8; found a binary file."),
        (b"a = " + b"[" * 100_000, "DIR/object.toml: not valid TOML: maximum recursion depth exceeded"),
    ],
    ids=["binary", "deep"],
)
def test_what_is_no_toml_is_named(folder: Path, content: bytes, said: str) -> None:
    (folder / "object.toml").write_bytes(content)
    with pytest.raises(BadInput) as caught:
        READ["object.toml"](folder)
    text = str(caught.value).replace(str(folder), "DIR")
    assert text.startswith(f"pose in sensor: {said}")
    assert " Give a TOML file with [object], or { position" in text
