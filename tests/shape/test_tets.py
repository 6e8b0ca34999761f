"""Laws of tetrahedral meshes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import Delaunay

from steelyard.errors import BadValue
from steelyard.inertia import InertialParameters
from steelyard.shape.cloud import Cloud
from steelyard.shape.mesh import TriangleMesh, part_moments
from steelyard.shape.tets import TetMesh
from steelyard.spatial import Pose, Rotation


@pytest.fixture(scope="module")
def ball() -> TetMesh:
    points = np.random.default_rng(0).normal(size=(200, 3)) * [1.0, 0.5, 0.3]
    return TetMesh(points, Delaunay(points).simplices)


def test_moments_are_those_of_the_boundary(ball: TetMesh) -> None:
    mesh = TriangleMesh(ball.vertices, ball.surface, np.zeros(len(ball.surface)))
    np.testing.assert_allclose(ball.moments(np.zeros(len(ball)), 1), part_moments(mesh), rtol=1e-10, atol=1e-12)


def test_moments_of_groups_add_up(ball: TetMesh) -> None:
    groups = np.random.default_rng(1).integers(0, 7, len(ball))
    whole = ball.moments(np.zeros(len(ball)), 1)[0]
    np.testing.assert_allclose(ball.moments(groups, 7).sum(0), whole, rtol=1e-12, atol=1e-14)
    assert whole[0] == pytest.approx(ball.volume)


def test_moments_follow_a_change_of_frame(ball: TetMesh) -> None:
    X_AB = Pose(Rotation.exp([0.2, 0.6, -0.3]), np.array([3.0, -2.0, 1.0]))
    zero = np.zeros(len(ball))
    moved = InertialParameters(ball.moments(zero, 1)[0]).in_frame(X_AB)
    np.testing.assert_allclose(ball.in_frame(X_AB).moments(zero, 1)[0], moved.vector, rtol=1e-10, atol=1e-12)


def test_every_inner_face_is_shared_by_two(ball: TetMesh) -> None:
    counts = np.bincount(ball.dual.ravel(), minlength=len(ball))
    np.testing.assert_array_equal(counts, (ball.neighbours >= 0).sum(1))
    assert len(ball.surface) == 4 * len(ball) - 2 * len(ball.dual)
    first, second = ball.dual.T
    shared = [len(set(ball.tets[a]) & set(ball.tets[b])) for a, b in zip(first, second, strict=True)]
    assert set(shared) == {3}


def test_a_turned_cell_is_turned_back() -> None:
    corners = np.vstack([np.zeros(3), np.eye(3)])
    for order in ([0, 1, 2, 3], [0, 2, 1, 3]):
        assert TetMesh(corners, [order]).volume == pytest.approx(1 / 6)


def test_wrong_cells_are_named() -> None:
    with pytest.raises(BadValue, match=r"tets must name vertices 0\.\.3; got 0\.\.4"):
        TetMesh(np.eye(4)[:, :3], [[0, 1, 2, 4]])
    with pytest.raises(BadValue, match="T > 0"):
        TetMesh(np.eye(4)[:, :3], np.empty((0, 4)))


def test_columns_of_a_cloud_must_match() -> None:
    with pytest.raises(BadValue, match=r"2 points needs colours of shape \(2, 3\); got \(1, 3\)"):
        Cloud(np.zeros((2, 3)), np.zeros((1, 3)))
    with pytest.raises(BadValue, match="carry the label"):
        Cloud(np.zeros((2, 3))).labels  # noqa: B018
