"""Views whose poses are clearly off: the table and what stands on it tell how."""

from __future__ import annotations

import re

import manifold3d
import numpy as np
import pytest
from tools_seen import HAND_EYE, askew, right_volume, seen, volume

from steelyard.shape import scan
from steelyard.shape.mesh import TriangleMesh
from steelyard.shape.scan import fuse
from steelyard.shape.scans import common_table
from steelyard.shape.scans.common_table import levelled, slid
from steelyard.shape.scans.scene import Scene, scene_of
from steelyard.shape.scans.view_planes import lowest_planes
from steelyard.shape.views import Views
from steelyard.simulate.camera import disturbed
from steelyard.simulate.scanning import Scanned, scan_mesh
from steelyard.spatial import Pose, Rotation


def apart(scene: Scene, true: Pose) -> tuple[float, float, float]:
    """Return how far the views are apart: along the table and over it [m], and in tilt [rad], rms about their mean."""
    error = Pose(Rotation.nearest(scene.R), scene.p) @ (scene.X_WT.inverse() @ true).inverse()
    place, turn = error.position - error.position.mean(0), error.rotation.log() - error.rotation.log().mean(0)
    return tuple(float(np.sqrt((x**2).sum(1).mean())) for x in (place[:, :2], place[:, 2:], turn[:, :2]))  # type: ignore[return-value]


def wrong_by(views: Views, kind: str) -> Views:
    if kind == "hand-eye":
        return views.posed(views.X_WC @ HAND_EYE)
    return views.posed(disturbed(views.X_WC, 4.0, 1.0, np.random.default_rng(1)))


@pytest.mark.parametrize("kind", ["each", "hand-eye"])
def test_the_table_tells_height_and_tilt_of_every_view(kind: str) -> None:
    scene = scene_of(wrong_by(seen().views, kind))
    true = seen().views.X_WC
    before = apart(scene, true)
    assert before[1] > 1e-3
    assert levelled(scene) > 1e-3
    _, over, tilt = apart(scene, true)
    assert over < 1e-4
    assert tilt < np.radians(0.05)


def test_what_stands_on_the_table_tells_the_rest_from_afar() -> None:
    scene = scene_of(wrong_by(seen().views, "each"))
    true = seen().views.X_WC
    levelled(scene)
    assert apart(scene, true)[0] > 5e-3
    slid(scene)
    assert apart(scene, true)[0] < 2.5e-3


def test_right_poses_are_left_alone() -> None:
    scene = scene_of(seen().views)
    R, p = scene.R.copy(), scene.p.copy()
    assert levelled(scene) == 0.0
    np.testing.assert_array_equal(scene.R, R)
    np.testing.assert_array_equal(scene.p, p)


def test_too_few_tables_tell_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """That is not a level one: a lens with which views lose the table is not a better one."""
    scene = scene_of(wrong_by(seen().views, "each"))
    R, half = scene.R.copy(), lambda scene, tables=common_table._tables: tables(scene)[::2]
    monkeypatch.setattr(common_table, "_tables", half)
    assert levelled(scene) is None
    np.testing.assert_array_equal(scene.R, R)


def plate(size: tuple[float, float, float], count: int = 36, distance: float | None = None) -> Scanned:
    cube = manifold3d.Manifold.cube(np.array(size)).translate(np.array([-size[0] / 2, -size[1] / 2, 0])).to_mesh64()
    mesh = TriangleMesh(cube.vert_properties[:, :3], cube.tri_verts, np.zeros(len(cube.tri_verts)))
    return scan_mesh(mesh, 0, count=count, X_WO=Pose.identity(), distance=distance)


@pytest.mark.parametrize("size", [(0.2, 0.15, 0.01), (0.24, 0.17, 0.012)], ids=["wide", "wider-than-the-table-in-view"])
def test_a_wide_low_object_is_not_taken_for_the_table(size: tuple[float, float, float]) -> None:
    made = plate(size)
    found = fuse(made.views)
    assert (found.findings, found.moved_m) == ((), None)
    assert volume(found) == pytest.approx(np.prod(size), rel=0.05)
    scene = scene_of(wrong_by(made.views, "each"))
    assert 3e-3 < levelled(scene) < 8e-3
    _, over, tilt = apart(scene, made.views.X_WC)
    assert over < 1e-4
    assert tilt < np.radians(0.05)


@pytest.mark.parametrize("top", [0.0, 0.012], ids=["a-table's-edges", "a-wide-object"])
def test_of_what_lies_below_a_wide_plane_only_another_plane_is_the_table(top: float) -> None:
    """Pixels between a small table and the floor, and its sides, hang below it and lie on no plane of their own."""
    rng = np.random.default_rng(4)
    x, y = 0.15 * rng.uniform(-1, 1, (2, 4000))
    hangs = y < -0.07
    z = np.where(hangs, -0.04 * rng.random(4000) if top == 0 else 0.0, top) + rng.normal(0, 5e-4, 4000)
    sampled = np.column_stack([x, y, z, np.full(4000, 0.4), np.zeros(4000)])
    drawn = rng.random((200, 3))
    found = lowest_planes(sampled, 0.042, 0.002, np.tan(np.radians(8.0)), drawn)[0, 1:]
    at = np.array([[1.0, -0.1, 0.1], [1.0, 0.1, 0.1], [1.0, 0.0, -0.1]])
    assert np.abs(at @ found).max() < 0.004


@pytest.mark.parametrize("size", [(0.12, 0.08, 0.005), (0.12, 0.005, 0.08)], ids=["lying", "standing"])
def test_depth_noise_does_not_thicken_a_plate(size: tuple[float, float, float]) -> None:
    """Of 1 mm: what lies within it over the surface is not seen to be empty, and yet is not hidden."""
    assert volume(fuse(plate(size, 24, 0.5).views)) == pytest.approx(np.prod(size), rel=0.05)


def test_a_view_without_a_table_is_left_out_where_others_are_moved() -> None:
    views = wrong_by(seen().views, "each")
    lost = Pose(Rotation.exp(np.radians([25.0, 0.0, 0.0])), np.zeros(3))
    poses = views.X_WC.position.copy()
    turns = views.X_WC.rotation.matrix.copy()
    turns[7] = (views.X_WC[7] @ lost).rotation.matrix
    scene = scene_of(views.posed(Pose(Rotation(turns), poses)))
    levelled(scene)
    assert len(scene.R) == len(scene.views) == len(scene.p) == 35


def test_a_scan_from_poses_one_degree_off_keeps_its_volume_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Views] = []
    likely = scan.likely_mistake
    monkeypatch.setattr(scan, "likely_mistake", lambda views: asked.append(views) or likely(views))
    found = fuse(wrong_by(seen().views, "each"))
    assert [finding.code for finding in found.findings] == ["views-disagree"]
    assert "mm (rms) too high or too low" in found.findings[0].message
    assert len(asked) == 1  # each time costs as much as the scan
    assert volume(found) == pytest.approx(right_volume(), rel=0.1)


def test_a_scan_with_a_wrong_hand_eye_pose_keeps_its_volume() -> None:
    found = askew()
    assert found.moved_m is not None
    assert found.disagree < 1.6
    assert [finding.code for finding in found.findings] == ["views-disagree"]
    said = re.search(r"A camera that sits (\S+) mm and 1 degrees from where its pose at", found.findings[0].message)
    assert said is not None
    assert float(said[1]) == pytest.approx(4.7, abs=0.2)
    assert volume(found) == pytest.approx(right_volume(), rel=0.1)
