"""By how much a team's answer is off the truth of its trial."""

from __future__ import annotations

from typing import Any

import numpy as np

from steelyard.simulate.team import TeamTrial, TeamTruth
from steelyard.spatial import Pose
from steelyard.team.estimate import TeamEstimate


def score(made: TeamTrial, found: TeamEstimate) -> dict[str, Any]:
    """Return the errors of one answer; inertia is None where it was not identified."""
    turned, moved, share = grasp_errors(made.truth, found.poses_of(made.log.names))
    body, moments = made.truth.body, found.principal_moments
    return {
        "rotation_deg": turned,
        "position_mm": moved,
        "position_pct": share,
        "mass_pct": 100 * abs(found.mass / float(body.mass) - 1),
        "com_mm": 1000 * float(np.linalg.norm(found.com - body.com)),
        "inertia_pct": None if moments is None else (100 * np.abs(moments / made.truth.moments - 1)).tolist(),
    }


def grasp_errors(truth: TeamTruth, found: Pose) -> tuple[float, float, float]:
    """Return mean angle [deg], distance [mm] and distance [% of the true one] over the grasps that are not at R."""
    far = np.linalg.norm(truth.grasps.position, axis=1)
    others = far > 0
    angle = np.rad2deg((truth.grasps.rotation.inverse() @ found.rotation).angle())[others]
    gap = np.linalg.norm(found.position - truth.grasps.position, axis=1)[others]
    return float(angle.mean()), float(1000 * gap.mean()), float(100 * (gap / far[others]).mean())
