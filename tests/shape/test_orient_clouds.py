"""Normals of clouds without a mesh: outward on solids of known shape, in any frame and order."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from steelyard.shape.cloud import Cloud
from steelyard.shape.orient import consistent, oriented
from steelyard.shape.points.spacing import Neighbours, areas
from steelyard.shape.sides.discs import Discs
from steelyard.shape.sides.sheets import sheet_planes
from steelyard.shape.sides.tree import Tree
from steelyard.shape.sides.winding import Sight
from steelyard.shape.sites import Sites
from steelyard.spatial import Pose, Rotation
from steelyard.workshop.sheets import sheet_of
from steelyard.workshop.solids import rod


def ball(points: int = 600, radius: float = 0.05, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    normal = np.random.default_rng(seed).standard_normal((points, 3))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    return radius * normal, normal


def box(sides: tuple[float, float, float], points: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Points spread evenly over a box about the origin, and their normals."""
    rng = np.random.default_rng(seed)
    size = np.array(sides)
    weight = np.repeat(size.prod() / size, 2)
    face = rng.choice(6, points, p=weight / weight.sum())
    axis, side = face // 2, 2.0 * (face % 2) - 1
    xyz = rng.uniform(-0.5, 0.5, (points, 3)) * size
    normal = np.zeros((points, 3))
    normal[np.arange(points), axis] = side
    xyz[np.arange(points), axis] = side * size[axis] / 2
    return xyz, normal


@pytest.fixture(scope="module")
def plate() -> tuple[np.ndarray, np.ndarray]:
    return box((0.1, 0.05, 0.0015), 900)


def test_normals_of_a_ball_leave_it() -> None:
    xyz, normal = ball()
    cosine = (oriented(Cloud(xyz)).normals * normal).sum(1)
    assert cosine.min() > 0.8
    assert np.median(cosine) > 0.97


def test_both_sheets_of_a_plate_thinner_than_the_spacing_are_told_apart(plate: tuple[np.ndarray, np.ndarray]) -> None:
    xyz, normal = plate
    assert float(np.median(Neighbours.of(xyz).spacing)) > 0.0015
    assert ((oriented(Cloud(xyz)).normals * normal).sum(1) > 0.9).mean() > 0.9


def test_normals_of_a_wire_thinner_than_flat_pieces_can_follow_leave_it() -> None:
    along, about = np.random.default_rng(0).uniform(0, 2 * np.pi, (2, 500))
    spoke = np.stack([np.cos(along), np.sin(along), 0 * along], axis=1)
    normal = np.cos(about)[:, None] * spoke + np.sin(about)[:, None] * np.array([0.0, 0.0, 1.0])
    assert ((oriented(Cloud(0.1 * spoke + 0.005 * normal)).normals * normal).sum(1) > 0).mean() > 0.95


def test_normals_turn_with_the_cloud_and_do_not_care_about_its_order() -> None:
    xyz, _ = box((0.06, 0.04, 0.03), 700)
    plain = oriented(Cloud(xyz)).normals
    turn = Pose(Rotation.exp(np.array([0.4, -1.1, 0.7])), np.array([0.3, -2.0, 0.1]))
    moved = oriented(Cloud(turn.apply(xyz))).normals
    order = np.random.default_rng(1).permutation(len(xyz))
    mixed = oriented(Cloud(xyz[order])).normals
    assert ((moved * turn.rotation.apply(plain)).sum(1) > 0.9).mean() > 0.97
    assert ((mixed * plain[order]).sum(1) > 0.9).mean() > 0.97


def test_the_same_cloud_gives_the_same_bits(plate: tuple[np.ndarray, np.ndarray]) -> None:
    assert np.array_equal(oriented(Cloud(plate[0])).normals, oriented(Cloud(plate[0])).normals)


def test_normals_that_come_with_a_cloud_are_kept() -> None:
    xyz, normal = ball(200)
    assert np.allclose(oriented(Cloud(xyz, normals=normal)).normals, normal)


def test_leaves_seen_from_afar_do_as_well_as_their_points() -> None:
    xyz, normal = ball(800, 0.5)
    tree, queries = Tree.of(xyz), np.random.default_rng(2).uniform(-0.6, 0.6, (300, 3))
    targets = Tree.of(queries)
    area = np.full(len(xyz), np.pi / len(xyz))
    dipoles = (area[:, None] * normal)[tree.order].T.astype(np.float32)
    found = targets.back(Sight.of(targets, tree).winding_and_gradient(dipoles, 0.02)[0])
    away = queries[:, None] - xyz
    plain = -((away * normal).sum(2) * area / (4 * np.pi * ((away**2).sum(2) + 0.02**2) ** 1.5)).sum(1)
    assert np.abs(found - plain).max() < 0.02


def test_the_gradient_is_that_of_the_winding_number() -> None:
    xyz, normal = ball(300, 0.5)
    tree = Tree.of(xyz)
    dipoles = normal[tree.order].T.astype(np.float32) / 300
    here = Sight.of(tree, tree)
    gradient = here.winding_and_gradient(dipoles, 0.1)[1]
    for axis in range(3):
        step = 1e-2 * np.eye(3)[:, [axis]]
        up, down = (replace(tree, points=(tree.points + s * step).astype(np.float32)) for s in (1, -1))
        above, below = (replace(here, targets=moved).winding_and_gradient(dipoles, 0.1)[0] for moved in (up, down))
        assert np.abs((above - below) / 2e-2 - gradient[axis]).max() < 0.03 * np.abs(gradient).max()


def test_products_with_the_adjoint_agree() -> None:
    xyz = ball(16, 0.5)[0]  # two leaves of one block: all sums are point by point
    tree = Tree.of(xyz)
    here, rng = Sight.of(tree, tree), np.random.default_rng(3)
    dipoles, weights = rng.standard_normal((3, 16)).astype(np.float32), rng.standard_normal(16).astype(np.float32)
    there, back = here.winding_and_gradient(dipoles, 0.1)[0], here.adjoint(weights, 0.1)
    assert float(there @ weights) == pytest.approx(float((dipoles * back).sum()), rel=1e-4)


def test_discs_fill_a_slab_that_dipoles_leave_empty(plate: tuple[np.ndarray, np.ndarray]) -> None:
    xyz, normal = plate
    tree, middle = Tree.of(xyz), np.random.default_rng(4).uniform(-1, 1, (200, 3)) * (0.04, 0.02, 0)
    targets, area = Tree.of(middle), np.full(len(xyz), (0.1 * 0.05 + 0.15 * 0.0015) * 2 / len(xyz))
    sight = Sight.of(targets, tree)
    discs = Discs.on(tree, normal, area, 0.4, 1e-5).winding(sight)
    dipoles = sight.winding_and_gradient((area[:, None] * normal)[tree.order].T.astype(np.float32), 1e-5)[0]
    assert np.abs(discs - 1).mean() < 0.25 < np.abs(dipoles - 1).mean()


def test_planes_of_a_thin_plate_are_those_of_its_sheets(plate: tuple[np.ndarray, np.ndarray]) -> None:
    xyz, normal = plate
    near = Neighbours.of(xyz)
    plane, link = sheet_planes(xyz, near.index)
    assert (np.abs((plane * normal).sum(1)) > 0.99).mean() > 0.9
    across = normal[near.index] @ np.array([0, 0, 1.0]) * normal[:, 2:] < 0
    assert np.abs(link[across]).mean() < 0.25 * np.abs(link[~across]).mean()


def test_areas_add_up_on_both_sheets(plate: tuple[np.ndarray, np.ndarray]) -> None:
    xyz, normal = plate
    assert areas(Neighbours.of(xyz), normal).sum() == pytest.approx(2 * 0.1 * 0.05, rel=0.25)


@pytest.mark.parametrize(("points", "seed"), [(260, 4), (400, 7)])
def test_steps_on_few_points_of_a_wire_do_not_grow_beyond_all_numbers(points: int, seed: int) -> None:
    """A few blocks of its points tell the length of a step by chance."""
    wire = sheet_of("wire", rod(1, 0, 200), np.random.default_rng(seed), points)
    found = consistent(Sites.of(wire.cloud).sight, Sites.of(wire.cloud).spacing)  # a warning of an overflow fails
    assert np.allclose(np.linalg.norm(found, axis=1), 1, atol=1e-5)
