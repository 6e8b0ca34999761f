"""The joint fit's derivatives, against differences of its residuals."""

import numpy as np
import pytest
from made_recordings import Swing, recording

from steelyard.logs import joint_fit
from steelyard.logs.alignment import align
from steelyard.spatial import Rotation


@pytest.mark.parametrize("position", [False, True])
def test_derivatives_are_those_of_the_residuals(monkeypatch, position):
    seen = []
    descend = joint_fit._descend
    monkeypatch.setattr(joint_fit, "_descend", lambda *a, **k: seen.append(a) or descend(*a, **k))
    align(recording(Swing(duration=6.0), mount=Rotation.exp([0.5, -1.0, 0.3]), imu_delay=0.008, position=position))
    layout, theta = seen[-1][:2]
    theta = theta + 0.05 * np.sin(np.arange(len(theta)))
    theta[layout.slices["rotation"]] += [0.3, -0.2, 0.4]
    residual, J = joint_fit._jacobian(layout, theta)
    assert np.array_equal(residual, joint_fit._residual(layout, theta))
    for i in range(layout.slices["delay"].stop, len(theta)):
        step = 1e-4 * np.eye(len(theta))[i]
        change = (joint_fit._residual(layout, theta + step) - joint_fit._residual(layout, theta - step)) / 2e-4
        assert np.abs(change - J[..., i]).max() < 1e-6 * max(np.abs(J[..., i]).max(), 1.0)
