"""Simulated views: exact depth by hand, noise of the size that is declared, a mesh that rests on the table."""

from __future__ import annotations

import manifold3d
import numpy as np
import pytest

from steelyard.shape.mesh import TriangleMesh
from steelyard.shape.views import Intrinsics
from steelyard.simulate.camera import DepthNoise, looking, wrist_arc
from steelyard.simulate.scanning import render, resting_pose, scan_mesh
from steelyard.spatial import Pose, Rotation

CAMERA = Intrinsics(161, 121, 150.0, 150.0, 80.0, 60.0)


def box(x: float, y: float, z: float) -> TriangleMesh:
    """A box on the table, centred over the origin."""
    mesh = manifold3d.Manifold.cube([x, y, z]).translate([-x / 2, -y / 2, 0]).to_mesh64()
    count = len(mesh.tri_verts)
    rgb = np.tile(np.array([200, 10, 10], np.uint8), (count, 1))
    return TriangleMesh(mesh.vert_properties[:, :3], mesh.tri_verts, np.zeros(count), rgb)


def test_depth_from_straight_above_is_the_height_of_the_camera_over_box_and_table() -> None:
    above = looking(np.array([[0.0, 0.0, 0.5]]), np.zeros(3))[0]
    mesh = box(0.1, 0.06, 0.03)
    z, cosine, rgb = render(mesh, np.asarray(mesh.rgb), CAMERA, above)
    on_box = rgb[..., 0] == 200
    assert z[on_box] == pytest.approx(0.47, abs=1e-12)
    assert z[~on_box] == pytest.approx(0.5, abs=1e-12)
    # the silhouette is as large as the lens makes it: 0.1 m at 0.47 m is 31.9 pixels
    assert on_box.any(axis=1).sum() * on_box.any(axis=0).sum() == pytest.approx(31.9 * 19.1, rel=0.08)
    assert cosine[60, 80] == pytest.approx(1)
    slope = np.sqrt(1 + (40 / 150) ** 2)  # a pixel 40 beside the axis
    assert cosine[60, 120] == pytest.approx(1 / slope)


def test_noise_of_depth_grows_with_the_square_of_the_distance() -> None:
    noise = DepthNoise(edge=0, speckle=0)
    spread = []
    for size in (1.0, 2.0):  # twice the object: the camera stands twice as far off
        scan = scan_mesh(box(0.3 * size, 0.3 * size, 0.02), 3, count=3, noise=noise, intrinsics=CAMERA, depth_unit=1e-4)
        depth, exact = scan.views.depth * 1e-4, scan.exact.depth * 1e-4
        seen = (depth > 0) & (exact > 0)
        spread.append(float(np.std((depth[seen] - exact[seen]) / exact[seen] ** 2)))
    assert spread == pytest.approx([noise.per_square] * 2, rel=0.05)


def test_the_same_seed_makes_the_same_scan_and_another_one_does_not() -> None:
    first, again, other = (scan_mesh(box(0.1, 0.06, 0.03), seed, count=2, intrinsics=CAMERA) for seed in (1, 1, 2))
    assert np.array_equal(first.views.depth, again.views.depth)
    assert np.array_equal(first.views.rgb, again.views.rgb)
    assert not np.array_equal(first.views.depth, other.views.depth)


def test_reported_poses_err_as_asked() -> None:
    scan = scan_mesh(
        box(0.1, 0.06, 0.03), 0, count=90, noise=None, intrinsics=Intrinsics(16, 12, 14, 14, 8, 6), pose_std=(2, 0.5)
    )
    off = scan.X_WC.inverse() @ scan.views.X_WC
    assert np.sqrt(np.mean(off.position**2)) == pytest.approx(2e-3, rel=0.15)
    assert np.sqrt(np.mean(off.rotation.log() ** 2)) == pytest.approx(np.radians(0.5), rel=0.15)


@pytest.mark.parametrize("seed", range(4))
def test_a_box_comes_to_rest_on_its_largest_side(seed: int) -> None:
    rng = np.random.default_rng(seed)
    tilted = box(0.1, 0.06, 0.03).in_frame(Pose(Rotation.exp(rng.normal(size=3)), rng.normal(size=3)))
    lies = tilted.in_frame(resting_pose(tilted, yaw=float(seed)))
    low, high = lies.bounds
    assert low[2] == pytest.approx(0, abs=1e-6)
    assert high[2] == pytest.approx(0.03, abs=1e-6)
    assert (low + high)[:2] == pytest.approx([0, 0], abs=1e-6)


def test_the_arc_looks_at_its_target_from_the_distance_asked() -> None:
    target = np.array([0.1, 0.2, 0.05])
    arc = wrist_arc(target, 0.4, 30)
    ahead = arc.inverse().apply(np.tile(target, (30, 1))[:, None])[:, 0]
    np.testing.assert_allclose(ahead, np.tile([0, 0, 0.4], (30, 1)), atol=1e-12)
    assert np.ptp(np.degrees(np.arcsin((arc.position - target)[:, 2] / 0.4))) > 40
