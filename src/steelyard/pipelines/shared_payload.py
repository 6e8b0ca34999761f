"""One payload, many robots: the log of a team becomes a TeamEstimate.

    poses and twists -> where everybody holds the payload, and when -> the payload's motion and the sum of wrenches
    -> mass, centre of mass, inertia

Two ways through the same rooms: the paper's, step after step, and one joint estimate.
Source: "Cooperative Payload Estimation by a Team of Mocobots".
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Literal, get_args

from steelyard.errors import BadValue, CannotAnswer
from steelyard.findings import UNEXPLAINED, other_than
from steelyard.identify.fit import within_numbers
from steelyard.identify.scale import allow_scale
from steelyard.logs.recording import STANDARD_GRAVITY
from steelyard.logs.team_log import TeamLog, TeamRecording
from steelyard.logs.team_steady import with_steady_tracks
from steelyard.pipelines.lacking import missing_rows, missing_wrenches, repeated_rows
from steelyard.team.clocks.errors import NOTHING, ClockErrors
from steelyard.team.clocks.lags import together
from steelyard.team.estimate import TeamEstimate
from steelyard.team.hung_motion import without_hung
from steelyard.team.joint import JointTeam
from steelyard.team.lost_wrenches import stuck_forces, without_clipped, without_frozen
from steelyard.team.misread.files import (
    require_one_angle_unit,
    require_one_length_unit,
    require_own_numbers,
    with_moves_as_motion,
)
from steelyard.team.misread.home_axes import with_grasp_axes
from steelyard.team.published import PublishedTeam
from steelyard.team.stray_rows import without_strays
from steelyard.team.team_findings import late_clocks
from steelyard.team.weighed import clocked

Method = Literal["joint", "paper"]
METHODS: tuple[Method, ...] = get_args(Method)

# joint  every grasp, home and clock at once, then one fit of the ten parameters to still and moving rows together
# paper  grasps from twists (eq. 1-8), loops closed, mass and centre of mass at rest (9-16), inertia in motion (17-33)
ESTIMATORS: Mapping[Method, JointTeam | PublishedTeam] = MappingProxyType(
    {"joint": JointTeam(), "paper": PublishedTeam()}
)


@within_numbers()
def identify_team(log: TeamLog, method: Method = "joint") -> TeamEstimate:
    """Return every grasp, mass, centre of mass and inertia, in the grasp frame of the reference robot.

    Raises CannotAnswer where the data do not determine them, BadInput where they make no sense.
    """
    if method not in METHODS:
        raise BadValue(f"method must be one of {', '.join(METHODS)}; got {method!r}.")
    require_one_angle_unit(log)
    require_one_length_unit(log)
    require_own_numbers(log)
    log, moving = with_moves_as_motion(log)
    log, steady = with_steady_tracks(log) if method == "joint" else (log, ())
    live, stray = without_strays(log)
    live, hung = without_hung(live)
    apart = together(live)[1] if method == "joint" else NOTHING
    log, live = apart.corrected(log), apart.corrected(live)
    for recording in log.recordings:
        recording.require_overlap()
    live, frozen = without_frozen(live)
    whole, clipped = without_clipped(live)
    found = _with_clocks(_identified(whole, method), apart, log)
    lost = (*repeated_rows(log), *missing_rows(log), *missing_wrenches(log, _weighing(log, method)))
    seen = (*stuck_forces(log), *stray, *hung, *frozen, *clipped, *found.findings, *lost)
    found = replace(found, findings=seen, notes=(*steady, *moving, *found.notes)).by_cause()
    return _weighed(_with_gravity(_remedied(found), log))


def _identified(log: TeamLog, method: Method) -> TeamEstimate:
    """Return what a method says of the log; the joint one also asks whether wrenches are in other axes."""
    identify = ESTIMATORS[method].identify
    return with_grasp_axes(log, identify) if method == "joint" else identify(log)


def _weighing(log: TeamLog, method: Method) -> tuple[TeamRecording, ...]:
    """Return the recordings whose wrenches a method sums."""
    if method == "joint":
        return log.recordings
    return tuple(r for r in log.recordings if r.kind == "still" or r in log.of_kind("motion"))


def _with_clocks(found: TeamEstimate, apart: ClockErrors, log: TeamLog) -> TeamEstimate:
    """Return the estimate with how late clocks were that were brought together before it."""
    if not apart:
        return found
    found = clocked(found, apart.first(log))
    others = other_than(found.findings, "clock-offset")
    said = (*apart.findings(log), *late_clocks(found.clock_offsets_s, found.clock_offset_std_s), *others)
    return replace(found, findings=tuple(sorted(said, key=lambda finding: finding.code != "robot-excluded")))


def _remedied(found: TeamEstimate) -> TeamEstimate:
    """Return the estimate with remedies that help where its wrenches are no body's."""
    return found.with_remedies(UNEXPLAINED) if "wrench-unexplained" in found.codes() else found


def _with_gravity(found: TeamEstimate, log: TeamLog) -> TeamEstimate:
    """Return the estimate with bars, and a note, for gravity that nobody stated."""
    if not log.gravity_std:
        return found
    note = (
        f"no robot gives gravity: {STANDARD_GRAVITY} m/s² along -z of level bases was assumed, ± {log.gravity_std:.2%}"
    )
    return allow_scale(found, log.gravity_std, whole=False).noted(note)


def _weighed(found: TeamEstimate) -> TeamEstimate:
    """Return the estimate; raise CannotAnswer, with what was noticed first, where its mass is less than its bar."""
    if found.mass >= found.std[0]:
        return found
    noticed = "".join(f" Noticed: {finding.message} {finding.remedy}" for finding in found.findings[:1])
    weighed = f"{found.mass:.2g} kg, with a standard deviation of {found.std[0]:.2g} kg"
    raise CannotAnswer(f"the data do not tell the mass: {weighed}.{noticed}")
