"""Scans of boxes on a table: the cloud lies on the box, poses are mended, what is wrong is said."""

from __future__ import annotations

from dataclasses import replace

import manifold3d
import numpy as np
import pytest

from steelyard.errors import BadValue, CannotAnswer
from steelyard.pipelines.shape_in_parts import shape_of
from steelyard.shape.carving import carved
from steelyard.shape.known_space import SeenSpace
from steelyard.shape.mesh import TriangleMesh
from steelyard.shape.points.thinning import spread
from steelyard.shape.scan import Scan, fuse
from steelyard.shape.scans.region import _with_its_floor
from steelyard.shape.scans.underside import Underside
from steelyard.shape.views import Intrinsics, Views
from steelyard.shape.volume import enclose
from steelyard.simulate.camera import D435, disturbed
from steelyard.simulate.scanning import Scanned, resting_pose, scan_mesh
from steelyard.spatial import Pose

SMALL = Intrinsics(320, 240, 307.5, 307.5, 160.0, 120.0)
LIES = Pose.identity()


def mesh_of(*solids: manifold3d.Manifold) -> TriangleMesh:
    mesh = manifold3d.Manifold.batch_boolean(list(solids), manifold3d.OpType.Add).to_mesh64()
    count = len(mesh.tri_verts)
    return TriangleMesh(
        mesh.vert_properties[:, :3],
        mesh.tri_verts,
        np.zeros(count),
        np.tile(np.array([200, 40, 40], np.uint8), (count, 1)),
    )


def block(x: tuple[float, float], y: tuple[float, float], z: tuple[float, float]) -> manifold3d.Manifold:
    low, high = np.array([x, y, z]).T
    return manifold3d.Manifold.cube(high - low).translate(low)


def scanned(mesh: TriangleMesh, **choices: object) -> Scanned:
    return scan_mesh(mesh, 1, count=45, intrinsics=SMALL, X_WO=LIES, **choices)  # type: ignore[arg-type]


BOX = mesh_of(block((-0.05, 0.05), (-0.03, 0.03), (0, 0.03)))
BRIDGE = mesh_of(
    block((-0.06, 0.06), (-0.015, 0.015), (0.02, 0.03)),
    block((-0.06, -0.045), (-0.015, 0.015), (0, 0.03)),
    block((0.045, 0.06), (-0.015, 0.015), (0, 0.03)),
)


@pytest.fixture(scope="module")
def box() -> Scanned:
    return scanned(BOX)


@pytest.fixture(scope="module")
def scan(box: Scanned) -> Scan:
    """The scan of the box as it is."""
    return fuse(box.views)


def off_box(xyz: np.ndarray) -> np.ndarray:
    """Signed distance to the box's surface, outside positive."""
    q = np.abs(xyz - [0, 0, 0.015]) - [0.05, 0.03, 0.015]
    return np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(1), 0)


def test_the_cloud_lies_on_the_box_and_its_normals_leave_it(scan: Scan) -> None:
    off = off_box(scan.cloud.xyz)
    assert np.abs(np.median(off)) < 1e-4
    assert np.sqrt(np.mean(off**2)) < 5e-4
    assert scan.table.normal == pytest.approx([0, 0, 1], abs=2e-3)
    assert abs(scan.table.offset) < 5e-4
    assert scan.cloud.normals is not None
    assert scan.cloud.rgb is not None
    assert (off_box(scan.cloud.xyz + 0.004 * scan.cloud.normals) > 0).mean() > 0.97
    assert (scan.cloud.rgb[:, 0] > scan.cloud.rgb[:, 1] + 50).mean() > 0.95
    assert (scan.findings, scan.moved_m) == ((), None)


def test_no_point_has_the_colour_of_the_table(scan: Scan) -> None:
    """Pixels beside the foot show the table, and the underside is lent the colour of what is nearest to it."""
    cloud = scan.cloud
    assert cloud.seen is not None
    assert cloud.rgb is not None
    below = cloud.normals[:, 2] < -0.9  # type: ignore[index]
    assert below.sum() > 100
    assert not cloud.seen[below].any()
    assert cloud.seen[~below].mean() > 0.8
    red = cloud.rgb[:, 0].astype(float) - cloud.rgb[:, 1]
    assert (red > 60).mean() > 0.995  # the box is red, the table is not


def test_views_without_colour_give_the_same_points_and_say_which_were_seen(box: Scanned, scan: Scan) -> None:
    bare = fuse(replace(box.views, rgb=None))
    np.testing.assert_array_equal(bare.cloud.xyz, scan.cloud.xyz)
    assert (bare.cloud.rgb, bare.cloud.seen.sum()) == (None, bare.seen)
    assert shape_of(bare).findings == ()


def test_the_same_views_give_the_same_cloud(box: Scanned, scan: Scan) -> None:
    assert np.array_equal(fuse(box.views).cloud.xyz, scan.cloud.xyz)


@pytest.mark.parametrize("mesh", [BOX, BRIDGE], ids=["box", "bridge"])
def test_volume_is_right_and_a_bridge_is_not_filled(mesh: TriangleMesh) -> None:
    scan = fuse(scanned(mesh).views)
    a, b, c = np.moveaxis(mesh.corners, 1, 0)
    true = np.einsum("fi,fi->f", a, np.cross(b, c)).sum() / 6
    assert 0.93 < carved(enclose(scan.cloud), scan.space).mesh.volume / true < 1.2  # filled bridge: 2.0


@pytest.mark.parametrize(("count", "few"), [(6, True), (45, False)])
def test_a_surface_of_which_few_views_show_little_is_named(count: int, few: bool) -> None:
    scan = fuse(scan_mesh(BRIDGE, 1, count=count, intrinsics=SMALL, X_WO=LIES).views)
    share = f"{100 * scan.seen / len(scan.cloud):.0f} %"
    said = [(f.code, f.message, f.remedy) for f in scan.findings]
    assert said == few * [
        (
            "surface-open",
            f"Only {share} of the points were seen, in 6 views; the rest closes what is left.",
            "Take more views, from all sides and heights: 2 must see each place of the surface.",
        )
    ]
    told = [f for f in enclose(scan.cloud).findings if f.code == "thin-thickened"]
    assert not few or told[0].message.startswith(f"Cameras saw only {share} of the points")
    assert not any("Cameras" in f.message for f in told) or few


def test_eight_views_of_a_box_are_enough_and_have_a_flat_table() -> None:
    a, b, c = np.moveaxis(BOX.corners, 1, 0)
    true = np.einsum("fi,fi->f", a, np.cross(b, c)).sum() / 6
    for seed in range(3):
        scan = fuse(scan_mesh(BOX, seed, count=8, intrinsics=SMALL, X_WO=LIES).views)
        assert 0.9 < carved(enclose(scan.cloud), scan.space).mesh.volume / true < 1.1
        assert 0.7 < scan.disagree < 1.3  # of two views about their mean, too
        assert scan.findings == ()


def test_what_closes_the_underside_and_hangs_by_itself_is_left_out(
    box: Scanned, monkeypatch: pytest.MonkeyPatch
) -> None:
    points = Underside.points

    def more(bottom: Underside) -> tuple[np.ndarray, np.ndarray]:
        xyz, down = points(bottom)
        return np.vstack([xyz, [[0.15, 0.1, 0.008], [0.155, 0.1, 0.008]]]), np.vstack([down, [[0, 0, -1.0]] * 2])

    monkeypatch.setattr(Underside, "points", more)
    scan = fuse(box.views)
    assert scan.cloud.xyz[:, 0].max() < 0.06
    assert "outliers" not in {finding.code for finding in enclose(scan.cloud).findings}


def test_what_is_empty_is_outside(scan: Scan) -> None:
    inside = np.random.default_rng(0).uniform([-0.047, -0.027, 0.002], [0.047, 0.027, 0.027], (500, 3))
    up = np.array([0, 0, 0.04])
    assert scan.space.empty(inside).mean() < 0.02
    assert scan.space.empty(inside + up).all()
    assert scan.space.empty(inside - up).all()


def test_a_solid_of_which_the_views_leave_nothing_is_refused(scan: Scan) -> None:
    solid = enclose(scan.cloud)
    with pytest.raises(CannotAnswer, match=r"no volume left: .* check their poses"):
        carved(solid, SeenSpace(lambda points: np.ones(len(points), bool)))


def test_poses_slightly_off_are_mended(box: Scanned) -> None:
    wrong = box.views.posed(disturbed(box.views.X_WC, 1.5, 0.4, np.random.default_rng(0)))
    scan = fuse(wrong)
    assert scan.moved_m is not None
    assert scan.disagree < 1.6
    assert np.sqrt(np.mean((np.ptp(scan.cloud.xyz, axis=0)[2] - 0.03) ** 2)) < 1.5e-3


def test_views_of_a_wrong_scale_are_named(box: Scanned) -> None:
    wrong = replace(box.views, depth_unit=0.00125)
    try:
        found = [finding.code for finding in fuse(wrong).findings]
    except CannotAnswer:
        return
    assert "views-disagree" in found


def test_wrong_intrinsics_are_named(box: Scanned) -> None:
    lens = box.views.intrinsics
    wrong = replace(box.views, intrinsics=replace(lens, fx=0.8 * lens.fx, fy=0.8 * lens.fy))
    assert "views-disagree" in {finding.code for finding in fuse(wrong).findings}


def test_the_larger_of_two_objects_is_kept_and_said() -> None:
    two = mesh_of(block((-0.05, 0.0), (-0.03, 0.03), (0, 0.03)), block((0.05, 0.07), (-0.01, 0.01), (0, 0.02)))
    scan = fuse(scanned(two).views)
    assert [finding.code for finding in scan.findings] == ["several-objects"]
    assert scan.cloud.xyz[:, 0].max() < 0.005


def test_a_larger_object_that_most_images_cut_off_is_not_the_one_that_is_looked_at() -> None:
    two = mesh_of(block((-0.03, 0.03), (-0.025, 0.025), (0, 0.04)), block((0.15, 0.22), (-0.05, 0.05), (0, 0.04)))
    scan = fuse(scanned(two, aim=(0.0, 0.0, 0.02), distance=0.34).views)
    assert "several-objects" in {finding.code for finding in scan.findings}
    np.testing.assert_allclose(sorted(np.ptp(scan.cloud.xyz, axis=0)), [0.04, 0.05, 0.06], atol=6e-3)


@pytest.mark.parametrize("lost", [0.2, 0.3])
def test_pixels_lost_anywhere_leave_the_volume_as_it_is(box: Scanned, lost: float) -> None:
    """Where a neighbour was lost the other one tells the slope: few pixels have all four."""
    views = box.views
    kept = np.random.default_rng(0).random(views.depth.shape) >= lost
    scan = fuse(replace(views, depth=np.where(kept, views.depth, 0)))
    assert carved(enclose(scan.cloud), scan.space).mesh.volume == pytest.approx(1.8e-4, rel=0.02)
    assert not scan.findings


@pytest.mark.parametrize("arc", [90, 150])
def test_views_from_one_side_close_the_far_one(arc: float) -> None:
    """What is seen of a box ends at its edges, where the pixels beyond are of the table."""
    views = scan_mesh(BOX, 1, count=90, intrinsics=SMALL, X_WO=LIES).views
    azimuth = np.degrees(np.arctan2(*views.X_WC.position[:, 1::-1].T))
    near = np.abs((azimuth - 40 + 180) % 360 - 180) < arc / 2
    scan = fuse(replace(views, depth=views.depth[near], rgb=views.rgb[near], X_WC=views.X_WC[near]))
    assert carved(enclose(scan.cloud), scan.space).mesh.volume == pytest.approx(1.8e-4, rel=0.025)


def test_a_volume_is_less_sure_the_more_of_its_skin_nobody_saw(scan: Scan) -> None:
    solid = enclose(scan.cloud)
    assert 0.2 < scan.space.unseen < 0.6
    space = replace(scan.space, guess=None)
    assert carved(solid, space).volume_std < 0.07
    much, some = (carved(solid, replace(space, unseen=share)).volume_std for share in (0.8, 0.6))
    assert much > some > 0.07


@pytest.mark.parametrize(("camera", "most"), [(D435, 0.167), (SMALL, 0.14)], ids=["fine", "coarse"])
def test_a_rod_of_three_pixels_is_found(camera: Intrinsics, most: float) -> None:
    """No pixel of it has both neighbours across: where one is of the table the other tells the slope."""
    grip = block((-0.04, 0.04), (-0.012, 0.012), (0, 0.02))
    rod = manifold3d.Manifold.cylinder(0.09, 0.0015, 0.0015, 32).rotate((0, 90, 0)).translate((0.04, 0, 0.01))
    scan = fuse(scan_mesh(mesh_of(grip + rod), 1, count=30, intrinsics=camera, X_WO=LIES).views)
    assert np.ptp(scan.cloud.xyz[:, 0]) > most
    assert "surface-open" not in {finding.code for finding in scan.findings}


def cropped(views: Views, share: float) -> Views:
    """Return views whose images lack a share of their width and height on each side."""
    lens = views.intrinsics
    x, y = int(share * lens.width), int(share * lens.height)
    inner = (slice(None), slice(y, lens.height - y), slice(x, lens.width - x))
    less = replace(lens, width=lens.width - 2 * x, height=lens.height - 2 * y, cx=lens.cx - x, cy=lens.cy - y)
    assert views.rgb is not None
    return replace(views, depth=views.depth[inner], rgb=views.rgb[inner], intrinsics=less)


def test_an_object_that_images_cut_off_is_named() -> None:
    bar = scanned(mesh_of(block((-0.15, 0.15), (-0.015, 0.015), (0, 0.03))))
    for share, cut in ((0.0, False), (0.2, True), (0.3, True)):
        scan = fuse(cropped(bar.views, share))
        assert ("object-cut" in {finding.code for finding in scan.findings}) == cut
        assert (scan.cloud.diagonal < 0.29) == cut


def test_an_empty_table_is_said() -> None:
    buried = mesh_of(block((-0.05, 0.05), (-0.03, 0.03), (-0.02, -0.01)))
    with pytest.raises(CannotAnswer, match="no object was found on the table"):
        fuse(scanned(buried).views)


def test_a_mesh_rests_on_its_widest_side() -> None:
    placed = BRIDGE.in_frame(resting_pose(BRIDGE, 0.3))
    assert placed.bounds[0, 2] == pytest.approx(0, abs=1e-9)
    assert placed.bounds[1, 2] == pytest.approx(0.03, abs=1e-9)


def test_spread_points_keep_their_distance_but_on_both_sides_of_a_sheet() -> None:
    rng = np.random.default_rng(0)
    xyz = np.column_stack([rng.uniform(0, 1, (2000, 2)), np.zeros(2000)])
    up = np.tile([0.0, 0, 1], (2000, 1))
    kept = spread(xyz, up, np.arange(2000), 0.1)
    gap = np.linalg.norm(xyz[kept][:, None] - xyz[kept][None], axis=2) + np.eye(len(kept))
    assert gap.min() >= 0.1
    assert (np.linalg.norm(xyz[:, None] - xyz[kept][None], axis=2).min(1) < 0.1).all()
    both = np.concatenate([up, -up])
    assert len(spread(np.concatenate([xyz, xyz]), both, np.arange(4000), 0.1)) == 2 * len(kept)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"depth_unit": 1.0}, "puts the scene .* m away"),
        ({"depth": np.zeros((2, 240, 320), np.uint16)}, "holds a measured depth"),
        ({"depth": np.zeros((2, 10, 10), np.uint16)}, "must have shape"),
    ],
)
def test_impossible_views(change: dict[str, object], message: str) -> None:
    good = {
        "depth": np.full((2, 240, 320), 400, np.uint16), "rgb": None, "intrinsics": SMALL, "X_WC": Pose.identity(2),
    }  # fmt: skip
    with pytest.raises(BadValue, match=message):
        Views(**{**good, **change})  # type: ignore[arg-type]


@pytest.mark.parametrize("wrong", [{"fx": 0.0}, {"fy": -1.0}, {"cx": 400.0}, {"cy": -20.0}, {"fx": float("nan")}])
def test_impossible_lenses(wrong: dict[str, float]) -> None:
    with pytest.raises(BadValue, match="the camera's"):
        replace(SMALL, **wrong)


def test_a_tunnel_that_too_few_views_look_into_is_named_and_its_volume_is_unsure() -> None:
    long, half, wall = 0.075, 0.025, 0.006
    across, high = (-half, half), (0, 2 * half)
    tunnel = mesh_of(
        block((-long, long), across, (0, wall)),
        block((-long, long), across, (2 * half - wall, 2 * half)),
        block((-long, long), (-half, wall - half), high),
        block((-long, long), (half - wall, half), high),
    )
    true = 2 * long * ((2 * half) ** 2 - (2 * half - 2 * wall) ** 2)
    solid = shape_of(fuse(scan_mesh(tunnel, 1, count=24, intrinsics=SMALL, X_WO=LIES).views)).solid
    assert solid.mesh.volume > 1.2 * true
    assert solid.mesh.volume * (1 - 2.5 * solid.volume_std) < true
    said = [finding.message for finding in solid.findings if finding.code == "surface-open"]
    assert len(said) == 1
    assert "no view measured a surface" in said[0]


def test_of_skin_on_which_nothing_was_measured_only_what_views_ought_to_see_is_a_guess(scan: Scan) -> None:
    assert scan.space.guess is not None
    middles = np.array([[0, 0, 0.03], [0, 0, 0.06], [0, 0, 0.0], [0, 0, 0.06]])
    areas = 1e-4 * np.array([[0, 0, 3.0], [0, 0, 1.0], [0, 0, 9.0], [0, 0, -9.0]])
    assert scan.space.guess(middles, areas) == pytest.approx(0.25)
    assert scan.space.guess(middles[2:], areas[2:]) == 0.0
    solid = enclose(scan.cloud)
    assert carved(solid, replace(scan.space, guess=lambda *_: 0.3)).volume_std > 0.3
    assert not carved(solid, scan.space).findings


def test_a_cloth_with_folds_is_named(box: Scanned, scan: Scan) -> None:
    """Folds of 3 mm where the table is seen, and none on the box."""
    views, noisy = box.views, []
    for k in range(len(views)):
        v, u = np.mgrid[: SMALL.height, : SMALL.width]
        z = views.depth[k] * views.depth_unit
        ray = np.stack([(u - SMALL.cx) / SMALL.fx * z, (v - SMALL.cy) / SMALL.fy * z, z], axis=-1)
        x, y, h = np.moveaxis(views.X_WC[k].apply(ray.reshape(-1, 3)).reshape(ray.shape), -1, 0)
        fold = np.where(h < 0.003, 0.003 * np.sin(90 * x) * np.sin(70 * y), 0)
        noisy.append(np.round((z + fold) / views.depth_unit) * (z > 0))
    folded = fuse(replace(views, depth=np.array(noisy, np.uint16)))
    assert "table-uneven" in {finding.code for finding in folded.findings}
    assert "table-uneven" not in {finding.code for finding in scan.findings}
    # What the folds may hide under the box, as a share of its 30 mm, is in the bar.
    assert shape_of(folded).solid.volume_std > 0.0015 / 0.03
    # Where there are none, only what a rim may leave open below.
    assert scan.space.unsure_m3 < 0.001 * (0.1 * 0.06 * 0.03)


def test_an_object_taller_than_the_cameras_are_far_keeps_its_top() -> None:
    tall = mesh_of(block((-0.05, 0.05), (-0.05, 0.05), (0, 0.03)), block((-0.02, 0.02), (-0.02, 0.02), (0.03, 0.22)))
    seen = scan_mesh(tall, 1, count=45, intrinsics=SMALL, X_WO=LIES, distance=0.32, aim=(0, 0, 0.11))
    solid = shape_of(fuse(seen.views)).solid
    assert solid.mesh.volume == pytest.approx(0.1 * 0.1 * 0.03 + 0.04 * 0.04 * 0.19, rel=0.05)


@pytest.mark.parametrize(("shows", "pieces"), [(False, 1), (True, 2)], ids=["nothing-between", "table-between"])
def test_the_floor_of_a_cup_is_no_other_object(shows: bool, pieces: int) -> None:
    """Between its floor and its wall next to nothing is measured; between a ring and what lies in it the table is."""
    i, j = np.mgrid[-30:31, -30:31]
    away = np.hypot(i, j)
    label = np.where((away > 20) & (away < 25), 1, np.where(away < 12, 2, 0))
    told = _with_its_floor(label, 1, (label == 0) & ((away > 20) | shows))
    assert len(np.unique(told[told > 0])) == pieces
