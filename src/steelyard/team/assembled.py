"""From the fits in the balance frame to one estimate in the reference grasp.

Where the answer is none of a body, the physically consistent one nearest to it is given, in the metric of its own
covariance.
Source: log-Cholesky parameters of Rucker and Wensing 2022: every one of them is a body.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from steelyard.check import Array, Mask
from steelyard.evidence import Evidence
from steelyard.inertia import InertialParameters, forms
from steelyard.inertia.parameters import frame_change
from steelyard.inertia.people import people_jacobian
from steelyard.logs.team_log import TeamLog
from steelyard.spatial import Pose
from steelyard.team.estimate import GraspEstimate, TeamEstimate
from steelyard.team.payload.body_rows import balance_frame, reach
from steelyard.team.payload.doubt import lost_turns, moved_by, moved_by_gains, turned_by_step
from steelyard.team.payload.fit import PayloadFit
from steelyard.team.payload.model import SHOWN
from steelyard.team.poses.covariance import Spread

# [m] What is taken for the size of a team where the motion does not show where its grasps are.
UNKNOWN_SIZE = 1.0
STEPS = 60
# Least eigenvalue of the pseudo-inertia, as a share of its middle one in units of mass and size, that counts as a body.
MARGIN = 1e-6


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
    moved = moved_by(payload, turned_by_step(placed))
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
    jacobian = people_jacobian(body.vector.copy())
    std = np.sqrt(np.maximum(np.diag(jacobian @ covariance @ jacobian.T), 0))
    scale = units / np.concatenate([[1.0], np.full(3, units[0]), np.ones(6)])
    scale[0] = min(scale[0], abs(float(body.mass)))
    small = 2 * std < SHOWN * scale
    # The centre of mass is the first moment over the mass.
    small[1:] &= small[0]
    return np.asarray(small)


def consistent(phi: Array, covariance: Array, scale: Array) -> Array:
    """Return phi (10,), or the body of least (phi - phi')^T C^-1 (phi - phi') where phi is none.

    scale  (10,) units of mass, mass times size, mass times size squared
    """
    pseudo = forms.pseudo_inertia(phi / scale)
    if np.linalg.eigvalsh(pseudo)[0] > 0:
        return phi
    goal = phi / scale
    F = np.linalg.inv(covariance / np.outer(scale, scale) + 1e-18 * np.eye(10))
    F /= np.trace(F)
    theta = forms.log_cholesky(_nearby(pseudo))
    damping, found = 1e-3, forms.from_log_cholesky(theta)
    cost = float((found - goal) @ F @ (found - goal))
    for _ in range(STEPS):
        J = forms.log_cholesky_jacobian(theta)
        H, g = J.T @ F @ J, J.T @ F @ (goal - found)
        step = np.linalg.solve(H + damping * (np.diag(np.diag(H)) + 1e-12 * np.eye(10)), g)
        trial = theta + np.clip(step, -1.0, 1.0)
        body = forms.from_log_cholesky(trial)
        new = float((body - goal) @ F @ (body - goal))
        if new < cost and np.linalg.eigvalsh(forms.pseudo_inertia(body))[0] > MARGIN * MARGIN:
            settled = cost - new < 1e-10 * cost
            theta, found, cost, damping = trial, body, new, 0.3 * damping
            if settled:
                break
        else:
            damping *= 10
            if damping > 1e8:
                break
    return np.asarray(found * scale)


def _nearby(pseudo: Array) -> Array:
    """Return the pseudo-inertia (4, 4) of a body to start from: of the same mass and centre of mass, where the mass is
    above zero. These are mostly known far better than the rest, and a search from elsewhere creeps along what they
    allow.
    """
    mass, first = float(pseudo[3, 3]), pseudo[:3, 3]
    if mass <= 0:
        values, vectors = np.linalg.eigh(pseudo)
        return np.asarray((vectors * np.maximum(values, 1e-3 * max(float(values[-1]), 1.0))) @ vectors.T)
    out = pseudo.copy()
    point = np.outer(first, first) / mass
    values, vectors = np.linalg.eigh(pseudo[:3, :3] - point)
    out[:3, :3] = point + (vectors * np.maximum(values, 1e-3 * max(float(values[-1]), mass))) @ vectors.T
    return out
