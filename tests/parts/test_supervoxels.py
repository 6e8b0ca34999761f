"""Supervoxels: they keep to colours, cover the cloud, and do not care about frame or order."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import Delaunay

from steelyard.errors import BadValue
from steelyard.evaluate.segments import score_segments
from steelyard.io.object_folders import read_object
from steelyard.parts.supervoxels import pieces_of_points, supervoxels
from steelyard.shape.cloud import Cloud
from steelyard.shape.tets import TetMesh
from steelyard.spatial import Pose, Rotation


def bar(points: int = 800) -> Cloud:
    """A square bar of two colours along x."""
    rng = np.random.default_rng(0)
    xyz = rng.uniform(size=(points, 3)) * [0.3, 0.03, 0.03]
    side = rng.integers(4, size=points)
    xyz[np.arange(points), 1 + side // 2] = 0.03 * (side % 2)
    red = xyz[:, 0] > 0.13
    return Cloud(xyz, np.where(red[:, None], [200, 30, 30], [60, 60, 60]), red.astype(int))


def test_supervoxels_keep_to_colours_and_are_as_many_as_asked() -> None:
    cloud = bar()
    for count in (5, 50):
        found = supervoxels(cloud, count)
        assert np.unique(found).tolist() == list(range(count))
    assert score_segments(cloud.labels, found).impurity < 0.005


def test_frame_and_order_do_not_matter() -> None:
    cloud = bar()
    order = np.random.default_rng(1).permutation(len(cloud))
    moved = cloud.in_frame(Pose(Rotation.exp([0.5, 1.0, -0.3]), np.array([1.0, 2, 3]))).chosen(order)
    assert score_segments(supervoxels(cloud)[order], supervoxels(moved)).ari == 1


def test_normals_of_either_sign_may_be_given() -> None:
    cloud = bar()
    normals = np.zeros((len(cloud), 3))
    edge = np.abs(cloud.xyz[:, 1:] - 0.015)
    normals[np.arange(len(cloud)), 1 + edge.argmax(1)] = 1
    one, other = (supervoxels(Cloud(cloud.xyz, cloud.rgb, None, n)) for n in (normals, -normals))
    assert np.array_equal(one, other)
    faces = score_segments(np.abs(normals) @ [1, 2, 3] * 2 + (cloud.xyz[:, 1:].sum(1) > 0.03), one)
    assert faces.impurity < 0.1


def test_separate_bodies_stay_apart_and_few_points_stay_alone() -> None:
    rng = np.random.default_rng(2)
    two = Cloud(np.concatenate([rng.normal(size=(100, 3)), rng.normal(size=(100, 3)) + 100]))
    assert supervoxels(two, 1).max() == 1
    assert len(np.unique(supervoxels(two.chosen(slice(0, 20))))) == 20
    assert supervoxels(two.chosen([0])).tolist() == [0]
    same = Cloud(np.zeros((60, 3)))
    assert len(supervoxels(same, 5)) == 60
    with pytest.raises(BadValue, match="at least 1; got 0"):
        supervoxels(two, 0)


def test_tets_take_the_nearest_point() -> None:
    cloud = bar(300)
    mesh = TetMesh(cloud.xyz, Delaunay(cloud.xyz).simplices)
    labels = supervoxels(cloud, 12)
    piece = pieces_of_points(mesh, cloud, labels)
    nearest = np.linalg.norm(mesh.centroids[:, None] - cloud.xyz, axis=2).argmin(1)
    assert np.array_equal(piece, labels[nearest])


def test_shared_objects(data_dir) -> None:
    folder = data_dir / "workshop-tools"
    impure = {}
    for name in ("hammer", "rubber-mallet", "screwdriver"):
        cloud = read_object(folder / name).cloud
        impure[name] = score_segments(cloud.labels, supervoxels(cloud)).impurity
    assert max(impure.values()) < 0.02, impure
