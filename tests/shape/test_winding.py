"""Sums over elements by a kd tree against sums one by one; what discs do to targets, forward and transposed."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import Delaunay

from steelyard.shape.cells.cells import cells, votes_of
from steelyard.shape.sides.discs import Discs
from steelyard.shape.sides.tree import Tree
from steelyard.shape.sides.winding import Sight
from steelyard.shape.tets import TetMesh

WIDTH = 0.02


def ball(count: int = 700, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Return points (N, 3) of a sphere about the origin and their normals."""
    normal = np.random.default_rng(seed).standard_normal((count, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return 0.3 * normal, normal


@pytest.mark.parametrize("count", [1, 8, 9, 17, 700])
def test_the_tree_holds_every_point_once_in_leaves_of_eight(count: int) -> None:
    xyz = ball(count)[0]
    tree = Tree.of(xyz)
    assert sorted(tree.order) == list(range(count))
    assert np.allclose(tree.points, xyz[tree.order].T, atol=1e-6)
    assert np.diff(tree.start).max() <= 8
    assert tree.blocks[0] == 0
    assert tree.blocks[-1] == count


def test_repeated_points_make_a_tree_too() -> None:
    assert len(Tree.of(np.zeros((100, 3))).order) == 100


def test_sums_by_the_tree_are_those_one_by_one() -> None:
    xyz, normal = ball()
    tree = Tree.of(xyz)
    sight = Sight.of(tree, tree)
    dipoles = (normal[tree.order] * 4 * np.pi * 0.09 / len(xyz)).T
    away = tree.points[:, :, None].astype(float) - tree.points[:, None, :]
    kernel = away / ((away**2).sum(0) + WIDTH**2) ** 1.5 / (4 * np.pi)
    found, gradient = sight.winding_and_gradient(dipoles, WIDTH)
    assert np.allclose(found, -np.einsum("kij,kj->i", kernel, dipoles), atol=0.02)
    assert gradient.shape == (3, len(xyz))
    weights = np.random.default_rng(1).uniform(size=len(xyz)).astype(np.float32)
    assert np.allclose(sight.adjoint(weights, WIDTH), np.einsum("kij,j->ki", kernel, weights), rtol=0.02, atol=20.0)
    alone = sight.winding(dipoles, WIDTH)
    assert np.allclose(alone, found, atol=1e-6)
    some = sight.winding(dipoles, WIDTH, 4)
    rows = tree.of_blocks(4)
    assert np.array_equal(some[rows], alone[rows])
    assert not np.delete(some, rows).any()


def test_discs_on_a_ball_wind_once_inside_and_not_at_all_outside() -> None:
    xyz, normal = ball(2000)
    discs = Discs.on(Tree.of(xyz), normal, np.full(len(xyz), 4 * np.pi * 0.09 / len(xyz)), 0.05, 1e-4)
    inside = np.random.default_rng(2).uniform(-0.1, 0.1, (100, 3))
    targets = Tree.of(np.concatenate([inside, inside + 0.6]))
    found = targets.back(discs.winding(Sight.of(targets, discs.tree)))
    assert np.allclose(found[:100], 1, atol=0.06)
    assert np.allclose(found[100:], 0, atol=0.06)


def test_the_response_of_discs_is_their_winding_and_its_transpose() -> None:
    xyz, normal = ball()
    tree = Tree.of(xyz)
    sight = Sight.of(tree, tree)
    discs = Discs.on(tree, normal, np.full(len(xyz), 4 * np.pi * 0.09 / len(xyz)), 0.4, 1e-4)
    response = discs.response(sight)
    assert np.allclose(response.winding(np.ones(len(xyz))), discs.winding(sight), atol=1e-5)
    rng = np.random.default_rng(3)
    share, weights = rng.normal(size=(2, len(xyz)))
    assert weights @ response.winding(share) == pytest.approx(share @ response.adjoint(weights), rel=1e-4, abs=1e-4)
    rows = tree.of_blocks(4)
    assert np.array_equal(response.winding(share, 4)[rows], response.winding(share)[rows])


def test_cells_of_a_complex_are_turned_and_know_their_neighbours() -> None:
    xyz, normal = ball(300)
    xyz = np.concatenate([xyz, 0.5 * xyz])
    made = Delaunay(xyz)
    tets, neighbours, volumes, centres = cells(xyz, made.simplices, made.neighbors)
    votes = votes_of(xyz, np.concatenate([normal, normal]), tets, centres)
    again = TetMesh(xyz, tets)
    assert np.array_equal(again.tets, tets)
    assert np.allclose(again.volumes, volumes)
    assert np.array_equal(again.neighbours, neighbours)
    assert np.allclose(again.centroids, centres)
    away = centres[:, None] - xyz[tets]
    cosine = (away * np.concatenate([normal, normal])[tets]).sum(2) / np.linalg.norm(away, axis=2)
    assert np.allclose(votes, -cosine.mean(1))
    chosen = TetMesh.known(xyz, tets, volumes, neighbours).chosen(volumes > np.median(volumes))
    assert np.array_equal(chosen.neighbours, TetMesh(xyz, chosen.tets).neighbours)
