"""From a folder of images to a weighed object, by the commands alone: scan, segment, report."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from steelyard.cli.main import main
from steelyard.io.cloud_files import read_cloud
from steelyard.io.view_folders import write_views
from steelyard.shape.views import Intrinsics
from steelyard.simulate.scanning import scan_mesh
from steelyard.workshop.catalogue import build
from steelyard.workshop.finish import painted

pytest.importorskip("PIL")
CAMERA = Intrinsics(320, 240, 307.5, 307.5, 160.0, 120.0)


@pytest.fixture(scope="module")
def views(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("scan") / "views"
    write_views(scan_mesh(painted(build("rubber-mallet")), 0, count=40, intrinsics=CAMERA).views, folder)
    return folder


def run(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as end:
        main([str(argument) for argument in arguments])
    seen = capsys.readouterr()
    return int(end.value.code or 0), seen.out, seen.err


def test_views_become_a_cloud_and_the_cloud_parts(capsys: pytest.CaptureFixture[str], views: Path) -> None:
    cloud, parts = views.parent / "cloud.ply", views.parent / "parts.npz"
    status, out, _ = run(capsys, "scan", views, "-o", cloud, "--json")
    told = json.loads(out)
    assert status == 0
    assert told["views"] == 40
    assert told["points"] == len(read_cloud(cloud))
    assert told["points"] > told["seen_points"]  # the underside is closed
    assert set(told["stages"])
    assert told["cpu_s"] > 0
    assert (told["place_std"], told["camera_off_at_wrist"]) == (None, None)

    status, out, _ = run(capsys, "segment", cloud, "-o", parts, "--json")
    found = json.loads(out)
    assert status == 0
    true = float(np.sum(build("rubber-mallet").parts.volume))
    assert found["volume_m3"] == pytest.approx(true, rel=0.12)
    assert sum(part["volume_m3"] for part in found["parts"]) == pytest.approx(found["volume_m3"])
    assert parts.is_file()


def test_zero_has_no_sign(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    run(capsys, "workshop", "build", tmp_path, "--tools", "hammer")
    _, out, _ = run(capsys, "segment", tmp_path / "hammer" / "points.npz")
    assert " 0.0 " in out
    assert " -0.0 " not in out


def test_a_cloud_is_said_to_lie_in_the_frame_of_its_views(capsys: pytest.CaptureFixture[str], views: Path) -> None:
    cloud, place = views.parent / "said.ply", views / "object.toml"
    _, out, _ = run(capsys, "scan", views, "-o", cloud, "--points", 600)
    assert "It lies in W of the views, not in a mesh's frame.\n" in out
    assert "Try:" not in out
    place.write_text("[object]\n")
    try:
        _, out, _ = run(capsys, "scan", views, "-o", cloud, "--points", 600)
    finally:
        place.unlink()
    assert f"Try: steelyard identify log.toml --scan {cloud} --pose-in-sensor {place}\n" in out


def test_tables_for_people_say_what_was_written(capsys: pytest.CaptureFixture[str], views: Path) -> None:
    cloud = views.parent / "again.npz"
    status, out, _ = run(capsys, "scan", views, "-o", cloud, "--points", 600)
    assert status == 0
    assert f"Cloud written to {cloud}." in out
    assert "40, poses as reported" in out
    status, out, _ = run(capsys, "segment", cloud, "--parts", 2)
    assert status == 0
    assert "in 2 parts" in out


def test_a_cloud_that_encloses_nothing_is_named(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    flat = np.random.default_rng(0).uniform(0, 0.2, (2000, 3)) * [1, 1, 0]
    np.savez(tmp_path / "flat.npz", xyz=flat)
    status, _, err = run(capsys, "segment", tmp_path / "flat.npz")
    assert status == 2
    assert err.endswith(f"steelyard: {tmp_path}/flat.npz: all 2000 points lie in a plane, which encloses nothing. "
                        "Scan the object from more sides.\n")  # fmt: skip


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("scan", "@", "-o", "@/cloud.obj"), "a cloud is written as .ply or .npz"),
        (("scan", "@/nothing"), "nothing"),
        (("segment", "@/cloud.xyz"), "no such file"),
        (("segment", "@", "-o", "@/parts.json"), "a solid in parts is written as .npz"),
    ],
)
def test_wrong_calls_write_nothing(
    capsys: pytest.CaptureFixture[str], views: Path, arguments: tuple[str, ...], message: str
) -> None:
    before = sorted(path.name for path in views.iterdir())
    status, out, err = run(capsys, *(argument.replace("@", str(views)) for argument in arguments))
    assert (status, out) == (2, "")
    assert message in err
    assert err.startswith("steelyard: ")
    assert sorted(path.name for path in views.iterdir()) == before
