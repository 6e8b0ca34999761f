"""Hulls: Qhull as the witness, on random, gridded, noisy, flat and thin sets; faults are said, never hidden."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from steelyard.shape.hull import TOLERANCE, hull_volume, hull_work, qhull
from steelyard.shape.hulls.exact_sign import determinant
from steelyard.spatial import Rotation


def convex_hull(points: np.ndarray) -> tuple[float, np.ndarray]:
    """Volume of the hull of points (N, 3), and which rows are its vertices, rising."""
    work = hull_work(len(points))
    tolerance = TOLERANCE * float(np.ptp(points, axis=0).max())
    volume, vertices = hull_volume(points, np.arange(len(points)), len(points), tolerance, work)
    assert vertices >= 0
    return volume, np.sort(work.kept[:vertices])


KINDS = ("ball", "sphere", "grid", "turned grid", "noisy grid", "thin", "needle", "repeated", "midpoints")


def made(kind: str, count: int, rng: np.random.Generator) -> np.ndarray:
    points = rng.normal(size=(count, 3))
    turn = Rotation.exp(rng.normal(size=3))
    if kind == "sphere":
        return points / np.linalg.norm(points, axis=1, keepdims=True)
    if kind == "grid":
        return np.floor(rng.uniform(0, rng.integers(2, 7), (count, 3)))
    if kind == "turned grid":
        return turn.apply(np.floor(rng.uniform(0, 4, (count, 3))) * rng.uniform(0.1, 1, 3))
    if kind == "noisy grid":
        return np.floor(rng.uniform(0, 4, (count, 3))) + 10.0 ** rng.uniform(-16, -6) * points
    if kind == "thin":
        return turn.apply(points * [1, 1, 1e-5])
    if kind == "needle":
        return points * [1, 1e-4, 1e-4]
    if kind == "repeated":
        return points[rng.integers(0, max(count // 3, 1), count)]
    if kind == "midpoints":
        return np.concatenate([points, (points[::2][: count // 2] + points[1::2]) / 2])
    return points


@pytest.mark.parametrize("kind", KINDS)
def test_volume_is_qhulls(kind: str) -> None:
    rng = np.random.default_rng(KINDS.index(kind))
    for _ in range(150):
        points = made(kind, int(rng.integers(4, 80)) // 2 * 2, rng)
        work = hull_work(len(points))
        size = float(np.ptp(points, axis=0).max())
        volume, vertices = hull_volume(points, np.arange(len(points)), len(points), TOLERANCE * size, work)
        assert vertices > 0
        assert volume == pytest.approx(qhull(points)[0], rel=1e-9, abs=1e-12 * size**3)


@pytest.mark.parametrize("kind", ["ball", "grid", "noisy grid"])
def test_vertices_span_the_same_hull(kind: str) -> None:
    rng = np.random.default_rng(7)
    for _ in range(50):
        points = made(kind, 60, rng)
        volume, vertices = convex_hull(points)
        assert ConvexHull(points[vertices]).volume == pytest.approx(volume, rel=1e-9)
    assert len(convex_hull(made("sphere", 60, rng))[1]) == 60


def test_closed_forms() -> None:
    cube = np.stack(np.meshgrid([0, 1], [0, 2], [0, 3]), -1).reshape(-1, 3).astype(float)
    volume, vertices = convex_hull(np.concatenate([cube, cube / 2 + 0.2]))
    assert volume == pytest.approx(6, rel=1e-14)
    assert vertices.tolist() == list(range(8))
    assert convex_hull(np.concatenate([np.zeros((1, 3)), np.eye(3)]))[0] == pytest.approx(1 / 6, rel=1e-15)


@pytest.mark.parametrize("flat", ["point", "line", "plane", "few"])
def test_flat_sets_have_no_volume_and_keep_all_points(flat: str) -> None:
    points = np.random.default_rng(1).normal(size=(3 if flat == "few" else 30, 3))
    points[:, {"point": 0, "line": 1, "plane": 2, "few": 3}[flat] :] = 0
    points = Rotation.exp([0.3, 0.2, 0.1]).apply(points)
    volume, vertices = convex_hull(points)
    assert volume == 0
    assert len(vertices) == len(points)
    assert qhull(points)[0] == pytest.approx(0, abs=1e-14)


@given(st.integers(0, 10_000), st.floats(-12, 12))
def test_volume_scales_and_does_not_care_about_order(seed: int, power: float) -> None:
    rng = np.random.default_rng(seed)
    points = made(KINDS[seed % 5], 40, rng)
    volume = convex_hull(points)[0]
    assert convex_hull(rng.permutation(points))[0] == pytest.approx(volume, rel=1e-10, abs=1e-13)
    assert convex_hull(points * 10**power)[0] == pytest.approx(volume * 10 ** (3 * power), rel=1e-9)


def test_the_sign_is_exact_where_doubles_cannot_tell() -> None:
    tiny = 2.0**-52
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1 / 3, 1 / 3, 0], [1 / 3, 1 / 3, tiny**3]])
    assert determinant(points, 0, 1, 2, 3) == 0
    assert determinant(points, 0, 1, 2, 4) > 0
    assert determinant(points, 0, 2, 1, 4) < 0
    line = np.array([[0.1, 0.2, 0.3], [0.2, 0.4, 0.6], [0.3, 0.6, 0.9], [0.7, 1.4, 2.1 + 4 * tiny]])
    line = line + 4 - 4  # so that differences are exact
    rows = [[Fraction(float(x)) for x in row] for row in line]
    u, v, w = ([a - b for a, b in zip(row, rows[0], strict=True)] for row in rows[1:])
    exact = sum((u[i] * v[j] - u[j] * v[i]) * w[k] for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)))
    assert np.sign(determinant(line, 0, 1, 2, 3)) == np.sign(float(exact))


def test_numbers_that_are_not_finite_are_a_fault() -> None:
    for bad in (np.nan, np.inf, 1e200):
        points = np.random.default_rng(0).normal(size=(10, 3)) * (bad if bad == 1e200 else 1)
        points[3, 1] *= bad if bad != 1e200 else 1
        assert hull_volume(points, np.arange(10), 10, 0.0, hull_work(10))[1] == -1


def test_digits_that_vanish_in_products_are_no_fault() -> None:
    rng = np.random.default_rng(1)
    for _ in range(4000):
        points = made("grid", int(rng.integers(8, 60)), rng)
        points += rng.integers(-2, 3, points.shape) * np.spacing(points)
        assert hull_volume(points, np.arange(len(points)), len(points), 0.0, hull_work(len(points)))[1] > 0


def test_a_surface_that_does_not_close_is_a_fault() -> None:
    points = np.random.default_rng(0).normal(size=(60, 3))
    work = hull_work(60)
    room_for_twelve_faces = work._replace(face=work.face[:12].copy())
    assert hull_volume(points, np.arange(60), 60, TOLERANCE, room_for_twelve_faces)[1] == -1
