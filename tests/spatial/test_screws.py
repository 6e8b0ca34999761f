"""Exponential and logarithm of poses."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from steelyard.spatial import cross_matrix
from steelyard.spatial.screws import exp_pose, log_pose


@pytest.mark.parametrize("angle", [0.0, 1e-6, 9e-3, 1.1e-2, 0.5, 3.0])
def test_screws_are_matrix_exponentials(angle: float) -> None:
    rng = np.random.default_rng(0)
    screw = rng.standard_normal((40, 6))
    screw[:, :3] *= angle / np.linalg.norm(screw[:, :3], axis=1, keepdims=True)
    generator = np.zeros((40, 4, 4))
    generator[:, :3, :3], generator[:, :3, 3] = cross_matrix(screw[:, :3]), screw[:, 3:]
    pose = exp_pose(screw)
    assert np.abs(pose.matrix() - np.array([expm(g) for g in generator])).max() < 1e-14
    assert np.abs(log_pose(pose) - screw).max() < 1e-13
