"""Tetrahedra clustering: plain Python with Qhull makes the same tree; the published edge cases are right."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.spatial import ConvexHull, Delaunay

from steelyard.bench.shapes.plain_clustering import plain_cluster
from steelyard.errors import BadValue
from steelyard.parts.clustering import cluster
from steelyard.shape.tets import TetMesh
from steelyard.spatial import Pose, Rotation


@cache
def cross(points: int = 100, seed: int = 0) -> TetMesh:
    """A cross of two bars."""
    rng = np.random.default_rng(seed)
    xyz = rng.uniform(size=(points, 3)) * [3, 3, 0.5]
    mesh = TetMesh(xyz, Delaunay(xyz).simplices)
    x, y = mesh.centroids[:, 0], mesh.centroids[:, 1]
    return mesh.chosen((np.abs(x - 1.5) < 0.5) | (np.abs(y - 1.5) < 0.5))


def partition(tree, node) -> frozenset:
    return frozenset(tree.leaves(node).tolist())


@pytest.mark.parametrize("seed", [0, 1, 4])
def test_the_tree_is_that_of_plain_python_with_qhull(seed: int) -> None:
    mesh = cross(60, seed)
    ours = cluster(mesh)
    for lazy in (True, False):
        plain, took = plain_cluster(mesh, lazy=lazy)
        assert np.array_equal(ours.merges, plain.merges)
        np.testing.assert_allclose(ours.cost, plain.cost, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(ours.hull, plain.hull, rtol=1e-9)
        np.testing.assert_allclose(ours.volume, plain.volume, rtol=1e-12)
        assert took.hulls > len(mesh)


def test_a_warm_start_joins_the_given_pieces() -> None:
    mesh = cross(150)
    piece = np.floor(mesh.centroids[:, 0] / 0.4).astype(int) * 10 + np.floor(mesh.centroids[:, 1] / 0.4).astype(int)
    ours, (plain, _) = cluster(mesh, piece), plain_cluster(mesh, piece)
    assert len(ours) == len(np.unique(piece))
    assert np.array_equal(ours.merges, plain.merges)
    np.testing.assert_allclose(ours.hull, plain.hull, rtol=1e-9)
    assert len(np.unique(np.stack([ours.piece, piece]), axis=1).T) == len(ours)


def test_nodes_know_their_volume_and_hull() -> None:
    mesh = cross()
    tree = cluster(mesh)
    for node in range(0, tree.root + 1, 37):
        own = np.isin(tree.piece, tree.leaves(node))
        assert tree.volume[node] == pytest.approx(mesh.volumes[own].sum())
        assert tree.hull[node] == pytest.approx(ConvexHull(mesh.vertices[np.unique(mesh.tets[own])]).volume)


def test_costs_are_those_of_the_paper() -> None:
    mesh = cross()
    tree, scale = cluster(mesh), np.linalg.norm(np.ptp(mesh.vertices[np.unique(mesh.tets)], axis=0)) ** 3
    for k, (i, j) in enumerate(tree.merges):
        node = len(tree) + k
        hollow = (tree.hull[node] - tree.volume[i] - tree.volume[j]) / scale
        tets = [len(tree.leaves(n)) for n in (i, j)]
        if tree.cost[k] > 1:
            assert tree.cost[k] == pytest.approx(1 + hollow, abs=1e-12)
        else:
            assert hollow == pytest.approx(0, abs=1e-9)
            assert tree.cost[k] == pytest.approx((tets[0] ** 2 + tets[1] ** 2) / len(mesh) ** 2)


def test_numbering_and_frame_do_not_matter() -> None:
    mesh = cross(80, 2)
    rng = np.random.default_rng(0)
    tets, points = rng.permutation(len(mesh)), rng.permutation(len(mesh.vertices))
    place = np.argsort(points)
    moved = TetMesh(mesh.vertices[points], place[mesh.tets][tets])
    turned = mesh.in_frame(Pose(Rotation.exp([0.4, -0.7, 0.2]), np.array([5.0, 1, 0])))
    tree, other, third = (cluster(m) for m in (mesh, moved, turned))
    for k in range(len(tree), tree.root + 1):
        assert partition(tree, k) == frozenset(tets[other.leaves(k)].tolist())
        assert partition(tree, k) == partition(third, k)


def test_repeats_are_bit_identical() -> None:
    first, second = cluster(cross()), cluster(cross())
    for name in ("piece", "merges", "cost", "volume", "hull"):
        assert getattr(first, name).tobytes() == getattr(second, name).tobytes()


def bodies(*where: float) -> TetMesh:
    """Unit-edged balls of points along x, the k-th of radius k + 1."""
    points, tets, count = [], [], 0
    for k, x in enumerate(where):
        xyz = np.random.default_rng(k).normal(size=(30, 3)) * (k + 1) + [x, 0, 0]
        points.append(xyz)
        tets.append(Delaunay(xyz).simplices + count)
        count += len(xyz)
    return TetMesh(np.concatenate(points), np.concatenate(tets))


def test_separate_bodies_all_stay_and_are_joined_last() -> None:
    mesh = bodies(0, 50, 150)
    tree = cluster(mesh)
    assert np.isinf(tree.cost).tolist() == [False] * (len(mesh) - 3) + [True, True]
    labels = tree.cut(3)
    body = np.digitize(mesh.centroids[:, 0], [25, 100])
    assert [np.unique(labels[body == k]).tolist() for k in range(3)] == [[2], [1], [0]]
    assert tree.volume[tree.root] == pytest.approx(mesh.volume)
    assert tree.hull[tree.root] == pytest.approx(ConvexHull(mesh.vertices).volume)
    assert np.unique(tree.cut(2)[body < 2]).tolist() == [1]


def test_single_tets_and_one_piece() -> None:
    mesh = TetMesh(np.r_[np.zeros((1, 3)), np.eye(3)], [[0, 1, 2, 3]])
    tree = cluster(mesh)
    assert (len(tree), tree.volume[0], tree.hull[0]) == (1, pytest.approx(1 / 6), pytest.approx(1 / 6))
    whole = cluster(cross(), piece=np.zeros(len(cross()), int))
    assert len(whole) == 1
    assert whole.hull[0] == pytest.approx(ConvexHull(cross().vertices[np.unique(cross().tets)]).volume)


def test_slivers_are_joined_and_lose_nothing() -> None:
    grid = np.stack(np.meshgrid(*[np.arange(4.0)] * 3), -1).reshape(-1, 3)
    xyz = Rotation.exp([0.1, 0.2, 0.3]).apply(grid) * 0.01
    mesh = TetMesh(xyz, Delaunay(xyz).simplices)
    assert mesh.volumes.min() < 1e-12 * mesh.volumes.max()
    tree = cluster(mesh)
    assert len(tree) == len(mesh)
    assert np.isfinite(tree.cost).all()
    assert tree.volume[tree.root] == pytest.approx(27e-6)
    assert tree.hull[tree.root] == pytest.approx(27e-6)


def test_labels_that_do_not_fit_are_refused() -> None:
    with pytest.raises(BadValue, match=r"piece needs one whole number per tet"):
        cluster(cross(), piece=[0, 1])
