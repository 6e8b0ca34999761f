"""What reported poses are off by, from what views show of it, and what that leaves open."""

from __future__ import annotations

import numpy as np
import pytest
from meshes import box_mesh, joined

from steelyard.shape.carving import carved
from steelyard.shape.mesh import part_moments
from steelyard.shape.scan import fuse
from steelyard.shape.scans.pose_errors import PoseErrors
from steelyard.shape.volume import enclose
from steelyard.simulate.camera import wrist_arc
from steelyard.simulate.scanning import scan_mesh
from steelyard.spatial import Pose, Rotation

TURN, SHIFT = np.radians(0.2), 0.0015
SURE = np.repeat([1e-4, 1e-4], 3)  # what views tell, where they do [rad], [m]


def believed(off: np.ndarray, told: np.ndarray, R: np.ndarray) -> PoseErrors:
    """What is believed of errors (V, 6) of which the views tell some (6,): the others are still to be found."""
    H = np.tile(np.diag(told / SURE**2), (len(off), 1, 1))
    here = np.where(told, off, 0.0)
    errors = PoseErrors.unknown(R, np.radians(2.0), 0.01)
    for _ in range(20):
        errors = errors.seen(here, H, np.zeros_like(off))
    return errors


def test_how_far_poses_are_off_is_found_from_what_the_table_alone_tells() -> None:
    rng, R = np.random.default_rng(0), wrist_arc(np.zeros(3), 0.4, 60).rotation.matrix
    off = rng.normal(size=(60, 6)) * np.repeat([TURN, SHIFT], 3)
    errors = believed(off, np.array([1, 1, 0, 0, 0, 1]), R)
    assert np.sqrt(errors.turns.of_each) == pytest.approx(TURN, rel=0.2)
    assert np.sqrt(errors.shifts.of_each) == pytest.approx(SHIFT, rel=0.3)


def test_an_error_at_the_wrist_is_told_from_those_of_each_view() -> None:
    rng, R = np.random.default_rng(1), wrist_arc(np.zeros(3), 0.4, 60).rotation.matrix
    own = np.array([0.001, -0.002, 0.004])
    off = rng.normal(size=(60, 6)) * 0.1 * np.repeat([TURN, SHIFT], 3)
    off[:, 3:] += R @ own
    errors = believed(off, np.ones(6), R)
    assert errors.shifts.own == pytest.approx(own, abs=1e-4)
    assert np.sqrt(errors.shifts.of_each) == pytest.approx(0.1 * SHIFT, rel=0.2)


def test_poses_that_all_views_have_alike_say_nothing_and_others_what_was_believed() -> None:
    R = wrist_arc(np.zeros(3), 0.4, 8).rotation.matrix
    information = PoseErrors.unknown(R, TURN, SHIFT).information()
    assert information == pytest.approx(information.T)
    alike = np.tile([0.1, 0.0, 0.2, 0.0, 1.0, 0.0], 8)
    assert alike @ information @ alike < 1e-6
    at_wrist = np.concatenate([np.zeros((8, 3)), R @ [0.0, 0.0, SHIFT]], axis=1)
    at_wrist = (at_wrist - at_wrist.mean(0)).reshape(-1)
    assert 0.1 < at_wrist @ information @ at_wrist < 1.0


@pytest.mark.parametrize("seed", [0, 1])
def test_an_upright_sheet_keeps_its_thickness_where_poses_are_off(seed: int) -> None:
    """Its sides are seen by different views, which pushed each other apart at its foot, by a sixth."""
    sheet = joined(box_mesh((-0.02, 0, 0), (0.025, 0.08, 0.005)), box_mesh((0, 0, 0.005), (0.005, 0.08, 0.08)))
    turn = Rotation.exp(np.array([0, 0, np.random.default_rng(seed).uniform(0, 2 * np.pi)]))
    X_WO = Pose(turn, -turn.apply(np.array([0.0025, 0.04, 0.0])))
    views = scan_mesh(sheet, seed, count=24, pose_std=(1.0, 0.1), X_WO=X_WO).views
    scan = fuse(views)
    solid = carved(enclose(scan.cloud), scan.space)
    true = part_moments(sheet)[:, 0].sum()
    assert solid.mesh.volume == pytest.approx(true, rel=0.08)
    assert 0.03 < scan.space.unsure_m3 / true < 0.1
