"""Where a scan lies once its cameras were moved: errors of an arm average out, one at the wrist is found."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial import cKDTree
from tools_seen import HAND_EYE, askew, right

from steelyard.shape.scans.placement import moved_m, placement
from steelyard.simulate.camera import disturbed, wrist_arc
from steelyard.spatial import Pose, Rotation

MIDDLE = np.array([0.01, -0.02, 0.03])
Given = Callable[[Pose, np.random.Generator], Pose]


def each(X: Pose, rng: np.random.Generator) -> Pose:
    return disturbed(X, 4.0, 1.0, rng)


def swayed(X: Pose, rng: np.random.Generator) -> Pose:
    """Return poses of an arm whose errors change slowly along its way."""
    way = 2 * np.pi * np.linspace(0, 1, len(X.position))[:, None]
    waves = [rng.normal(size=6) * np.sin(n * way + rng.uniform(0, 2 * np.pi, 6)) for n in (1, 2, 3)]
    wave = np.sum(waves, axis=0) / np.sqrt(4.5)
    return X @ Pose(Rotation.exp(np.radians(1.0) * wave[:, :3]), 4e-3 * wave[:, 3:])


def both(X: Pose, rng: np.random.Generator) -> Pose:
    return disturbed(X @ HAND_EYE, 1.0, 0.3, rng)


def moved_by(rng: np.random.Generator) -> Pose:
    """Return a motion of the whole scan, which its views cannot tell."""
    return Pose(Rotation.exp(0.01 * rng.normal(size=3)), 0.002 * rng.normal(size=3))


@pytest.mark.parametrize(("long", "shown"), [(1.0, False), (2.0, True)], ids=["round", "flattened"])
def test_turns_that_a_surface_does_not_show_do_not_count_as_moves(long: float, shown: bool) -> None:
    rng = np.random.default_rng(0)
    angle, z = rng.uniform(0, 2 * np.pi, 2000), rng.uniform(0, 0.1, 2000)
    xyz = np.stack([0.03 * long * np.cos(angle), 0.03 * np.sin(angle), z], 1)
    normal = np.stack([np.cos(angle), long * np.sin(angle), 0 * z], 1)
    normal = normal / np.linalg.norm(normal, axis=1, keepdims=True) + 0.05 * rng.normal(size=xyz.shape)
    given = wrist_arc(xyz.mean(0), 0.35, 36)
    turns = np.radians(4.0) * rng.normal(size=36)[:, None] * [0.0, 0.0, 1.0]
    about = Pose(Rotation.exp(np.zeros(3)), xyz.mean(0))
    found = about @ Pose(Rotation.exp(turns), np.zeros((36, 3))) @ about.inverse() @ given
    moved = np.sqrt(((found.position - given.position) ** 2).sum(1).mean())
    assert moved > 0.01
    seen = moved_m(given, found, xyz, normal)
    assert seen > 0.9 * moved if shown else seen < 0.1 * moved


def test_moves_toward_a_ball_count_and_those_about_it_do_not() -> None:
    """Of noisy points no turn about its middle is quite without a shift."""
    rng = np.random.default_rng(0)
    normal = rng.normal(size=(2000, 3))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    xyz = 0.03 * normal + rng.normal(0, 5e-4, (2000, 3))
    given = wrist_arc(np.zeros(3), 0.4, count=24)
    toward = given.position / np.linalg.norm(given.position, axis=1)[:, None]
    moved = Pose(given.rotation, given.position + 0.002 * toward)
    assert moved_m(given, moved, xyz, normal) == pytest.approx(0.002, rel=0.1)
    about = Pose(given.rotation, given.position + 0.002 * np.cross(toward, [0.0, 0.0, 1.0]))
    assert moved_m(given, about, xyz, normal) < 3e-4


def test_an_error_at_the_wrist_is_found_and_the_place_is_right() -> None:
    true, whole = wrist_arc(np.zeros(3), 0.35, 36), moved_by(np.random.default_rng(0))
    placed = placement(true @ HAND_EYE, whole @ true, whole.apply(MIDDLE))
    left = placed.common.inverse() @ whole
    assert np.linalg.norm(left.apply(MIDDLE) - MIDDLE) < 2e-4
    assert np.linalg.norm(left.rotation.log()) < np.radians(0.02)
    assert placed.at_wrist is not None
    assert placed.at_wrist[0] == pytest.approx(np.linalg.norm(HAND_EYE.position), rel=0.05)
    assert placed.at_wrist[1] == pytest.approx(np.linalg.norm(HAND_EYE.rotation.log()), rel=0.05)


@pytest.mark.parametrize(
    ("wrong", "views", "least"), [(each, 36, 0.92), (both, 36, 0.88), (swayed, 36, 0.85), (swayed, 127, 0.85)]
)
def test_bars_of_the_place_hold_it(wrong: Given, views: int, least: float) -> None:
    z = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        true, whole = wrist_arc(np.zeros(3), 0.35, views, start=rng.uniform(0, 360)), moved_by(rng)
        placed = placement(wrong(true, rng), whole @ true, whole.apply(MIDDLE))
        left = placed.common.inverse() @ whole
        z.append([(left.apply(MIDDLE) - MIDDLE) / placed.std_m, left.rotation.log() / placed.std_rad])
    held = (np.abs(z) < 1.96).mean((0, 2))
    assert (held > least).all()
    assert np.sqrt(np.square(z).mean()) > 1 / 2.6


@pytest.mark.parametrize("views", [1, 2, 3])
def test_few_views_have_bars(views: int) -> None:
    rng = np.random.default_rng(0)
    true = wrist_arc(np.zeros(3), 0.35, 36)[np.arange(views)]
    placed = placement(each(true, rng), true, MIDDLE)
    assert placed.at_wrist is None
    assert 1e-3 < placed.std_m < 0.1
    assert np.radians(0.1) < placed.std_rad < 0.5


def test_a_scan_with_an_error_at_the_wrist_lies_where_it_is_in_the_world() -> None:
    found = askew()
    assert found.placement is not None
    assert found.placement.at_wrist is not None
    nearest = cKDTree(right().cloud.xyz).query(found.cloud.xyz)[1]
    off = np.linalg.norm((found.cloud.xyz - right().cloud.xyz[nearest]).mean(0))
    assert off < 4 * np.hypot(found.placement.std_m, 1e-4)
    assert found.table.normal == pytest.approx(right().table.normal, abs=2e-3)
