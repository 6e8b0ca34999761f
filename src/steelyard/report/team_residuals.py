"""What a team's answer leaves over: the sum of all wrenches less what the payload needed, row by row."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.logs.log import MotionLog
from steelyard.logs.team_conditioning import condition
from steelyard.logs.team_log import TeamLog, TeamRecording
from steelyard.report.contents import Residuals
from steelyard.spatial import Pose, classical_acceleration, cross
from steelyard.team.clocks.errors import ClockError, punctual
from steelyard.team.estimate import TeamEstimate
from steelyard.team.grasp_kinematics import total_wrench
from steelyard.team.misread.readings import as_taken

CUTOFF_HZ = 3.0
_PAUSE_S = 0.1


def team_residuals(log: TeamLog, estimate: TeamEstimate) -> Residuals | None:
    """Return the residuals in the reference grasp of all rows with complete wrenches, below 3 Hz; None without any.

    The bias that the result says each recording has is taken out; clocks, and wrenches that were read wrongly, are put
    right by it.

    None also for two bodies with a hinge: what one rigid body would need leaves their motion over.

    Recordings follow each other without the pauses between them. The motion is the mean over the robots that saw it.
    Raises BadValue where the log is another team's.
    """
    if set(log.names) != set(estimate.grasps) or log.reference != estimate.reference:
        raise BadValue(
            f"the log must be that of the result; it is of {', '.join(log.names)} with reference '{log.reference}', "
            f"the result of {', '.join(estimate.grasps)} with '{estimate.reference}'."
        )
    if estimate.hinge is not None:
        return None
    log = as_taken(log, estimate.wrench_maps)
    grasps = estimate.poses_of(log.names)
    late = {name: ClockError(seconds) for name, seconds in estimate.clock_offsets_s.items() if seconds}
    start, parts = 0.0, []
    for recording in log.recordings:
        if recording.kind == "grasp" and len(log.recordings) > 1:
            continue
        time, left = _left(log, punctual(recording, late), grasps, estimate)
        if len(time):
            still = np.full(len(time), recording.kind == "still")
            parts.append((time - time[0] + start, left, still))
            start = float(parts[-1][0][-1]) + _PAUSE_S
    if not parts:
        return None
    time, left, still = (np.concatenate(column) for column in zip(*parts, strict=True))
    return Residuals(time, left[:, 3:], left[:, :3], still)


def _left(log: TeamLog, recording: TeamRecording, grasps: Pose, estimate: TeamEstimate) -> tuple[Array, Array]:
    """Return times (T,) and what is left (T, 6) [N m, N] at R's origin, in R's axes."""
    rows = condition(log, recording, CUTOFF_HZ)
    turn = grasps.rotation.matrix
    has, speed, rate = rows.has_rate, *(_at_reference(grasps, values) for values in (rows.twist, rows.twist_rate))
    if recording.kind == "still":
        has, speed, rate = rows.has_gravity, np.zeros_like(speed), np.zeros_like(rate)
    keep = rows.complete_wrench() & has.any(0) & rows.has_gravity.any(0)
    twist, change = _mean(speed, has)[keep], _mean(rate, has)[keep]
    down = _mean(np.einsum("nij,ntj->nti", turn, rows.gravity), rows.has_gravity)[keep]
    wrench = total_wrench(grasps, rows.wrench)[keep]
    acceleration = classical_acceleration(change, twist)
    moved = MotionLog(wrench, down, acceleration, twist[:, :3], change[:, :3])
    left = wrench - moved.predicted(estimate.parameters.vector)
    left = left - estimate.wrench_biases.get(recording.name, np.zeros(6))
    return rows.time[keep], left


def _at_reference(grasps: Pose, twist: Array) -> Array:
    """Return twists (N, T, 6) given at the grasps as twists of R, in R's axes; their derivatives likewise."""
    turn, place = grasps.rotation.matrix, grasps.position
    omega = np.einsum("nij,ntj->nti", turn, twist[..., :3])
    velocity = np.einsum("nij,ntj->nti", turn, twist[..., 3:])
    return np.concatenate([omega, velocity + cross(np.broadcast_to(place[:, None], omega.shape), omega)], -1)


def _mean(values: Array, known: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]) -> Array:
    """Return the mean (T, k) over the robots that know a row."""
    share = known / np.maximum(known.sum(0), 1)
    return np.asarray(np.einsum("nt,ntk->tk", share, np.where(known[..., None], values, 0.0)))
