"""JointTeam: everything that a team measured in one estimate.

poses -> grasps, homes, clocks (joint maximum likelihood) -> fused motion -> ten parameters with a bias per recording
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.identify.estimate import Evidence
from steelyard.identify.regressor import design
from steelyard.inertia import InertialParameters
from steelyard.logs.moments import features
from steelyard.logs.team_log import TeamLog
from steelyard.spatial import Pose, cross, cross_matrix
from steelyard.team.adjoint import adjoint_inverse
from steelyard.team.estimate import GraspEstimate, TeamEstimate
from steelyard.team.fused_motion import Balance, Fused, fused
from steelyard.team.payload_fit import PayloadFit, fit_payload
from steelyard.team.pose_covariance import grasp_covariance
from steelyard.team.pose_fit import PoseFit, fit_poses
from steelyard.team.pose_rows import OWN
from steelyard.team.pose_start import first_team
from steelyard.team.poses import TeamMotion
from steelyard.team.published import require_wrenches
from steelyard.team.stacked import Stretch, all_poses, stretches

# Clocks are put right until they move by less than this [s].
PUNCTUAL = 2e-5
CLOCK_ROUNDS = 6


@dataclass(frozen=True)
class JointTeam:
    """Options of the joint estimator.

    clocks     whether each robot's clock offset is estimated
    cutoff_hz  of the filter that motion and wrench go through before the ten parameters are fitted
    """

    clocks: bool = True
    cutoff_hz: float = 3.0

    def identify(self, log: TeamLog) -> TeamEstimate:
        """Return the team's answer in the reference grasp. Raises CannotAnswer where the data leave it open."""
        require_wrenches(log)
        parts, fit, late = self._grasps(log)
        rows = self._rows(log, parts, fit)
        payload = fit_payload(rows, _unit_bias(fit.team.grasps))
        return _assembled(log, fit, rows, payload, late)

    def _grasps(self, log: TeamLog) -> tuple[tuple[Stretch, ...], PoseFit, dict[str, float]]:
        """Return the recordings with their clocks right, the joint fit of poses, and how late each clock is [s]."""
        reference = log.names.index(log.reference)
        late = dict.fromkeys(log.names, 0.0)
        parts = stretches(log, late)
        data = TeamMotion(*all_poses(parts))
        fit = fit_poses(data, first_team(data, reference, log.names), reference)
        if not self.clocks:
            return parts, fit, late
        for _ in range(CLOCK_ROUNDS):
            timed = replace(data, twist=_twists(parts, fit))
            fit = fit_poses(timed, replace(fit.team, delays=np.zeros(len(log.names))), reference, fit.noise)
            step = fit.team.delays
            late = {name: late[name] + float(d) for name, d in zip(log.names, step, strict=True)}
            if np.abs(step).max() < PUNCTUAL:
                break
            parts = stretches(log, late)
            data = TeamMotion(*all_poses(parts))
            if data.valid.shape[0] != len(fit.team.motion.position):
                fit = replace(fit, team=replace(fit.team, motion=data.motion_seen(fit.team.grasps, fit.team.homes)))
        return parts, fit, late

    def _rows(self, log: TeamLog, parts: tuple[Stretch, ...], fit: PoseFit) -> tuple[Fused, ...]:
        """Return the rows of every recording that has complete wrenches."""
        gravity = _gravity(log, fit.team.homes)
        noise = np.linalg.inv(np.einsum("nia,ni,nib->ab", fit.linear.J, fit.linear.W, fit.linear.J))
        out, start = [], 0
        for part in parts:
            motion = fit.team.motion[start : start + len(part)]
            start += len(part)
            made = fused(part, motion, fit.team.grasps, gravity, noise, self.cutoff_hz)
            if made is not None:
                out.append(made)
        if not out:
            raise CannotAnswer("no recording has rows in which every robot that carries measured a wrench.")
        return tuple(out)


def _twists(parts: tuple[Stretch, ...], fit: PoseFit) -> Array:
    """Return how each grasp's pose moves (T, N, 6) in its own axes per second that its stamps are late."""
    J, start, out = adjoint_inverse(fit.team.grasps), 0, []
    for part in parts:
        motion = fit.team.motion[start : start + len(part)]
        start += len(part)
        half = max(1, round(0.05 * part.rate))
        twist = np.zeros((len(part), 6))
        if len(part) > 2 * half:
            before, after = motion[: -2 * half], motion[2 * half :]
            R = motion[half:-half].rotation.inverse()
            span = 2 * half / part.rate
            twist[half:-half, :3] = (before.rotation.inverse() @ after.rotation).log() / span
            twist[half:-half, 3:] = R.apply(after.position - before.position) / span
        out.append(-np.einsum("nij,tj->tni", J, twist))
    return np.concatenate(out)


def _gravity(log: TeamLog, homes: Pose) -> Array:
    """Return gravity (3,) [m/s^2] in the reference home: the mean of what the robots' level bases say."""
    said = [homes[i].rotation.apply(r.gravity) for i, r in enumerate(log.robots) if r.gravity is not None]
    if not said:
        raise CannotAnswer("somebody must know where gravity points: give [team] gravity for level bases.")
    own = log.robot(log.reference).gravity
    return np.asarray(said[0] if own is None else own)


def _unit_bias(grasps: Pose) -> Array:
    """Return what a bias of one newton, drawn for every force axis of every grasp, adds up to in B (6, 6)."""
    balance = Balance.of(grasps).X_RB
    places = balance.inverse().apply(grasps.position)
    arms = cross_matrix(places)
    out = np.zeros((6, 6))
    out[:3, :3] = np.einsum("nij,nkj->ik", arms, arms)
    out[3:, 3:] = len(places) * np.eye(3)
    out[:3, 3:] = arms.sum(0)
    out[3:, :3] = out[:3, 3:].T
    return out + 1e-6 * np.eye(6)


def _assembled(
    log: TeamLog, fit: PoseFit, rows: tuple[Fused, ...], payload: PayloadFit, late: Mapping[str, float]
) -> TeamEstimate:
    grasps = fit.team.grasps
    balance = Balance.of(grasps).X_RB
    spread = grasp_covariance(fit)
    moved = _moved_by_grasps(rows, payload, grasps, balance)
    inner = payload.covariance + moved @ spread.full @ moved.T
    body = InertialParameters(payload.parameters).in_frame(balance)
    change = np.stack([InertialParameters(row).in_frame(balance).vector for row in np.eye(10)], axis=1)
    estimates = {name: GraspEstimate(grasps[i], spread.of(i), spread.lost(i)) for i, name in enumerate(log.names)}
    left = np.concatenate([r.log.wrench for r in rows])
    return TeamEstimate(
        parameters=body,
        covariance=change @ inner @ change.T,
        method="joint",
        evidence=Evidence(10, 1.0, len(left), 0, 0.0, 0.0, payload.chi2),
        identified=np.ones(10, np.bool_),
        frame=log.reference,
        reference=log.reference,
        grasps=estimates,
        clock_offsets_s=dict(late) if fit.unknown.size % (OWN - 1) else {},
        clock_offset_std_s=spread.delays(log.names),
    )


def _moved_by_grasps(rows: tuple[Fused, ...], payload: PayloadFit, grasps: Pose, balance: Pose) -> Array:
    """Return d phi / d grasps (10, 6 N) for steps in each grasp's own axes: from elsewhere, a force has another moment.

    A constant part goes to the bias of its recording.
    """
    count = len(grasps.position)
    places = balance.inverse() @ grasps
    out = np.zeros((10, 6 * count))
    for r, log, W in zip(rows, payload.logs, payload.weights, strict=True):
        weighted = np.einsum("pij,tj,ik->tpk", -design(False), features(log), W[0])
        for i in range(count):
            for k in range(6):
                change = _step_of_wrench(places[i], r.shares[i], k)
                out[:, 6 * i + k] += np.einsum("tpk,tk->p", weighted, change - change.mean(0))
    return np.linalg.solve(payload.information, out)


def _step_of_wrench(X_BG: Pose, share: Array, k: int) -> Array:
    """Return how a grasp's wrench at B (T, 6) changes per step k of the grasp in its own axes."""
    axis = np.broadcast_to(X_BG.rotation.matrix[:, k % 3], (len(share), 3))
    force = share[:, 3:]
    if k >= 3:
        return np.concatenate([cross(axis, force), np.zeros_like(force)], axis=1)
    place = np.broadcast_to(X_BG.position, force.shape)
    turned = cross(axis, force)
    return np.concatenate([cross(axis, share[:, :3] - cross(place, force)) + cross(place, turned), turned], axis=1)
