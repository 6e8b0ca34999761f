"""What views say about points: the same as asking them one by one, and exact order statistics."""

from __future__ import annotations

import numpy as np
import pytest

from steelyard.errors import BadValue
from steelyard.shape.carving import carved
from steelyard.shape.cloud import Cloud
from steelyard.shape.known_space import SeenSpace
from steelyard.shape.points.medians import middle_mean, quantile
from steelyard.shape.scans import sight_lines
from steelyard.shape.scans.depth_images import Images, pixel_of
from steelyard.shape.scans.view_planes import INCIDENCE, table_noise, table_planes
from steelyard.shape.volume import enclose

CAMERA = np.array([60.0, 60.0, 32.0, 24.0])
UNIT, NOISE = 0.001, 0.005


def looking_down(count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Depth images of a table with a step, some pixels lost, from cameras above that look down."""
    R = np.tile(np.diag([1.0, -1.0, -1.0]), (count, 1, 1))
    p = np.column_stack([rng.uniform(-0.1, 0.1, (count, 2)), rng.uniform(0.4, 0.6, count)])
    v, u = np.mgrid[:48, :64]
    depth = np.empty((count, 48, 64), np.uint16)
    for k in range(count):
        x = p[k, 0] + (u - CAMERA[2]) / CAMERA[0] * p[k, 2]
        depth[k] = np.round((p[k, 2] - 0.03 * (x > 0) + rng.normal(0, 0.001, u.shape)) / UNIT)
    depth[rng.random(depth.shape) < 0.1] = 0
    assert v.shape == u.shape
    return depth, R, p


def pixels(depth: np.ndarray, R: np.ndarray, p: np.ndarray, point: np.ndarray) -> list[tuple[int, float, int, int]]:
    found = [(k, *pixel_of(Images(depth, UNIT, CAMERA, R, p), k, point)) for k in range(len(depth))]
    return [(k, z, u, v) for k, z, u, v in found if 0 <= u < depth.shape[2] and 0 <= v < depth.shape[1]]


@pytest.mark.parametrize("count", [1, 7, 200])
def test_how_many_views_saw_past_a_point_is_what_each_of_them_says(count: int) -> None:
    rng = np.random.default_rng(count)
    depth, R, p = looking_down(count, rng)
    points = rng.uniform([-0.3, -0.3, -0.02], [0.3, 0.3, 0.1], (300, 3))
    said = [
        sum(depth[k, v, u] * UNIT > z + 3 * NOISE * z * z for k, z, u, v in pixels(depth, R, p, point))
        for point in points
    ]
    for enough in (1, 3):
        found = sight_lines.seen_past(Images(depth, UNIT, CAMERA, R, p), points, 0.0, NOISE, enough)[:, 0]
        assert np.array_equal(found, np.minimum(said, enough))


def test_views_together_tell_on_which_side_of_a_surface_a_point_lies_within_its_noise() -> None:
    rng = np.random.default_rng(3)
    depth, R, p = looking_down(100, rng)
    points = np.column_stack([rng.uniform(-0.1, -0.02, (200, 2)), rng.choice([-0.0005, 0.0005], 200)])
    images = Images(depth, UNIT, CAMERA, R, p)
    past, outer = sight_lines.seen_past(images, points, 0.0, NOISE, 3).T
    assert (past < 3).all()
    assert np.mean((outer > 0) == (points[:, 2] > 0)) > 0.97


@pytest.mark.parametrize("count", [1, 7, 200])
def test_points_settle_on_the_middle_of_what_their_views_measure(count: int) -> None:
    depth, R, p = looking_down(count, np.random.default_rng(count))
    for start in ([-0.1, 0.05, 0.001], [0.1, -0.05, 0.031], [0.1, 0.05, -0.2]):
        point, up = np.array([start]), np.array([[0.0, 0, 1]])
        heights, past = [], 0
        for k, z, u, v in pixels(depth, R, p, point[0]):
            away = point[0] - p[k]
            cosine = -away[2] / np.linalg.norm(away)
            measured = depth[k, v, u] * UNIT
            over, limit = p[k, 2] - measured - point[0, 2], 0.002 + 4 * NOISE * z * z * cosine
            if cosine >= sight_lines.FACING and measured > 0 and over <= limit:
                past += over < -limit
                heights += [over] if over >= -limit else []
        support = sight_lines.settled(Images(depth, UNIT, CAMERA, R, p), moved := point.copy(), up, 0.002, NOISE, 0)
        assert np.array_equal(moved, point)
        assert support[0, :2].tolist() == [len(heights), past]
        if heights:
            assert support[0, 2] == pytest.approx(np.sqrt(np.mean(np.square(heights))))
            sight_lines.settled(Images(depth, UNIT, CAMERA, R, p), moved, up, 0.002, NOISE, 1)
            low = len(heights) // 4
            middle = np.sort(heights)[low : len(heights) - low]
            assert moved[0] == pytest.approx(point[0] + [0, 0, middle.mean()], abs=1e-12)


@pytest.mark.parametrize("levels", [1, 3, 10**9])
def test_order_statistics_are_those_of_sorted_values_with_ties_or_without(levels: int) -> None:
    rng = np.random.default_rng(levels)
    for count in (1, 2, 3, 4, 5, 31, 127, 1000):
        values = rng.integers(0, levels, count).astype(float)
        low = count // 4
        assert middle_mean(values.copy(), count) == pytest.approx(np.sort(values)[low : count - low].mean(), rel=1e-12)
        for share in (0.0, 0.25, 0.5, 0.75, 1.0):
            assert quantile(values.copy(), count, share) == pytest.approx(np.quantile(values, share), rel=1e-12)


def test_the_noise_of_every_view_is_told_about_its_own_plane() -> None:
    rng = np.random.default_rng(0)
    view = np.repeat(np.arange(4), [200, 20, 300, 250])
    depth, std = rng.uniform(0.4, 0.6, len(view)), np.array([0.004, 0.004, 0.008, 0.002])[view]
    xy = rng.uniform(-0.2, 0.2, (len(view), 2))
    height = 0.001 * view + 0.01 * xy[:, 0] + depth**2 * rng.normal(0, std)
    height[::40] += 0.015  # what lies on the table
    sampled = np.column_stack([xy, height, depth, view])
    found = table_planes(sampled, np.column_stack([xy, height]), 0.05)
    assert found[:, 0] == pytest.approx([0, 2, 3])  # the second has too few points
    assert found[:, 1:4] == pytest.approx(np.array([[0, 0.01, 0], [0.002, 0.01, 0], [0.003, 0.01, 0]]), abs=2e-3)
    assert found[:, 4] == pytest.approx([0.004, 0.008, 0.002], rel=0.2)


def test_a_table_that_ends_within_reach_tells_its_noise_beside_what_lies_on_it() -> None:
    rng = np.random.default_rng(0)
    xy, view = rng.uniform(-0.1, 0.1, (4000, 2)), np.repeat(np.arange(4.0), 1000)
    on = np.abs(xy) < [0.06, 0.045]
    height = np.where(on.all(1), 0.006, 0.0) + 0.35**2 * 0.004 * rng.normal(size=4000)
    xyz = np.column_stack([xy, height])
    sampled = np.column_stack([xyz, np.full(4000, 0.35), view])
    assert table_noise(sampled, xyz, 0.35, 1e-4, 4) == pytest.approx(0.004 / INCIDENCE, rel=0.15)


def test_cells_before_a_surface_by_less_than_its_noise_stay_as_the_solid_has_them() -> None:
    ball = np.random.default_rng(0).normal(size=(400, 3))
    ball *= 0.05 / np.linalg.norm(ball, axis=1, keepdims=True)
    ball[:, :2] *= 0.5 + 10 * np.abs(ball[:, 2:])  # with a waist
    solid = enclose(Cloud(ball))
    hidden, before = (carved(solid, SeenSpace(lambda points, v=v: np.full(len(points), v))) for v in (0.0, 0.2))
    assert before.mesh.volume == pytest.approx(solid.mesh.volume)
    assert hidden.mesh.volume > 1.05 * before.mesh.volume


def test_carving_twice_by_the_same_views_changes_nothing_and_needs_the_complex() -> None:
    ball = np.random.default_rng(0).normal(size=(400, 3))
    solid = enclose(Cloud(0.05 * ball / np.linalg.norm(ball, axis=1, keepdims=True)))
    once = carved(solid, SeenSpace(lambda points: points[:, 2] > 0.0))
    assert 0.4 < once.mesh.volume / solid.mesh.volume < 0.6
    twice = carved(once, SeenSpace(lambda points: points[:, 2] > 0.0))
    assert twice.mesh.volume == pytest.approx(once.mesh.volume)
    assert len(once.sure) == len(once.mesh)
    with pytest.raises(BadValue, match="fresh from a cloud"):
        carved(
            type(solid)(solid.mesh, solid.cloud, solid.sure, 0.1, 0.001, ()), SeenSpace(lambda points: points[:, 2] > 0)
        )
