"""The Delaunay complex, against Qhull's and against its own laws."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial import Delaunay

from steelyard.shape.cells.complex import Complex
from steelyard.shape.cells.delaunay import tetrahedra, thinly
from steelyard.shape.sides.tree import Tree


def _ball(rng: np.random.Generator) -> np.ndarray:
    return rng.normal(size=(500, 3))


def _sphere(rng: np.random.Generator) -> np.ndarray:
    xyz = rng.normal(size=(500, 3))
    return xyz / np.linalg.norm(xyz, axis=1, keepdims=True) + 1e-7 * rng.normal(size=xyz.shape)


def _grid(rng: np.random.Generator) -> np.ndarray:
    xyz = np.stack(np.meshgrid(*[np.linspace(0, 1, 8)] * 3), -1).reshape(-1, 3)
    return xyz + 1e-7 * rng.uniform(-1, 1, xyz.shape)


def _skew_lines(rng: np.random.Generator) -> np.ndarray:
    """Points that all join all: cells grow with the square of their number."""
    t = np.linspace(0, 1, 60)
    none = np.zeros_like(t)
    lines = np.concatenate([np.stack([t, none, none], 1), np.stack([none + 0.5, t, none + 1], 1)])
    return lines + 1e-7 * rng.uniform(-1, 1, lines.shape)


CLOUDS = [_ball, _sphere, _grid]


def _cells(simplices: Any) -> set[tuple[int, ...]]:
    return set(map(tuple, np.sort(simplices, axis=1).tolist()))


def _made(xyz: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    made = tetrahedra(xyz, thinly(Tree.of(xyz).order))
    assert made is not None
    return made


@pytest.mark.parametrize("shape", CLOUDS)
def test_cells_are_those_of_qhull(shape: Any) -> None:
    xyz = shape(np.random.default_rng(0))
    assert _cells(_made(xyz)[0]) == _cells(Delaunay(xyz).simplices)


@pytest.mark.parametrize("shape", CLOUDS)
def test_cells_have_positive_volume_and_fill_the_hull(shape: Any) -> None:
    xyz = shape(np.random.default_rng(1))
    simplices, beside = _made(xyz)
    volumes = np.linalg.det(xyz[simplices[:, 1:]] - xyz[simplices[:, :1]]) / 6
    assert (volumes > 0).all()
    whole = xyz[Delaunay(xyz).simplices]
    assert volumes.sum() == pytest.approx(np.abs(np.linalg.det(whole[:, 1:] - whole[:, :1])).sum() / 6)
    cell, corner = np.nonzero(beside >= 0)
    other = beside[cell, corner]
    assert ((beside[other] == cell[:, None]).sum(1) == 1).all()
    shared = (simplices[cell][:, :, None] == simplices[other][:, None]).any(2)
    assert (shared.sum(1) == 3).all()
    assert not shared[np.arange(len(cell)), corner].any()


def test_the_order_of_insertion_changes_nothing() -> None:
    xyz = _ball(np.random.default_rng(2))
    shuffled = tetrahedra(xyz, np.random.default_rng(3).permutation(len(xyz)))
    assert shuffled is not None
    assert _cells(shuffled[0]) == _cells(_made(xyz)[0])


@pytest.mark.parametrize("count", [1, 2, 5, 64, 65, 1000])
def test_rounds_hold_every_point_once(count: int) -> None:
    order = np.random.default_rng(4).permutation(count)
    assert np.array_equal(np.sort(thinly(order)), np.arange(count))


@pytest.mark.parametrize(
    "xyz", [np.round(_grid(np.random.default_rng(0)), 3), np.zeros((30, 3))], ids=["grid", "point"]
)
def test_points_with_many_complexes_are_left_to_others(xyz: np.ndarray) -> None:
    assert tetrahedra(xyz, thinly(np.arange(len(xyz)))) is None


def test_more_cells_than_there_is_room_for_are_left_to_others() -> None:
    xyz = _skew_lines(np.random.default_rng(0))
    assert tetrahedra(xyz, thinly(Tree.of(xyz).order)) is None
    made = Complex.of(xyz, Tree.of(xyz).order)
    assert len(made.simplices) > 59**2


@pytest.mark.parametrize("shape", [_ball, _grid, _skew_lines])
def test_edges_and_hull_are_those_of_qhull(shape: Any) -> None:
    xyz = shape(np.random.default_rng(5))
    made = Complex.of(xyz, Tree.of(xyz).order)
    start, other = made.start, made.other
    cells = made.simplices
    joined = {tuple(sorted(pair)) for i in range(4) for j in range(i) for pair in cells[:, [i, j]].tolist()}
    found = {(min(i, j), max(i, j)) for i in range(len(xyz)) for j in other[start[i] : start[i + 1]].tolist()}
    assert found == joined
    assert len(other) == 2 * len(joined)
    twice = np.linalg.norm(made.across, axis=1)
    middle = xyz[made.hull].mean(1) - xyz.mean(0)
    assert ((middle * made.across).sum(1) > -1e-6 * twice).all()
    # Areas of a closed surface sum to nothing, as vectors.
    assert np.abs(made.across.sum(0)).max() < 1e-5 * twice.sum()
