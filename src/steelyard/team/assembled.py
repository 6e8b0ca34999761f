"""From the fits in the balance frame to one estimate in the reference grasp."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from steelyard.check import Array
from steelyard.evidence import Evidence
from steelyard.inertia import InertialParameters
from steelyard.inertia.forms import people_jacobian
from steelyard.inertia.parameters import frame_change
from steelyard.logs.log import Mask
from steelyard.logs.team_log import TeamLog
from steelyard.spatial import Pose
from steelyard.team.consistent import consistent
from steelyard.team.estimate import GraspEstimate, TeamEstimate
from steelyard.team.payload.body_rows import balance_frame, reach
from steelyard.team.payload.doubt import lost_turns, moved_by_gains, moved_by_grasps
from steelyard.team.payload.fit import PayloadFit
from steelyard.team.payload.shown import SHOWN
from steelyard.team.poses.covariance import Spread

# [m] What is taken for the size of a team where the motion does not show where its grasps are.
UNKNOWN_SIZE = 1.0


def team_size(grasps: Pose, spread: Spread) -> float:
    """Return how far the grasps are from their middle [m], as far as that is known."""
    return max(reach(grasps), UNKNOWN_SIZE) if spread.blind.size else reach(grasps)


def assembled(
    log: TeamLog, grasps: Pose, spread: Spread, payload: PayloadFit, D: Array, late: Mapping[str, float]
) -> TeamEstimate:
    """Return the estimate of a team whose grasps (N,) in R are known to within `spread`."""
    balance = balance_frame(grasps)
    size, placed = team_size(grasps, spread), balance.inverse() @ grasps
    spread = spread.with_lost(size)
    moved = moved_by_grasps(payload, placed)
    inner = payload.covariance + moved @ spread.full @ moved.T + moved_by_gains(payload, D)
    if spread.blind.size:
        inner = inner + lost_turns(payload, placed, spread.unseen(size))
    body = InertialParameters(consistent(payload.parameters, payload.covariance, payload.scale)).in_frame(balance)
    change = frame_change(balance)
    estimates = {name: GraspEstimate(grasps[i], spread.of(i), spread.lost(i)) for i, name in enumerate(log.names)}
    shown = not payload.lost.shape[1] and not spread.blind.size
    samples = {g.parts[0].still: sum(p.samples for p in g.parts) for g in payload.groups}
    moment, force = payload.residual[:3], payload.residual[3:]
    return TeamEstimate(
        parameters=body,
        covariance=change @ inner @ change.T,
        method="joint",
        evidence=Evidence(
            10 - payload.lost.shape[1], payload.condition, sum(samples.values()), samples.get(True, 0),
            float(np.sqrt((force**2).mean())), float(np.sqrt((moment**2).mean())), payload.chi2,
        ),
        identified=np.ones(10, np.bool_) if shown else known(body, change @ inner @ change.T, payload.scale),
        frame=log.reference,
        reference=log.reference,
        grasps=estimates,
        clock_offsets_s=dict(late) if spread.late is not None else {},
        clock_offset_std_s=spread.delays(log.names),
        wrench_biases=_biases_at(balance, payload),
    )  # fmt: skip


def _biases_at(balance: Pose, payload: PayloadFit) -> dict[str, Array]:
    """Return the bias (6,) of the summed wrench of every recording, at the reference and in its axes."""
    parts = [part for group in payload.groups for part in group.parts]
    moment, force = (balance.rotation.apply(each) for each in np.split(payload.biases, 2, axis=1))
    moment = moment + np.cross(balance.position, force)
    return {part.name: np.concatenate(both) for part, *both in zip(parts, moment, force, strict=True)}


def known(body: InertialParameters, covariance: Array, units: Array) -> Mask:
    """Return which (10,) of mass, centre of mass and inertia about it are known: two standard deviations are below
    SHOWN of what a body of this mass and size can have, `units` (10,).
    """
    jacobian = people_jacobian(body.vector)
    std = np.sqrt(np.maximum(np.diag(jacobian @ covariance @ jacobian.T), 0))
    scale = units / np.concatenate([[1.0], np.full(3, units[0]), np.ones(6)])
    scale[0] = min(scale[0], abs(float(body.mass)))
    small = 2 * std < SHOWN * scale
    # The centre of mass is the first moment over the mass.
    small[1:] &= small[0]
    return np.asarray(small)
