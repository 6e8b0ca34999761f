"""What a shared table tells of the lens, and nothing of hand-eye poses and an arm's own errors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tools_seen import right_volume, seen, volume

from steelyard.shape import scan
from steelyard.shape.scan import fuse
from steelyard.shape.scans import scan_findings
from steelyard.shape.scans.common_table import levelled
from steelyard.shape.scans.lens_error import Tables, _corrected, lens_by_table
from steelyard.shape.scans.scene import scene_of
from steelyard.shape.views import Intrinsics, Views
from steelyard.simulate.camera import disturbed, wrist_arc
from steelyard.spatial import Pose, Rotation


def views() -> Views:
    return seen().views


def seen_with(read: Views, focal: float = 1.0, cy: float = 0.0) -> Views:
    """Return views whose description has a wrong lens."""
    lens = read.intrinsics
    return replace(read, intrinsics=replace(lens, fx=focal * lens.fx, fy=focal * lens.fy, cy=lens.cy + cy))


def swayed(read: Views, std_deg: float, seed: int) -> Views:
    """Return views of an arm whose errors change slowly along its way, as those of joints do."""
    rng = np.random.default_rng(seed)
    way = 2 * np.pi * np.linspace(0, 1, len(read))[:, None]
    waves = sum(rng.normal(size=6) * np.sin(n * way + rng.uniform(0, 2 * np.pi, 6)) for n in (1, 2, 3))
    wave = np.asarray(waves) / np.sqrt(1.5)
    turn = Rotation.exp(np.radians(std_deg) * wave[:, :3] / np.sqrt(3))
    return read.posed(read.X_WC @ Pose(turn, 4e-3 * std_deg * wave[:, 3:] / np.sqrt(3)))


def told(read: Views) -> Intrinsics | None:
    scene = scene_of(read)
    assert levelled(scene) > 0
    return lens_by_table(scene)


@pytest.mark.parametrize("focal", [0.9, 0.95, 1.03, 1.1])
def test_the_focal_length_is_found_from_the_table_alone(focal: float) -> None:
    lens = told(seen_with(views(), focal))
    assert lens is not None
    assert lens.fx == pytest.approx(615, rel=0.004)
    assert (lens.cx, lens.cy) == (320, 240)


def test_a_principal_point_is_found_beside_a_focal_length() -> None:
    lens = told(seen_with(views(), 1.05, 10))
    assert lens is not None
    assert lens.fx == pytest.approx(615, rel=0.004)
    assert lens.cy == pytest.approx(240, abs=0.6)


def test_errors_of_the_arm_blur_the_focal_length_and_do_not_hide_it() -> None:
    read = seen_with(views(), 1.05)
    lens = told(read.posed(disturbed(read.X_WC, 1.0, 0.2, np.random.default_rng(1))))
    assert lens is not None
    assert lens.fx == pytest.approx(615, rel=0.015)


def test_the_standard_error_of_a_focal_length_is_that_of_its_errors() -> None:
    off, std = [], []
    for seed in range(30):
        rng = np.random.default_rng(seed)
        true = wrist_arc(np.zeros(3), 0.35, 36, start=rng.uniform(0, 360))
        given = disturbed(true, 4.0, 1.0, rng)
        tables = Tables(given, true.rotation.matrix[:, 2], true.position[:, 2], 0.25 * 0.35)
        found, _, errors = tables.explained(np.ones(12, bool))
        off.append(found[0])
        std.append(errors[0])
    assert np.median(std) > 0.9 * np.sqrt(np.mean(np.square(off)))


def test_a_turned_camera_is_no_wrong_lens() -> None:
    wrong = Pose(Rotation.exp(np.radians([0.6, -0.7, 0.4])), np.array([0.003, -0.002, 0.003]))
    assert told(views().posed(views().X_WC @ wrong)) is None


@pytest.mark.parametrize("seed", range(3))
def test_errors_of_the_arm_are_no_wrong_lens(seed: int) -> None:
    rng = np.random.default_rng(seed)
    assert told(views().posed(disturbed(views().X_WC, 4.0, 1.0, rng))) is None
    assert told(swayed(views(), 0.5, seed)) is None


def test_a_principal_point_outside_the_image_is_no_lens() -> None:
    lens = views().intrinsics
    assert _corrected(lens, 0.0, 0.0, 0.1) is not None
    assert _corrected(lens, 0.0, 0.6, 0.0) is None
    assert _corrected(lens, 0.0, 0.0, -0.5) is None


def test_a_lens_that_does_not_level_the_table_is_not_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    wrong = replace(views().intrinsics, fx=500.0, fy=500.0)
    monkeypatch.setattr(scan, "lens_by_table", lambda _: wrong)
    found = fuse(views().posed(disturbed(views().X_WC, 1.0, 0.2, np.random.default_rng(1))))
    assert not any("read with" in finding.message for finding in found.findings)


def test_a_handful_of_views_tells_nothing() -> None:
    assert told(seen_with(views().chosen(np.arange(0, 36, 4)), 1.1)) is None


def test_a_scan_is_read_with_the_lens_that_its_table_asks_for_and_says_so() -> None:
    found = fuse(seen_with(views(), 1.05))
    assert [finding.code for finding in found.findings] == ["views-disagree"]
    assert "read with fx 615, fy 615, cx 320, cy 240 instead of fx 646" in found.findings[0].message
    assert volume(found) == pytest.approx(right_volume(), rel=0.03)


def test_only_what_was_found_is_said() -> None:
    lens = views().intrinsics
    said = scan_findings._said_of(scan_findings.Level(0.0, lens, None), 0.025, None)
    assert said == "The cameras had to be moved by 25 mm (rms) until the views agreed."
