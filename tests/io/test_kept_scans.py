"""A cloud that was written keeps what its views knew: it answers as they do, to the last bit."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import manifold3d
import numpy as np
import pytest

from steelyard.errors import BadFile, BadValue
from steelyard.findings import Finding
from steelyard.io.cloud_files import CELLS, SCAN, read_cloud, write_cloud
from steelyard.pipelines.shape_in_parts import Shape, kept, shape_of
from steelyard.shape.cloud import Cloud
from steelyard.shape.known_space import Kept, KeptSpace
from steelyard.shape.mesh import TriangleMesh
from steelyard.shape.scan import Scan, fuse
from steelyard.shape.scans.placement import Placement
from steelyard.shape.views import Intrinsics
from steelyard.simulate.scanning import scan_mesh
from steelyard.spatial import Pose

SMALL = Intrinsics(320, 240, 307.5, 307.5, 160.0, 120.0)
HALF, WALL = 0.025, 0.006


def tunnel() -> TriangleMesh:
    """Return a tube open at its ends, which lies on the table: two dozen views do not look through it."""
    solid = manifold3d.Manifold.cube((6 * HALF, 2 * HALF, 2 * HALF)).translate((-3 * HALF, -HALF, 0))
    hole = manifold3d.Manifold.cube((7 * HALF, 2 * (HALF - WALL), 2 * (HALF - WALL))).translate(
        (-3.5 * HALF, WALL - HALF, WALL)
    )
    mesh = (solid - hole).to_mesh64()
    count = len(mesh.tri_verts)
    red = np.tile(np.array([200, 40, 40], np.uint8), (count, 1))
    return TriangleMesh(mesh.vert_properties[:, :3], mesh.tri_verts, np.zeros(count), red)


@pytest.fixture(scope="module")
def scan() -> Scan:
    """Return a scan whose place is unsure and whose surface is open: what a cloud alone does not say."""
    made = fuse(scan_mesh(tunnel(), 1, count=24, intrinsics=SMALL, X_WO=Pose.identity()).views)
    return replace(made, placement=Placement(Pose.identity(), 1e-3, 2e-3, None))


def numbers(shape: Shape) -> list[np.ndarray]:
    solid, made = shape.solid, shape.segmentation.parts
    error = shape.error
    bars = np.array([solid.volume_std, error.com_m, error.stretch, error.turn_rad])
    return [solid.mesh.vertices, solid.mesh.tets, solid.sure, bars, made.moments]


@pytest.mark.parametrize("name", ["cloud.ply", "cloud.npz"])
def test_a_written_cloud_answers_as_its_views_do(scan: Scan, name: str, tmp_path: Path) -> None:
    write_cloud(kept(scan), tmp_path / name)
    seen, read = shape_of(scan), shape_of(read_cloud(tmp_path / name))
    assert "surface-open" in [finding.code for finding in seen.findings]
    assert read.findings == seen.findings
    assert read.notes == seen.notes == ()
    for one, other in zip(numbers(seen), numbers(read), strict=True):
        assert np.array_equal(one, other)


def test_without_what_it_keeps_the_same_cloud_is_another_solid(scan: Scan) -> None:
    """Else the law above would say nothing."""
    bare, seen = shape_of(scan.cloud), shape_of(scan)
    assert bare.solid.volume_std < 0.5 * seen.solid.volume_std
    assert bare.error.com_m < 0.5 * seen.error.com_m


def test_a_cloud_that_was_changed_is_no_surer_than_its_scan(scan: Scan, tmp_path: Path) -> None:
    """As after points were cut away by another program: cells are others, what was a guess stays one."""
    whole = kept(scan)
    rows = whole.xyz[:, 0] < 0.06
    write_cloud(replace(whole.chosen(rows), kept=whole.kept), tmp_path / "cut.ply")
    cut = shape_of(read_cloud(tmp_path / "cut.ply"))
    assert "not those that its scan wrote" in cut.notes[0]
    assert cut.findings[: len(scan.findings)] == scan.findings
    assert "surface-open" in [finding.code for finding in cut.findings]
    assert cut.solid.volume_std > 0.9 * shape_of(scan).solid.volume_std


def test_a_scan_that_encloses_nothing_keeps_what_it_said(scan: Scan) -> None:
    flat = replace(scan.cloud, xyz=scan.cloud.xyz * [1, 1, 0])
    saved = kept(replace(scan, cloud=flat)).kept
    assert saved is not None
    assert saved.findings == scan.findings
    assert len(saved.space.fifths) == 0


XYZ = np.random.default_rng(0).normal(size=(50, 3))
SAID = {"unseen": 0.4, "unsure_m3": 1e-7, "skin": 0.1, "place_std": [0.001, 0.002], "findings": []}


def file_of(path: Path, said: object = SAID, cells: object = (0, 5), **arrays: object) -> Path:
    text = said if isinstance(said, bytes) else json.dumps(said).encode()
    kinds = {SCAN: np.frombuffer(text, np.uint8), CELLS: np.array(cells, np.uint8), **arrays}
    np.savez(path, xyz=XYZ, **{name: values for name, values in kinds.items() if values is not None})  # type: ignore[arg-type]
    return path


def finding(**change: object) -> dict[str, object]:
    return SAID | {"findings": [Finding.of("surface-open", "Open.").plain() | change]}


def test_what_a_file_keeps_is_read(tmp_path: Path) -> None:
    found = read_cloud(file_of(tmp_path / "cloud.npz", finding())).kept
    assert found is not None
    assert found.place_std == (0.001, 0.002)
    assert found.findings == (Finding.of("surface-open", "Open."),)
    assert (found.space.unseen, found.space.unsure_m3, found.space.skin) == (0.4, 1e-7, 0.1)
    assert found.space.fifths.tolist() == [0, 5]
    assert read_cloud(file_of(tmp_path / "half.npz", **{CELLS: None})).kept is None


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"said": b"{"}, '"scan" is not what'),
        ({"said": b"[" * 50_000}, '"scan" is not what'),
        ({"said": b" " * 100_001}, "100001 bytes"),
        ({"said": [1, 2]}, '"scan" is not what'),
        ({"said": {"unseen": 0.4}}, '"scan" is not what'),
        ({"said": SAID | {"place_std": [0.1]}}, '"scan" is not what'),
        ({"said": SAID | {"place_std": [0.1, -1]}}, "place_std"),
        ({"said": SAID | {"skin": 1.5}}, "shares of 1"),
        ({"said": SAID | {"skin": 10**400}}, '"scan" is not what'),
        ({"said": finding(code=["surface-open"])}, '"scan" is not what'),
        ({"said": SAID | {"place_std": [float("nan"), 0]}}, "place_std"),
        ({"said": SAID | {"unsure_m3": float("nan")}}, "unsure_m3"),
        ({"said": finding(code="all-is-well")}, "all-is-well"),
        ({"said": finding(message="\x1b[2J")}, '"scan" is not what'),
        ({"said": finding(message=3)}, '"scan" is not what'),
        ({"said": SAID | {"findings": 3}}, '"scan" is not what'),
        ({"cells": [0, 6]}, "fifths"),
        ({CELLS: np.array([0.0, 1.0])}, '"cell_emptied" must be bytes'),
        ({SCAN: np.zeros((2, 2), np.uint8)}, '"scan" must be bytes'),
    ],
)  # fmt: skip
def test_what_no_scan_wrote_is_refused_by_name(change: dict[str, object], message: str, tmp_path: Path) -> None:
    path = file_of(tmp_path / "cloud.npz", **change)  # type: ignore[arg-type]
    with pytest.raises(BadFile, match=message) as refused:
        read_cloud(path)
    assert str(path) in str(refused.value)


def test_only_the_same_cells_fit() -> None:
    with pytest.raises(BadValue, match="fifths"):
        KeptSpace(0.1, fifths=np.array([0.5]))
    assert not KeptSpace(0.1).fits(None)
    assert Cloud(XYZ, kept=Kept((), KeptSpace(0.1))).in_frame(Pose.identity()).kept is not None
