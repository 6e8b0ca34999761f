"""Tetrahedra clustering: plain Python with Qhull makes the same tree; the published edge cases are right."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.spatial import ConvexHull, Delaunay

from steelyard.bench.shapes.plain_clustering import plain_cluster
from steelyard.errors import BadValue
from steelyard.parts import clustering, merging
from steelyard.parts.clustering import Hollow, Published, cluster
from steelyard.parts.merging import merge_all
from steelyard.shape.hull import hull_work
from steelyard.shape.tets import TetMesh
from steelyard.spatial import Pose, Rotation

COSTS = [Published(), Hollow(), Hollow(0.0)]


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


@pytest.mark.parametrize("cost", COSTS)
@pytest.mark.parametrize("seed", [0, 1, 4])
def test_the_tree_is_that_of_plain_python_with_qhull(cost, seed: int) -> None:
    mesh = cross(60, seed)
    ours = cluster(mesh, cost=cost)
    for lazy in (True, False):
        plain, took = plain_cluster(mesh, cost=cost, lazy=lazy)
        assert np.array_equal(ours.merges, plain.merges)
        np.testing.assert_allclose(ours.cost, plain.cost, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(ours.hull, plain.hull, rtol=1e-9)
        np.testing.assert_allclose(ours.volume, plain.volume, rtol=1e-12)
        assert took.hulls > len(mesh)


@pytest.mark.parametrize("cost", COSTS)
def test_where_the_kernel_gives_up_qhull_stands_in(cost, monkeypatch: pytest.MonkeyPatch) -> None:
    mesh, runs = cross(60), []
    apart = TetMesh(
        np.concatenate([mesh.vertices, mesh.vertices + np.array([9, 0, 0])]),
        np.concatenate([mesh.tets, mesh.tets + len(mesh.vertices)]),
    )
    right = cluster(apart, cost=cost)

    def counted(*given):
        runs.append(given)
        return merge_all(*given)

    def cut_room(points: int):
        work = hull_work(points)
        return work._replace(face=work.face[:44].copy())  # room for 44 faces: larger hulls are a fault

    monkeypatch.setattr(merging, "hull_work", cut_room)
    monkeypatch.setattr(clustering, "merge_all", counted)
    found = cluster(apart, cost=cost)
    assert len(runs) > 3
    assert np.array_equal(found.merges, right.merges)
    for name in ("cost", "volume", "hull"):
        np.testing.assert_allclose(getattr(found, name), getattr(right, name), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("cost", COSTS)
def test_a_warm_start_joins_the_given_pieces(cost) -> None:
    mesh = cross(150)
    piece = np.floor(mesh.centroids[:, 0] / 0.4).astype(int) * 10 + np.floor(mesh.centroids[:, 1] / 0.4).astype(int)
    ours, (plain, _) = cluster(mesh, piece, cost=cost), plain_cluster(mesh, piece, cost)
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


def test_a_cross_falls_into_bars() -> None:
    xyz = np.stack(np.meshgrid(np.arange(-6.0, 7), np.arange(-6.0, 7), [-1.0, 0, 1]), -1).reshape(-1, 3) / 2
    xyz = xyz[(np.abs(xyz[:, :2]) <= 0.5).any(1)]
    mesh = TetMesh(xyz, Delaunay(xyz).simplices)
    x, y = np.abs(mesh.centroids[:, :2]).T
    tree = cluster(mesh.chosen((x < 0.5) | (y < 0.5)), cost=Hollow())
    hollow = (tree.hull - tree.volume) / tree.volume[tree.root]
    assert min(hollow[tree.nodes(count)].sum() for count in (2, 3, 4)) < 0.25 < 1 < hollow[tree.root]


@pytest.mark.parametrize("cost", COSTS)
def test_numbering_and_frame_do_not_matter(cost) -> None:
    mesh = cross(80, 2)
    rng = np.random.default_rng(0)
    tets, points = rng.permutation(len(mesh)), rng.permutation(len(mesh.vertices))
    place = np.argsort(points)
    moved = TetMesh(mesh.vertices[points], place[mesh.tets][tets])
    turned = mesh.in_frame(Pose(Rotation.exp([0.4, -0.7, 0.2]), np.array([5.0, 1, 0])))
    tree, other, third = (cluster(m, cost=cost) for m in (mesh, moved, turned))
    for k in range(len(tree), tree.root + 1):
        assert partition(tree, k) == frozenset(tets[other.leaves(k)].tolist())
        assert partition(tree, k) == partition(third, k)


def test_repeats_are_bit_identical() -> None:
    first, second = cluster(cross(), cost=Hollow()), cluster(cross(), cost=Hollow())
    for name in ("piece", "merges", "cost", "volume", "hull"):
        assert getattr(first, name).tobytes() == getattr(second, name).tobytes()


def test_groups_are_joined_inside_before_across() -> None:
    mesh = cross(150)
    group = (mesh.centroids[:, 0] > 1.5).astype(int)
    tree = cluster(mesh, group=group, cost=Hollow())
    mixed = [len(np.unique(group[tree.leaves(len(tree) + k)])) == 2 for k in range(len(tree) - 1)]
    assert mixed == sorted(mixed)
    assert 1 <= sum(mixed) < 10
    free = cluster(mesh, cost=Hollow())
    assert sum(len(np.unique(group[free.leaves(len(free) + k)])) == 2 for k in range(len(free) - 1)) > 10
    with pytest.raises(BadValue, match="at least one piece lies in two"):
        cluster(mesh, piece=np.zeros(len(mesh), int), group=group)


def bodies(*where: float) -> TetMesh:
    """Unit-edged balls of points along x, the k-th of radius k + 1."""
    points, tets, count = [], [], 0
    for k, x in enumerate(where):
        xyz = np.random.default_rng(k).normal(size=(30, 3)) * (k + 1) + [x, 0, 0]
        points.append(xyz)
        tets.append(Delaunay(xyz).simplices + count)
        count += len(xyz)
    return TetMesh(np.concatenate(points), np.concatenate(tets))


@pytest.mark.parametrize("cost", COSTS)
def test_separate_bodies_all_stay_and_are_joined_last(cost) -> None:
    mesh = bodies(0, 50, 150)
    tree = cluster(mesh, cost=cost)
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
    for cost in COSTS:
        tree = cluster(mesh, cost=cost)
        assert len(tree) == len(mesh)
        assert np.isfinite(tree.cost).all()
        assert tree.volume[tree.root] == pytest.approx(27e-6)
        assert tree.hull[tree.root] == pytest.approx(27e-6)


def test_labels_that_do_not_fit_are_refused() -> None:
    with pytest.raises(BadValue, match=r"piece needs one whole number per tet"):
        cluster(cross(), piece=[0, 1])
    with pytest.raises(BadValue, match=r"group needs one whole number per tet"):
        cluster(cross(), group=np.zeros(len(cross())))
