"""What points of a surface say of one another's sides."""

from __future__ import annotations

import numpy as np
import pytest

from steelyard.shape.cells.complex import Complex
from steelyard.shape.points.spacing import Neighbours
from steelyard.shape.sides.sheets import sheet_planes
from steelyard.shape.sides.ties import Ties
from steelyard.shape.sides.tree import Tree
from steelyard.workshop.sampling import spread_evenly
from steelyard.workshop.sheets import sheet_of
from steelyard.workshop.solids import ring

Surface = tuple[np.ndarray, np.ndarray, Neighbours, Complex]


@pytest.fixture(scope="module")
def tube() -> Surface:
    mesh = sheet_of("tube", ring(15, 13.5, 0, 120), np.random.default_rng(0), 10).mesh
    xyz, normals, _ = spread_evenly(mesh, np.random.default_rng(0), 2000)
    xyz = xyz / np.linalg.norm(np.ptp(xyz, axis=0))
    return xyz, normals, Neighbours.of(xyz), Complex.of(xyz, Tree.of(xyz).order)


def ties(tube: Surface, normals: np.ndarray) -> Ties:
    xyz, _, near, complex = tube
    plane, link = sheet_planes(xyz, near.index)
    sign = np.sign((plane * normals).sum(1))
    link = link * sign[:, None] * sign[near.index]
    return Ties.of(xyz, normals, near.index, link, complex, near.spacing)


def test_true_normals_keep_their_ties(tube: Surface) -> None:
    found = ties(tube, tube[1])
    assert found.torn < 0.05
    assert (found.settled(10, 2.0) < 0).mean() < 0.02


def test_points_turned_the_wrong_way_are_found(tube: Surface) -> None:
    turned = np.random.default_rng(1).random(len(tube[0])) < 0.15
    found = ties(tube, np.where(turned[:, None], -tube[1], tube[1]))
    assert found.torn > 0.2
    assert ((found.settled(10, 2.0) < 0) == turned).mean() > 0.97


def test_a_wall_turned_inside_out_is_known_from_its_outside(tube: Surface) -> None:
    found = ties(tube, -tube[1])
    assert found.torn < 0.05
    seen = found.outward != 0
    assert seen.sum() > 100
    assert (found.outward[seen] < 0).mean() > 0.9


def test_the_hull_of_all_points_shows_which_way_is_out(tube: Surface) -> None:
    xyz, normals, near, complex = tube
    spacing = near.spacing
    flux = complex.flux(xyz, normals, spacing)
    assert flux > 0.3
    assert complex.flux(xyz, -normals, spacing) == pytest.approx(-flux)
