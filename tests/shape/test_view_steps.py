"""Views fitted to each other all at once: what they have wrong alike is found too."""

from __future__ import annotations

import numpy as np
import pytest
from tools_seen import seen
from views_apart import apart

from steelyard.shape.scans.common_table import levelled
from steelyard.shape.scans.depth_images import Images
from steelyard.shape.scans.pose_errors import PoseErrors
from steelyard.shape.scans.registration import Seen, agreed
from steelyard.shape.scans.scene import scene_of
from steelyard.shape.scans.view_steps import Sights, steps_together
from steelyard.spatial import Pose, Rotation


@pytest.mark.parametrize("tool", ["box-wrench", "hammer"])
def test_a_camera_askew_at_the_wrist_no_longer_swells_what_it_sees(tool: str) -> None:
    """All views have the object too near by as much: one by one they went a third of the way in four rounds."""
    views = seen(tool).views
    askew = Pose(Rotation.exp(np.array([0.004, 0.002, 0.0])), np.array([0.0, 0.0, 0.002]))
    scene = scene_of(views.posed(views.X_WC @ askew))
    off = levelled(scene) or 0.0
    assert apart(scene, views.X_WC) > 1.2e-3
    agreed(scene, Seen.by(scene), off)
    assert apart(scene, views.X_WC) < 0.3e-3


def test_views_that_agree_stay_and_two_that_do_not_meet_in_the_middle() -> None:
    depth = np.full((2, 40, 40), 500, np.uint16)
    lens = np.array([40.0, 40.0, 19.5, 19.5])
    down = np.tile(np.diag([1.0, -1.0, -1.0]), (2, 1, 1))
    x, y = (0.02 * (np.mgrid[:20, :20] - 9.5)).reshape(2, -1)
    xyz, normal = np.stack([x, y, 0 * x], axis=1), np.tile([0.0, 0.0, 1.0], (400, 1))
    for apart_m in (0.0, 0.002):
        p = np.array([[0.0, 0.0, 0.5], [0.0, 0.0, 0.5 + apart_m]])
        given = Pose(Rotation.nearest(down), p)
        sights = Sights(Images(depth, 1e-3, lens, down, p), xyz, normal, 0.01, 1e-3, given, xyz.mean(0))
        steps = steps_together(sights, PoseErrors.unknown(down, 0.03, 0.01).information(), sights.off())
        assert steps[:, 5] == pytest.approx([apart_m / 2, -apart_m / 2], abs=5e-5)
        assert np.abs(np.delete(steps, 5, axis=1)).max() < 1e-4
