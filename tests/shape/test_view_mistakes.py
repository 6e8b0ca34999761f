"""Views that are described wrongly: one error, which names the mistake and the key or column to change."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import manifold3d
import numpy as np
import pytest

from steelyard.errors import CannotAnswer
from steelyard.shape.mesh import TriangleMesh
from steelyard.shape.scan import fuse
from steelyard.shape.scans.pose_scale import pose_scale
from steelyard.shape.scans.view_mistakes import likely_mistake
from steelyard.shape.views import Intrinsics, TablePlane, Views
from steelyard.simulate.scanning import scan_mesh
from steelyard.spatial import Pose, Rotation

SMALL = Intrinsics(320, 240, 307.5, 307.5, 160.0, 120.0)
OPENGL = Rotation(np.diag([1.0, -1.0, -1.0]))
BODY = Rotation(np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]))  # x forward, y left, z up


@pytest.fixture(scope="module")
def right() -> Views:
    mesh = manifold3d.Manifold.cube((0.1, 0.06, 0.03)).to_mesh64()
    rgb = np.tile(np.array([200, 40, 40], np.uint8), (len(mesh.tri_verts), 1))
    box = TriangleMesh(mesh.vert_properties[:, :3], mesh.tri_verts, np.zeros(len(mesh.tri_verts)), rgb)
    return scan_mesh(box, 1, count=30, intrinsics=SMALL).views


def turned(views: Views, rotation: Rotation) -> Views:
    return views.posed(views.X_WC @ Pose(rotation, np.zeros(3)))


def rotated(views: Views, rotation: Rotation) -> Views:
    return views.posed(Pose(rotation, views.X_WC.position))


def moved(views: Views, factor: float) -> Views:
    return views.posed(Pose(views.X_WC.rotation, factor * views.X_WC.position))


def seen_by(views: Views, **change: float) -> Views:
    return replace(views, intrinsics=replace(SMALL, **change))  # type: ignore[arg-type]


def rolled(views: Views, by: int) -> Views:
    return rotated(views, Rotation.from_quaternion_wxyz(np.roll(views.X_WC.rotation.quaternion_wxyz(), by, -1)))


WRONG: list[tuple[str, Callable[[Views], Views], str]] = [
    ("w last", lambda v: rolled(v, -1), "read as x, y, z, w, .*: give them in the order qw, qx, qy, qz"),
    ("w named x", lambda v: rolled(v, 1), "read as w, x, y, z, .*: name them qw, qx, qy, qz"),
    ("inverted", lambda v: v.posed(v.X_WC.inverse()), "give the poses of the camera in W, not"),
    ("inverted rotation", lambda v: rotated(v, v.X_WC.rotation.inverse()), "from the camera's axes to those of W"),
    ("opengl", lambda v: turned(v, OPENGL), "not those of OpenGL"),
    ("body", lambda v: turned(v, BODY), "x right, y down, z forward, not those of the body"),
    ("upside down", lambda v: turned(v, Rotation.exp([0, 0, np.pi])), "images turned by 180 degrees, .*: give poses"),
    ("on its side", lambda v: turned(v, Rotation.exp([0, 0, np.pi / 2])), "images turned by -90 degrees, .* x right,"),
    ("millimetres", lambda v: moved(v, 1000), "divided by 1000, .*: give them in metres"),
    ("centimetres", lambda v: moved(v, 100), "divided by 100, .*: give them in metres"),
    ("a thousandth", lambda v: moved(v, 0.001), "times 1000, .*: give them in metres"),
    ("no scale", lambda v: moved(v, 3.7), r"poses times 0\.2[67]\d?, .*\(poses from images alone"),
    ("inverted, no scale", lambda v: v.posed(moved(v, 3.7).X_WC.inverse()), r"then times 0\.2[67]\d?, .*\(COLMAP"),
    ("no scale, small", lambda v: moved(v, 0.13), r"poses times 7\.[5-9]\d?, .*: give them in metres \("),
    ("depth in 0.1 mm", lambda v: replace(v, depth_unit=1e-4), '"depth_unit_m": 0.001, .*: correct it in camera.json'),
    ("depth in cm", lambda v: replace(v, depth_unit=1e-2), '"depth_unit_m": 0.001, .*: correct it in camera.json'),
    ("a lens of half the size", lambda v: seen_by(v, fx=153.75, fy=153.75, cx=80, cy=60), "fx and fy times 2 "),
    ("a lens of twice the size", lambda v: seen_by(v, fx=615, fy=615, cx=319, cy=239), "fx and fy times 0.5 "),
    ("a wide lens", lambda v: seen_by(v, fx=461, fy=461, cx=319, cy=180), "fx and fy times 0.667 "),
    ("table", lambda v: replace(v, table=TablePlane(np.array([0, 0, 1.0]), 0.5)), "Without table.json .. % would"),
]  # fmt: skip


@pytest.mark.parametrize(("wrong", "words"), [row[1:] for row in WRONG], ids=[row[0] for row in WRONG])
def test_the_mistake_is_named(right: Views, wrong: Callable[[Views], Views], words: str) -> None:
    with pytest.raises(CannotAnswer, match=rf"^no (table|object) was found.*{words}"):
        fuse(wrong(right))


def test_the_scale_of_poses_is_found_by_depth(right: Views) -> None:
    for factor in (0.02, 0.5, 1.0, 30.0):
        assert pose_scale(moved(right, factor)) == pytest.approx(1 / factor, rel=0.03)


def test_views_that_tell_no_scale(right: Views) -> None:
    assert pose_scale(moved(right, 0.0)) is None
    assert pose_scale(moved(right, -1.0)) is None


def test_right_views_hold_no_mistake(right: Views) -> None:
    assert likely_mistake(right) == ""
    assert fuse(right).findings == ()


def test_what_no_single_mistake_explains_is_told_what_to_check(right: Views) -> None:
    with pytest.raises(
        CannotAnswer, match=r"give table\.json\. Otherwise check that the poses are those of the camera"
    ):
        fuse(right.posed(right.X_WC[::-1]))


def test_a_principal_point_that_is_off_is_among_what_to_check(right: Views) -> None:
    (found,) = fuse(seen_by(right, cx=184)).findings
    assert found.code == "surface-open"
    assert "check fx, fy, cx, cy in camera.json" in found.message
