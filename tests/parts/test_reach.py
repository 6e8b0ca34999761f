"""The bound of a hull: never above the hull, that hull where no points are level; faces of hulls."""

from __future__ import annotations

import numpy as np
import pytest

from steelyard.bench.shapes.hull_sets import KINDS
from steelyard.parts.htc.reach import MOST, reach, room
from steelyard.parts.htc.small_hulls import five_faces, four_faces
from steelyard.parts.hulls import both, hulls_of, keep, keep_in_place
from steelyard.shape.hull import TOLERANCE, hull_volume, hull_work, qhull


def grown(points: np.ndarray, first: int, stamp: int = 1, space=None) -> tuple[float, float, float]:
    """Return the bound for points, from the hull of the first few, and the hulls of these and of all by Qhull."""
    size = float(np.ptp(points, axis=0).max())
    rows, work = np.arange(len(points), dtype=np.int32), hull_work(len(points))
    hull, kept = hull_volume(points, rows, first, TOLERANCE * size, work)
    assert kept > 0
    face = np.full(6 * kept, -1, np.int16)
    if hull > 0:
        face[: 3 * (2 * kept - 4)] = work.stack[: 2 * kept - 4, :3].ravel()
    rows = np.r_[work.kept[:kept], rows[first:]]
    bound = reach(points, rows, kept, len(rows), face, 0, hull, stamp, room() if space is None else space)
    return bound, qhull(points[:first])[0], qhull(points)[0]


@pytest.mark.parametrize("kind", KINDS)
def test_the_bound_lies_between_the_hulls_of_some_and_of_all(kind: str) -> None:
    rng, space, stamp = np.random.default_rng(7), room(), 1
    for _ in range(150):
        points = np.ascontiguousarray(KINDS[kind](rng, int(rng.integers(6, 40))))
        bound, few, every = grown(points, int(rng.integers(4, len(points))), stamp, space)
        stamp += len(points)
        slack = 1e-10 * max(every, 1e-3 * np.ptp(points, axis=0).max() ** 3)
        assert few - slack <= bound <= every + slack


@pytest.mark.parametrize("count", [6, 12, 40, 200, MOST])
def test_without_level_points_the_bound_is_the_hull(count: int) -> None:
    rng = np.random.default_rng(count)
    for spread in (1.0, 1e-3):
        points = rng.normal(size=(count, 3))
        points /= np.linalg.norm(points, axis=1, keepdims=True) if spread == 1 else 1
        bound, _, every = grown(points * [1, 1, spread] + 5, max(4, count // 3))
        assert bound == pytest.approx(every, rel=1e-11)


def test_a_point_that_swallows_most_faces_leaves_few() -> None:
    ball = np.random.default_rng(0).normal(size=(100, 3))
    far = np.array([[0, 0, 50.0], [0, 1, 90.0], [40, 1, -3]])
    assert grown(np.r_[ball, far], 100)[0] == pytest.approx(qhull(np.r_[ball, far])[0], rel=1e-11)


def _volume(points: np.ndarray, faces: np.ndarray) -> float:
    a, b, c = np.moveaxis(points[faces[faces[:, 0] >= 0]] - points.mean(0), 1, 0)
    return float((np.cross(a, b) * c).sum() / 6)


def test_faces_of_four_and_five_points_look_outward_and_close() -> None:
    rng, corner, point = np.random.default_rng(3), np.zeros((8, 4), np.int32), np.zeros((8, 3), np.int32)
    inside = 0
    for _ in range(200):
        points = np.ascontiguousarray(rng.normal(size=(5, 3)))
        rows = rng.permutation(5).astype(np.int32)
        hulls = hulls_of(np.array([0, 4]), rows[:4], 1, 5)
        four_faces(points, hulls, 0)
        assert _volume(points[rows], hulls.face[:12].reshape(4, 3)) == pytest.approx(qhull(points[rows[:4]])[0])
        five_faces(points, rows, point, corner)
        assert _volume(points[rows], corner[:6, :3]) == pytest.approx(qhull(points)[0])
        assert np.array_equal(point[:5, 2], rows)
        inside += corner[5, 0] < 0
    assert 5 < inside < 100


def test_room_is_used_again_when_it_is_full() -> None:
    """Of sixteen tets a chain is made, then it is joined again and again: what is left keeps its hull."""
    rng = np.random.default_rng(1)
    points = np.ascontiguousarray(rng.normal(size=(64, 3)))
    count = 16
    member = np.arange(64).reshape(count, 4)
    hulls, work = hulls_of(np.arange(0, 65, 4), member.ravel(), 2 * count - 1, 64), hull_work(64)
    gone, truth = np.zeros(2 * count - 1, bool), {k: member[k] for k in range(count)}
    for k in range(count):
        four_faces(points, hulls, k)
    for c in range(count, 2 * count - 1):
        a, b = (k for k in sorted(truth)[:: len(truth) - 1])
        rows = np.unique(np.r_[truth.pop(a), truth.pop(b)])
        assert sorted(hulls.rows[: both(hulls, a, b)]) == rows.tolist()
        volume, kept = hull_volume(points, hulls.rows, len(rows), TOLERANCE, work)
        gone[[a, b]] = True
        keep(hulls, c, gone, work.point, work.stack, kept, True)
        truth[c] = np.sort(work.kept[:kept])
        for k, own in truth.items():
            at, length = hulls.offset[k], hulls.length[k]
            vertices = hulls.vertex[at : at + length]
            assert np.array_equal(np.sort(vertices), own)
            faces = hulls.face[6 * at : 6 * at + 3 * (2 * length - 4)].reshape(-1, 3)
            assert _volume(points[vertices], faces) == pytest.approx(qhull(points[own])[0])
        assert volume == pytest.approx(qhull(points[rows])[0])


def test_a_flat_cluster_has_no_face() -> None:
    points = np.ascontiguousarray(np.random.default_rng(0).normal(size=(6, 3)) * [1, 1, 0])
    hulls, work = hulls_of(np.array([0, 6]), np.arange(6), 1, 6), hull_work(6)
    volume, kept = hull_volume(points, hulls.vertex, 6, TOLERANCE, work)
    keep_in_place(hulls, 0, work.point, work.stack, kept, volume > 0)
    assert (volume, kept) == (0.0, 6)
    assert (hulls.face[:36] == -1).all()
