"""Tools bent of sheet: the thickness of their wall, and what it says where walls and gaps are both narrow."""

from __future__ import annotations

import numpy as np
import pytest

from steelyard.evaluate.solids import score, true_solid
from steelyard.shape import filling
from steelyard.shape.cells.complex import Complex
from steelyard.shape.cloud import Cloud
from steelyard.shape.orient import Oriented, oriented
from steelyard.shape.points.spacing import Neighbours
from steelyard.shape.sides.sheets import sheet_planes
from steelyard.shape.sides.tree import Tree
from steelyard.shape.sides.walls import Wall
from steelyard.shape.volume import enclose
from steelyard.workshop.catalogue import build
from steelyard.workshop.sampling import spread_evenly, surface_cloud
from steelyard.workshop.sheets import channel, sheet_of
from steelyard.workshop.solids import block
from steelyard.workshop.tools import Tool

THIN, WIDE = 1.4, 5.0
Drawn = tuple[np.ndarray, np.ndarray, np.ndarray, Wall | None]


def drawn(body: object, turned: float = 1.0) -> Drawn:
    """Return points [mm] of a body, their true normals, planes through them and the wall found with those normals."""
    mesh = sheet_of("a body", body, np.random.default_rng(0), 10).mesh
    xyz, normals, _ = spread_evenly(mesh, np.random.default_rng(0), 2000)
    xyz = 1e3 * xyz
    near, complex = Neighbours.of(xyz), Complex.of(xyz, Tree.of(xyz).order)
    planes, link = sheet_planes(xyz, near.index)
    wall = Wall.of(xyz, turned * normals, planes, link, complex, near.spacing)
    return xyz, normals, planes, wall


@pytest.fixture(scope="module")
def grip() -> Tool:
    return build("vise-grip")


def test_a_channel_has_the_thickness_of_its_wall() -> None:
    wall = drawn(channel(150, WIDE, 20, THIN))[3]
    assert wall is not None
    assert wall.thickness == pytest.approx(THIN, abs=0.3)


def test_edges_across_a_wall_know_its_sides() -> None:
    _, normals, planes, wall = drawn(channel(150, WIDE, 20, THIN))
    assert wall is not None
    told, asked = wall.outward(planes), (planes * normals).sum(1)
    sure = (told != 0) & (np.abs(asked) > 0.8)
    assert sure.mean() > 0.6
    assert (told[sure] * asked[sure] > 0).mean() > 0.98
    assert np.allclose(wall.outward(-planes), -told)


def test_a_block_has_no_wall() -> None:
    assert drawn(block((0, 60), (0, 40), (0, 30)))[3] is None


def test_a_slot_between_thick_plates_is_no_wall() -> None:
    slot = block((0, 100), (0, 12), (0, 25)) - block((-1, 101), (5.3, 6.7), (4, 26))
    assert drawn(slot)[3] is None
    mistaken = drawn(slot, turned=-1.0)[3]  # its sides taken for one another, it is one
    assert mistaken is not None
    assert mistaken.thickness == pytest.approx(1.4, abs=0.3)


@pytest.mark.parametrize(("noise_mm", "iou"), [(0.0, 0.58), (0.3, 0.5)])
def test_handles_of_thin_sheet_are_not_filled(grip: Tool, noise_mm: float, iou: float) -> None:
    cloud = surface_cloud(grip)
    noise = 1e-3 * noise_mm * np.random.default_rng(0).normal(size=cloud.xyz.shape)
    solid = enclose(Cloud(cloud.xyz + noise))
    found = score(solid.mesh, true_solid(grip.mesh, 50_000))
    assert 0.95 < found.volume_ratio < 1.1
    assert found.iou > iou
    assert "thin-thickened" in {finding.code for finding in solid.findings}


def test_what_is_clear_is_not_looked_at_again(monkeypatch: pytest.MonkeyPatch) -> None:
    def never(surface: Oriented) -> Oriented:
        raise AssertionError

    monkeypatch.setattr(Oriented, "walled", never)
    made = sheet_of("a channel", channel(100, 12, 15, 2), np.random.default_rng(0), 1500)
    enclose(made.cloud)


def test_a_thickness_that_empties_the_tool_is_not_believed(grip: Tool, monkeypatch: pytest.MonkeyPatch) -> None:
    cloud = Cloud(surface_cloud(grip).xyz)
    thin = enclose(cloud)
    monkeypatch.setattr(filling, "_LEFT", 0.99)
    kept = enclose(cloud)
    monkeypatch.setattr(Oriented, "walled", lambda surface: None)
    without = enclose(cloud)
    assert thin.mesh.volume < 0.9 * kept.mesh.volume
    assert (kept.mesh.volume, kept.volume_std) == (without.mesh.volume, without.volume_std)


def test_normals_found_again_are_unit_and_the_same_bits(grip: Tool) -> None:
    surface = oriented(Cloud(surface_cloud(grip).xyz))
    first, second = surface.walled(), surface.walled()
    assert first is not None
    assert second is not None
    assert np.array_equal(first.normals, second.normals)
    assert np.allclose(np.linalg.norm(first.normals, axis=1), 1)
