"""Borders inside thick bodies: where they are flat, they are found; where the surface does not tell, nothing is cut."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from steelyard.check import Array
from steelyard.io.shapes.parts_files import SavedParts, read_parts, write_parts
from steelyard.parts.inner_borders import cut_at_borders
from steelyard.parts.patch_winding import over_half
from steelyard.parts.pieces import cell_colours
from steelyard.parts.segment import segment
from steelyard.parts.segmentation import Segmentation
from steelyard.parts.skin import skin_of
from steelyard.shape.cloud import Cloud
from steelyard.shape.tets import TetMesh
from steelyard.shape.volume import enclose
from steelyard.spatial import Pose, Rotation

COLOURS = np.array([[200, 40, 40], [50, 60, 160], [40, 160, 60]], np.uint8)
R = 0.03


def ball(heights: list[float], normal: Array, seed: int = 0, points: int = 2000) -> Cloud:
    """Points of a ball of 30 mm in slabs, the first above the first height [m] along the normal."""
    xyz = np.random.default_rng(seed).normal(size=(points, 3))
    xyz *= R / np.linalg.norm(xyz, axis=1)[:, None]
    slab = (xyz @ normal < np.array(heights)[:, None]).sum(0)
    return Cloud(xyz, COLOURS[slab], slab)


def cap(height: float) -> float:
    """Volume of the cap of the ball above a height [m^3]."""
    return np.pi * (R - height) ** 2 * (2 * R + height) / 3


def slabs(heights: list[float]) -> Array:
    """True volumes of the slabs [m^3]."""
    return -np.diff([cap(-R), *[cap(h) for h in reversed(heights)], 0.0])[::-1]


def shares(found: Segmentation, label: Array) -> Array:
    """Share of the volume of the part that most points of each label have."""
    part = [np.bincount(found.point_part[label == k]).argmax() for k in range(label.max() + 1)]
    return found.parts.volume[part] / found.mesh.volume


def area(mesh: TetMesh) -> float:
    """Area of the boundary [m^2]."""
    a, b, c = np.moveaxis(mesh.vertices[mesh.surface], 1, 0)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


NORMALS = [np.array([0.0, 0.0, 1.0]), np.array([0.48, -0.6, 0.64])]


@pytest.mark.parametrize("normal", NORMALS)
@pytest.mark.parametrize("height", [0.0, 0.012, 0.018])
def test_a_ball_cut_at_any_height_has_parts_of_the_right_volume(height: float, normal: Array) -> None:
    cloud = ball([height], normal)
    found = segment(cloud, enclose(cloud), parts=2)
    true = slabs([height])
    np.testing.assert_allclose(shares(found, cloud.labels), true / true.sum(), rtol=0.04)
    far = np.linalg.norm(found.parts.centroid - np.outer(found.parts.centroid @ normal, normal), axis=1)
    assert far.max() < 6e-4


def test_corners_at_cuts_are_as_unsure_as_corners_of_another_part() -> None:
    """Cutting draws the border where a flat one would be: it must not make the bars of the parts smaller."""
    cloud = ball([0.0], NORMALS[0])
    found = segment(cloud, enclose(cloud), parts=2)
    assert found.inner > 0
    assert found.border_share > 1.5 * replace(found, inner=0).border_share


def test_cells_from_cap_to_cap_are_cut_at_both_borders() -> None:
    cloud = ball([0.01, -0.01], NORMALS[1])
    found = segment(cloud, enclose(cloud), parts=3)
    true = slabs([0.01, -0.01])
    np.testing.assert_allclose(shares(found, cloud.labels), true / true.sum(), rtol=0.04)


def test_parts_of_cut_cells_still_fill_the_solid_and_have_its_skin() -> None:
    cloud = ball([0.01], NORMALS[0])
    solid = enclose(cloud).mesh
    found = segment(cloud, solid, parts=2)
    assert found.inner > 0
    whole = solid.moments(np.zeros(len(solid)), 1)[0]
    np.testing.assert_allclose(found.parts.moments.sum(0), whole, rtol=1e-9, atol=1e-9 * abs(whole).max())
    assert area(found.mesh) == pytest.approx(area(solid), rel=1e-9)
    for count in (1, 2, 3):
        cut = found.cut(count)
        assert cut.parts.volume.sum() == pytest.approx(solid.volume)
        assert len(cut.hierarchy.piece) == len(cut.labels) == len(cut.mesh)
    np.testing.assert_array_equal(found.cut(2).labels, found.labels)
    np.testing.assert_array_equal(found.labels[found.nearest], found.point_part)


def test_turned_and_in_another_order_the_border_is_the_same() -> None:
    cloud = ball([0.012], NORMALS[1])
    order = np.random.default_rng(3).permutation(len(cloud))
    pose = Pose(Rotation.exp([0.7, -0.4, 1.1]), np.array([0.1, 0.2, -0.3]))
    moved = Cloud(pose.apply(cloud.xyz), cloud.rgb, cloud.labels).chosen(order)
    here, there = (segment(c, enclose(c), parts=2) for c in (cloud, moved))
    np.testing.assert_allclose(there.parts.volume, here.parts.volume, rtol=0.01)
    np.testing.assert_allclose(there.parts.centroid, pose.apply(here.parts.centroid), atol=3e-4)


def test_a_flush_patch_does_not_tell_how_deep_it_goes() -> None:
    """A disc on the face of a cube may be a plug of any depth."""
    rng = np.random.default_rng(0)
    xyz = rng.uniform(-0.025, 0.025, (3000, 3))
    xyz[np.arange(3000), rng.choice(3, 3000)] = rng.choice([-0.025, 0.025], 3000)
    disc = ((xyz[:, 2] > 0.0249) & (np.hypot(xyz[:, 0], xyz[:, 1]) < 0.012)).astype(np.int64)
    mesh = enclose(Cloud(xyz)).mesh
    assert cut_at_borders(mesh, skin_of(mesh), cell_colours(mesh, disc), disc) is None
    high = (xyz[:, 2] > 0.01).astype(np.int64)
    assert cut_at_borders(mesh, skin_of(mesh), cell_colours(mesh, high), high) is not None


def test_winding_numbers_of_half_a_ball() -> None:
    """Seen from the middle of the rim's disc a half; from the pole and far below, as of the disc."""
    turn = np.linspace(0, 2 * np.pi, 401)
    rim = np.stack([np.cos(turn), np.sin(turn), 0 * turn])
    lines, work = np.concatenate([rim[:, :-1], rim[:, 1:]]), np.empty((2, 400))
    for height in (-3.0, -1.0, -0.2, 0.0, 0.2, 1.0):
        disc = (1 - abs(height) / np.hypot(1, height)) / 2
        number = 1 - disc if height > 0 else disc
        assert over_half(lines, np.array([0.0, 0.0, height]), work) == pytest.approx(number - 0.5, abs=1e-4)


def test_a_file_of_parts_holds_the_cut_cells_and_other_cuts_of_the_tree(tmp_path: Path) -> None:
    cloud = ball([0.01, -0.01], NORMALS[0])
    found = segment(cloud, enclose(cloud), parts=3)
    write_parts(SavedParts(found.mesh, found.labels, found.rgb, found.hierarchy, found.names), tmp_path / "parts.npz")
    saved = read_parts(tmp_path / "parts.npz")
    np.testing.assert_allclose(saved.parts.moments, found.parts.moments, rtol=1e-9, atol=1e-18)
    two = found.cut(2)
    np.testing.assert_array_equal(saved.recut(two.parts.volume).labels, two.labels)
