"""The page of a team: its scene, what each robot's line says, and the residuals of its log."""

from __future__ import annotations

from collections.abc import Mapping

from steelyard.identify.estimate import Estimate
from steelyard.inertia import InertialParameters
from steelyard.logs.team_log import TeamLog
from steelyard.report.contents import Report, Truth
from steelyard.report.drawing import PAYLOAD
from steelyard.report.team_residuals import team_residuals
from steelyard.report.team_scene import labels_of, team_scene
from steelyard.spatial import Pose
from steelyard.tables.numbers import decimals, fixed, general
from steelyard.team.estimate import TeamEstimate


def team_page(
    title: str,
    estimate: TeamEstimate,
    log: TeamLog | None = None,
    *,
    rivals: Mapping[str, Estimate] | None = None,
    truth: tuple[InertialParameters, Mapping[str, Pose]] | None = None,
    provenance: Mapping[str, str] | None = None,
) -> Report:
    """Return the report of a team's result.

    log    gives what the answer leaves over
    truth  the payload in the reference grasp, and the true grasps
    """
    labels = labels_of(estimate)
    return Report(
        title,
        estimate,
        team_scene(estimate),
        None if log is None else team_residuals(log, estimate),
        dict(rivals or {}),
        None if truth is None else Truth(truth[0], grasps=truth[1]),
        labels,
        dict(provenance or {}),
        {label: _line(estimate, name) for label, name in labels.items() if label != PAYLOAD}
        | {PAYLOAD: "The ring joins the grasps; nobody has seen the payload's shape."},
    )


def _line(estimate: TeamEstimate, name: str) -> str:
    """Return how well a robot's grasp is known."""
    taken = estimate.wrenches_taken.get(name)
    put_right = "" if taken is None else f" · put right: {taken}"
    if name == estimate.reference:
        return "the reference: everything is given in its grasp frame" + put_right
    grasp = estimate.grasps[name]
    said = f"± {general(1e3 * float(grasp.std_m.max()), 2)} mm, ± {general(float(grasp.std_deg.max()), 2)}°"
    late = estimate.clock_offsets_s.get(name)
    places = decimals(1e3 * estimate.clock_offset_std_s.get(name, 0.0))
    return (said if late is None else f"{said} · clock late by {fixed(1e3 * late, places)} ms") + put_right
