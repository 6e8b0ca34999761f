"""Views that others contradict, tables that are small, and sides that nobody saw."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from steelyard.errors import BadValue
from steelyard.shape.carving import carved
from steelyard.shape.cloud import Cloud
from steelyard.shape.scan import fuse
from steelyard.shape.scans.depth_images import Images, height_map
from steelyard.shape.scans.grid import Grid
from steelyard.shape.scans.region import Region, bare_share
from steelyard.shape.scans.scene import scene_of
from steelyard.shape.scans.table_plane import leveller, table_over_floor
from steelyard.shape.views import Intrinsics, TablePlane, Views
from steelyard.shape.volume import enclose
from steelyard.spatial import Pose, Rotation

LENS = Intrinsics(160, 120, 150.0, 150.0, 79.5, 59.5)
PLATE = np.array([[-0.07, -0.04, 0.0], [0.07, 0.04, 0.012]])
FAR = 0.3  # of the cameras [m]


def seen_from(elevations: tuple[float, ...], around: int, half: float = 1.0, floor: float | None = None) -> Views:
    """Return views of a plate on a table of 2 `half` [m] that lies over a floor, without noise, depth to 0.1 mm."""
    height, angle = np.radians(np.repeat(elevations, around)), np.arange(len(elevations) * around) * 2 * np.pi / around
    z = -np.stack([np.cos(height) * np.cos(angle), np.cos(height) * np.sin(angle), np.sin(height)], 1)
    x = np.stack([np.sin(angle), -np.cos(angle), 0 * angle], 1)
    R, p = np.stack([x, np.cross(z, x), z], 2), -FAR * z
    u, v = np.meshgrid(np.arange(LENS.width), np.arange(LENS.height))
    pixels = np.stack([(u - LENS.cx) / LENS.fx, (v - LENS.cy) / LENS.fy, np.ones(u.shape)], -1)
    way, eye = np.einsum("vij,hwj->vhwi", R, pixels), p[:, None, None]
    a, b = (PLATE[0] - eye) / way, (PLATE[1] - eye) / way
    near, far = np.minimum(a, b).max(-1), np.maximum(a, b).min(-1)
    table, under = (np.where(way[..., 2] < 0, (z0 - eye[..., 2]) / way[..., 2], 0.0) for z0 in (0.0, floor or 0.0))
    on = (np.abs(eye + table[..., None] * way)[..., :2] < half).all(-1)
    depth = np.where(near < far, near, np.where(on, table, under if floor else 0.0))
    depth = np.where((depth > 0) & (depth < 3), depth, 0)
    names = tuple(f"view{k}" for k in range(len(p)))
    steps = np.rint(1e4 * depth).astype(np.uint16)
    return Views(steps, None, LENS, Pose(Rotation(R), p), 1e-4, None, names)


@pytest.fixture(scope="module")
def views() -> Views:
    return seen_from((30, 55), 10)


def exchanged(views: Views, *rows: int) -> Views:
    """Return views in which poses of rows (2,) are those of each other."""
    order = np.arange(len(views))
    order[list(rows)] = rows[::-1]
    return views.posed(views.X_WC[order])


@pytest.mark.parametrize("rows", [(2, 4), (3, 16)], ids=["one height", "two heights"])
def test_views_whose_poses_are_exchanged_are_left_out_and_named(views: Views, rows: tuple[int, int]) -> None:
    others = views.chosen([k for k in range(len(views)) if k not in rows])
    scan, sound = fuse(exchanged(views, *rows)), fuse(others)
    assert [finding.code for finding in scan.findings] == ["views-disagree"]
    assert f"2 views (view{rows[0]}, view{rows[1]})" in scan.findings[0].message
    assert np.array_equal(scan.cloud.xyz, sound.cloud.xyz)


def test_views_that_agree_all_stay(views: Views) -> None:
    scan = fuse(views)
    assert (scan.views, scan.findings) == (len(views), ())


def test_a_view_that_is_a_few_millimetres_off_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    """As one of 24 is where an arm is off by 1 mm and its hand by 0.2 degrees: it sees past the ends of thin things."""
    monkeypatch.setitem(globals(), "PLATE", np.array([[-0.06, -0.01, 0.0], [0.06, 0.01, 0.06]]))
    views = seen_from((30, 55), 10)
    place = views.X_WC.position.copy()
    place[4, :2] += 0.004
    assert fuse(views.posed(Pose(views.X_WC.rotation, place))).views == len(views)


def test_a_small_table_over_a_floor_that_shows_more_is_the_table() -> None:
    scan = fuse(seen_from((30, 55), 10, half=0.12, floor=-0.6))
    assert abs(scan.table.offset) < 1e-3
    assert np.ptp(scan.cloud.xyz, axis=0) == pytest.approx(PLATE[1] - PLATE[0], abs=0.01)


def test_a_floor_is_the_table_where_the_cameras_look_at_what_stands_on_it() -> None:
    x = np.random.default_rng(0).uniform(-1, 1, (3000, 3))
    floor, table = x * np.array([1, 1, 0]), x[:600] * np.array([0.1, 0.1, 0]) + np.array([0, 0, 0.5])
    cameras, both = np.array([[0.3, 0, 0.9], [-0.3, 0, 0.9]]), np.concatenate([floor, table])
    for looks, height, under in ((0.5, 0.5, 0.5), (0.1, 0.0, np.inf)):
        found, step = table_over_floor(both, cameras, np.array([0, 0, looks]), 0.5)
        assert (found.offset, step) == pytest.approx((height, under), abs=1e-6)


def test_a_table_goes_on_around_what_stands_on_it(views: Views) -> None:
    """Of a face that is taken for the table hardly anything lies beside what stands out of it."""
    grid = Grid.about_origin(20, 0.004)
    mask, stands = np.zeros((2, *grid.shape), bool)
    mask[10:30, 10:30], stands[13:27, 13:27] = True, True
    stands[18:22, 18:22] = False  # a hollow in it, which is no part of the brim
    region = Region(grid, mask, stands, 0.05, 0, False)
    around = grid.spots(mask & ~stands)
    one_side = around[around[:, 0] > 0.03]
    on_it = replace(scene_of(views), noise=1e-3)
    assert [bare_share(on_it, table, region) for table in (around, one_side[:0])] == [1.0, 0.0]
    assert 0.1 < bare_share(on_it, one_side, region) < 0.45


@pytest.mark.parametrize("given", [True, False])
def test_what_hangs_over_the_edge_of_a_table_by_most_of_it(monkeypatch: pytest.MonkeyPatch, given: bool) -> None:
    """The table is bare around a third of it alone, and so is a face of an object."""
    monkeypatch.setitem(globals(), "PLATE", np.array([[0.02, -0.01, 0.0], [0.15, 0.01, 0.015]]))
    views = seen_from((30, 55), 10, half=0.05, floor=-0.6)
    scan = fuse(replace(views, table=TablePlane(np.array([0, 0, 1.0]), 0.0)) if given else views)
    assert scan.findings == ()
    assert carved(enclose(scan.cloud, one=True), scan.space).mesh.volume == pytest.approx(39e-6, rel=0.05)


def test_a_floor_far_below_a_table_that_is_given_does_not_level_the_views() -> None:
    x = np.random.default_rng(0).uniform(-1, 1, (3000, 3))
    floor, table = x * np.array([1, 1, 0]), x[:600] * np.array([0.1, 0.1, 0]) + np.array([0, 0, 0.5])
    cameras, given = np.array([[0.3, 0, 0.9], [-0.3, 0, 0.9]]), TablePlane(np.array([0, 0, 1.0]), 0.5)
    for distance, height, under in ((0.5, 0.5, 0.5), (1.0, 0.0, np.inf)):
        found, step = leveller(np.concatenate([floor, table]), cameras, distance, given)
        assert (found.offset, step) == pytest.approx((height, under), abs=1e-6)


def test_the_side_of_a_table_is_no_height_at_its_edge() -> None:
    """A thin thing that lies across the edge was cut in two there: one pixel in three shows the side below it."""
    depth, down = np.array([[[1000, 1000, 1200]]], np.uint16), np.diag([1.0, -1.0, -1.0])
    images = Images(depth, 1e-3, np.array([1e3, 1e3, 1.0, 0.0]), down[None], np.array([[0.0, 0.0, 1.01]]))
    count, height, highest = height_map(images, 1, np.array([-1.0, -1.0]), 2.0, -0.02, 0.02, 1, 1)[0, 0]
    assert (count, height / count, highest) == pytest.approx((2, 0.01, 0.01))


def test_points_of_one_object_stay_one_where_its_sides_were_not_seen() -> None:
    """Top and underside of a box 60 mm high: of a bare cloud one of them alone would stay."""
    x, y = np.meshgrid(np.linspace(-0.05, 0.05, 26), np.linspace(-0.035, 0.035, 18))
    face = np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()])
    xyz = np.concatenate([face + np.array([0, 0, 0.06]), face])
    cloud = Cloud(xyz, None, None, np.repeat([[0, 0, 1.0], [0, 0, -1.0]], len(face), 0))
    with pytest.raises(BadValue, match="in a plane"):
        enclose(cloud)
    whole = enclose(cloud, one=True)
    assert whole.mesh.volume == pytest.approx(4.2e-4, rel=0.02)
    assert "several-objects" not in {finding.code for finding in whole.findings}


def test_a_name_for_each_view(views: Views) -> None:
    assert views.chosen([3, 5]).names == ("view3", "view5")
    with pytest.raises(BadValue, match="20 views need as many names; got 2"):
        replace(views, names=("a", "b"))
