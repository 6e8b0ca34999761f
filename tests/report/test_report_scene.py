"""What is drawn: skins that enclose their cells, thinned surfaces, normals at edges, buffers, where it all sits."""

from __future__ import annotations

import base64
import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import ConvexHull, Delaunay

from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.evidence import Evidence, PartMass
from steelyard.identify.estimate import Estimate
from steelyard.inertia.solids import ellipsoid
from steelyard.report import Report, scene_of_mesh, scene_of_solid
from steelyard.report.drawing import _magnified, drawing
from steelyard.report.legend import viewer
from steelyard.report.scene import pose_from_centroids
from steelyard.report.surfaces import corner_normals, evened, part_skins, thinned
from steelyard.shape.cloud import Cloud
from steelyard.shape.mesh import TriangleMesh, open_edges, part_moments
from steelyard.shape.tets import TetMesh
from steelyard.spatial import Pose, Rotation


@pytest.fixture(scope="module")
def solid() -> TetMesh:
    points = np.random.default_rng(0).normal(size=(150, 3)) * [0.10, 0.03, 0.02]
    return TetMesh(points, Delaunay(points).simplices)


def sphere(count: int = 3000) -> tuple[Array, Array]:
    k = np.arange(count) + 0.5
    z, turn = 1 - 2 * k / count, np.pi * (1 + 5**0.5) * k
    points = np.stack([np.cos(turn) * np.sqrt(1 - z**2), np.sin(turn) * np.sqrt(1 - z**2), z], axis=1)
    faces = ConvexHull(points).simplices.astype(np.int64)
    a, b, c = np.moveaxis(points[faces], 1, 0)
    inward = ((a + b + c) * np.cross(b - a, c - a)).sum(1) < 0
    faces[inward] = faces[inward][:, [0, 2, 1]]
    return points, faces


def test_skins_enclose_their_cells(solid: TetMesh) -> None:
    labels = np.digitize(solid.centroids[:, 0], [-0.03, 0.04])
    for label, faces in part_skins(solid, labels):
        mesh = TriangleMesh(solid.vertices, faces, np.zeros(len(faces)))
        assert not open_edges(mesh).any()
        assert part_moments(mesh)[0, 0] == pytest.approx(solid.volumes[labels == label].sum())


def test_thinned_surfaces_keep_their_shape() -> None:
    points, faces = sphere()
    v, t = thinned(points, faces, 900)
    assert 500 < len(t) <= 900
    assert np.abs(np.linalg.norm(v, axis=1) - 1).max() < 0.05
    mesh = TriangleMesh(v, t, np.zeros(len(t)))
    assert part_moments(mesh)[0, 0] == pytest.approx(4 / 3 * np.pi, rel=0.03)
    same_v, same_t = thinned(points, faces, len(faces))
    assert len(same_t) == len(faces)
    assert len(same_v) == len(points)


def test_a_noisy_sphere_is_drawn_even_and_as_large_as_it_was() -> None:
    points, faces = sphere()
    noisy = points * (1 + 0.02 * np.random.default_rng(0).normal(size=(len(points), 1)))
    even = np.linalg.norm(evened(noisy, faces), axis=1)
    assert even.std() < 0.6 * np.linalg.norm(noisy, axis=1).std()
    assert even.mean() == pytest.approx(np.linalg.norm(noisy, axis=1).mean(), abs=0.002)


def test_a_coarse_surface_is_drawn_as_it_is() -> None:
    """Eight corners are a cube, not noise; only what is fine is evened."""
    cube = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    faces = ConvexHull(cube).simplices.astype(np.int64)
    np.testing.assert_array_equal(evened(cube, faces), cube)
    points, fine = sphere()
    both, used = np.vstack([cube, 0.5 * points]), np.vstack([faces, fine + 8])
    np.testing.assert_array_equal(evened(both, used)[:8], cube)
    assert (evened(both, used)[8:] != both[8:]).any(1).all()


def test_what_no_triangle_uses_stays_where_it_is() -> None:
    points, faces = sphere(200)
    lone = np.vstack([points, [[3.0, 0.0, 0.0]]])
    np.testing.assert_array_equal(evened(lone, faces)[-1], [3, 0, 0])


def test_normals_are_smooth_on_a_sphere_and_sharp_on_a_box() -> None:
    points, faces = sphere(1000)
    assert (corner_normals(points, faces) * points[faces]).sum(-1).min() > 0.999
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    hull = ConvexHull(corners)
    normals = corner_normals(corners, hull.simplices.astype(np.int64))
    np.testing.assert_allclose(np.abs(normals).max(-1), 1)


def test_colours_come_from_the_nearest_point(solid: TetMesh) -> None:
    rgb = np.random.default_rng(1).integers(0, 256, solid.vertices.shape)
    scene = scene_of_solid(solid, np.zeros(len(solid), int), Cloud(solid.vertices, rgb))
    (body,) = scene.bodies
    nearest = np.linalg.norm(body.vertices[:, None] - solid.vertices, axis=2).argmin(1)
    np.testing.assert_array_equal(body.rgb, rgb[nearest])


def found(com: tuple[float, float, float], std: float) -> Estimate:
    body = ellipsoid(0.05, 0.03, 0.02, 1000).in_frame(Pose(Rotation.identity(), np.array(com)))
    covariance = np.diag([1e-12, *[(std * float(body.mass)) ** 2] * 3, *[1e-14] * 6])
    return Estimate(body, covariance, "m", Evidence(10, 1, 1, 1, 0, 0), np.ones(10, np.bool_))


def test_buffers_hold_the_surface(solid: TetMesh) -> None:
    X_SO = Pose(Rotation.exp([0.3, 0.1, -0.4]), np.array([0.1, 0.2, 0.3]))
    scene = scene_of_solid(solid, np.zeros(len(solid), int), X_SO=X_SO)
    drawn = drawing(Report("t", found((0, 0, 0), 1e-4), scene), scene)
    body = drawn["bodies"][0]
    table = np.frombuffer(base64.b64decode(body["vertices"]), "<u2").reshape(-1, 8)
    index = np.frombuffer(base64.b64decode(body["indices"]), "<u4")
    places = np.array(drawn["low"]) + drawn["size"] * table[index][:, :3] / 65535.0
    exact = X_SO.apply(scene.bodies[0].vertices)[scene.bodies[0].triangles.ravel()]
    assert np.abs(places - exact).max() < drawn["size"] / 65535
    assert body["count"] == len(index)


def test_a_label_has_the_digits_of_the_mass_beside_the_picture(solid: TetMesh) -> None:
    seen = replace(found((0, 0, 0), 1e-4), parts=(PartMass(0, 0.3821, 0.050, 1e-4, np.zeros(3)),))
    report = Report("t", seen, scene_of_solid(solid, np.zeros(len(solid), int)))
    assert report.scene is not None
    said = drawing(report, report.scene)["bodies"][0]["says"]
    assert said == ("382 g" if seen.mass < 1 else "0.382 kg")
    assert "".join(re.findall(r'class="v">([^<]*)<', str(viewer(report)))) == said.split()[0]


def test_marks_are_where_the_answer_says(solid: TetMesh) -> None:
    scene = scene_of_solid(solid, np.zeros(len(solid), int), X_SO=Pose.identity())
    marks = drawing(Report("t", found((0.01, 0.02, 0.03), 1e-4), scene), scene)["marks"]
    np.testing.assert_allclose(marks["com"], [0.01, 0.02, 0.03], rtol=1e-6)
    half = np.linalg.norm(marks["spread"]["axes"], axis=1) / marks["spread"]["larger"]
    np.testing.assert_allclose(half, np.sqrt(7.815) * 1e-4, rtol=1e-3)
    # An even ellipsoid is its own inertia ellipsoid.
    np.testing.assert_allclose(sorted(np.linalg.norm(marks["ellipsoid"], axis=1)), [0.02, 0.03, 0.05], rtol=1e-5)


@pytest.mark.parametrize(
    ("half", "larger"), [(0.1, 1), (0.05, 1), (0.0249, 2), (0.011, 2), (0.009, 5), (1e-4, 500), (0, 1)]
)
def test_small_ellipsoids_are_drawn_larger_by_a_round_number(half: float, larger: int) -> None:
    assert _magnified(half, 1.0) == larger


def test_centroids_say_where_the_object_sits() -> None:
    points = np.random.default_rng(3).normal(size=(5, 3)) * 0.1
    X = Pose(Rotation.exp([1.0, -0.5, 2.0]), np.array([0.3, -0.1, 0.2]))
    pose = pose_from_centroids(X.apply(points), points)
    assert pose is not None
    np.testing.assert_allclose(pose.matrix(), X.matrix(), atol=1e-12)
    line = np.outer(np.arange(4), [0.1, 0.2, 0.0])
    assert pose_from_centroids(X.apply(line), line) is None
    assert pose_from_centroids(X.apply(points), 1.1 * points) is None
    assert pose_from_centroids(X.apply(points[:2]), points[:2]) is None
    mirrored = points * [1, 1, -1]
    assert pose_from_centroids(X.apply(points), mirrored) is None


def test_two_parts_say_where_the_object_sits_only_where_both_frames_are_one() -> None:
    places = np.array([[0.0, 0, 0.1], [0.02, 0, 0.2]])
    one = pose_from_centroids(places, places)
    assert one is not None
    assert one.position.tolist() == [0, 0, 0]
    assert pose_from_centroids(places, places + np.array([0, 0, 0.01])) is None


def test_wrong_scenes_are_named(solid: TetMesh) -> None:
    with pytest.raises(BadValue, match=r"cells need one label each; got \(3,\)"):
        scene_of_solid(solid, np.zeros(3, int))
    with pytest.raises(BadValue, match="1 parts need one colour each"):
        scene_of_solid(solid, np.zeros(len(solid), int), rgb=np.zeros((2, 3)))
    flat = TriangleMesh(np.zeros((3, 3)), [[0, 1, 2]], [0])
    with pytest.raises(BadValue, match="a scene needs parts that have a size"):
        scene_of_mesh(flat)
    with pytest.raises(BadValue, match="at least one part"):
        replace(scene_of_solid(solid, np.zeros(len(solid), int)), bodies=())
