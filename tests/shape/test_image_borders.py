"""Cameras aimed beside an object: its ends come whole where enough images hold them, and are named where not."""

from __future__ import annotations

from dataclasses import replace

import manifold3d
import numpy as np
import pytest

from steelyard.shape.carving import carved
from steelyard.shape.mesh import TriangleMesh
from steelyard.shape.scan import Scan, fuse
from steelyard.shape.scans import sight_lines
from steelyard.shape.scans.depth_images import Images
from steelyard.shape.scans.depth_images import held as held_by
from steelyard.shape.views import Intrinsics
from steelyard.shape.volume import enclose
from steelyard.simulate.scanning import scan_mesh
from steelyard.spatial import Pose

WIDE = Intrinsics(320, 240, 195.0, 195.0, 160.0, 120.0)
NARROW = replace(WIDE, fx=307.5, fy=307.5)
LONG, ACROSS = 0.3, 0.03
VOLUME = LONG * ACROSS**2


def bar() -> TriangleMesh:
    mesh = manifold3d.Manifold.cube([LONG, ACROSS, ACROSS]).translate([-LONG / 2, -ACROSS / 2, 0]).to_mesh64()
    red = np.tile(np.array([200, 40, 40], np.uint8), (len(mesh.tri_verts), 1))
    return TriangleMesh(mesh.vert_properties[:, :3], mesh.tri_verts, np.zeros(len(red)), red)


def aimed(lens: Intrinsics, aside: float, distance: float) -> Scan:
    """Return the scan of a bar along x by cameras that look so far beside its middle."""
    made = scan_mesh(
        bar(), 1, count=36, intrinsics=lens, X_WO=Pose.identity(), aim=(-aside, 0, 0.01), distance=distance
    )
    return fuse(made.views)


def missing(scan: Scan) -> float:
    return LONG - float(np.ptp(scan.cloud.xyz[:, 0]))


@pytest.mark.parametrize(
    ("lens", "aside", "distance"), [(WIDE, 0.10, 0.28), (WIDE, 0.05, 0.28), (NARROW, 0.0, 0.28), (NARROW, 0.05, 0.36)]
)
def test_a_bar_that_many_images_cut_off_comes_whole_where_half_of_them_hold_its_end(
    lens: Intrinsics, aside: float, distance: float
) -> None:
    scan = aimed(lens, aside, distance)
    assert missing(scan) < 0.007
    assert 0.95 < carved(enclose(scan.cloud), scan.space).mesh.volume / VOLUME < 1.05
    assert scan.findings == ()


@pytest.mark.parametrize(("aside", "distance"), [(0.10, 0.28), (0.0, 0.2), (0.05, 0.2)])
def test_an_end_that_too_few_images_hold_is_named(aside: float, distance: float) -> None:
    scan = aimed(NARROW, aside, distance)
    assert missing(scan) > 0.006
    assert "object-cut" in {finding.code for finding in scan.findings}


def looks() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return rotations and positions of cameras, and points before and behind them."""
    rng = np.random.default_rng(0)
    R = np.linalg.qr(rng.normal(size=(20, 3, 3)))[0]
    return R * np.linalg.det(R)[:, None, None], rng.normal(size=(20, 3)), rng.normal(size=(50, 3))


def test_images_hold_the_points_that_fall_on_their_pixels_as_densely_as_areas_shrink() -> None:
    R, p, points = looks()
    held = held_by(Images(np.zeros((len(R), WIDE.height, WIDE.width), np.uint16), 0.001, WIDE.vector, R, p), points)
    edge = 1e-5
    counts, density = np.zeros(len(points)), np.zeros(len(points))
    for turn, eye in zip(R, p, strict=True):
        corners = points[:, None] + edge * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
        x, y, z = np.moveaxis((corners - eye) @ turn, -1, 0)
        pixel = np.stack([WIDE.cx + WIDE.fx * x / z, WIDE.cy + WIDE.fy * y / z], axis=-1)
        u, v = np.floor(pixel[:, 0] + 0.5).T
        inside = (z[:, 0] > 0) & (u >= 0) & (u < WIDE.width) & (v >= 0) & (v < WIDE.height)
        one, other = np.moveaxis(pixel[:, 1:] - pixel[:, :1], 1, 0)
        area = np.abs(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]) / edge**2
        counts, density = counts + inside, density + np.where(inside, area, 0)
    assert counts.max() > 2
    assert np.array_equal(held[:, 0], counts)
    assert held[:, 1] == pytest.approx(density, rel=1e-2)


def test_a_wall_is_measured_at_its_spots_and_seen_past_before_them() -> None:
    lens, noise = WIDE, 0.001
    wall = np.full((1, lens.height, lens.width), 1000, np.uint16)
    spots = np.array([[0, 0, 1.0], [0.1, 0.1, 0.999], [0, 0, 0.9], [0, 0, 1.1], [5, 0, 1], [0, 0, -1]])
    found = sight_lines.sights(Images(wall, 0.001, lens.vector, np.eye(3)[None], np.zeros((1, 3))), spots, noise)
    assert found.tolist() == [[0, 1], [0, 1], [1, 0], [0, 0], [0, 0], [0, 0]]
