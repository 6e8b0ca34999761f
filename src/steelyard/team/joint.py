"""JointTeam: everything that a team measured in one estimate.

poses -> grasps, homes, clocks (joint maximum likelihood) -> fused motion -> ten parameters with bias and gain per
recording
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.logs.team_log import TeamLog
from steelyard.spatial import Pose
from steelyard.team.adjoint import adjoint_inverse
from steelyard.team.assembled import assembled
from steelyard.team.body_rows import BodyRows, balance_frame, from_poses, reach, summing
from steelyard.team.estimate import TeamEstimate
from steelyard.team.motion_noise import motion_noise
from steelyard.team.payload_fit import fit_payload
from steelyard.team.payload_model import Group, unit_bias
from steelyard.team.pose_fit import FEW_ROWS, PoseFit, fit_poses
from steelyard.team.pose_rows import OWN
from steelyard.team.pose_start import first_team
from steelyard.team.poses import TeamMotion
from steelyard.team.published import require_wrenches
from steelyard.team.spectra import band_edges, gathered
from steelyard.team.stacked import Stretch, all_poses, stretches

# Clocks are put right until they move by less than this [s]; the joint fit has allowed for the rest to first order.
PUNCTUAL = 2e-4
# A step of so many (white) standard deviations may be noise: the wrench is not moved for it.
DOUBTED = 4.0
CLOCK_ROUNDS = 6


@dataclass(frozen=True)
class JointTeam:
    """Options of the joint estimator.

    clocks      whether each robot's clock offset is estimated
    gains       whether errors of the force axes' gains are allowed for, as large as the recordings show
    highest_hz  of what motion and wrench are compared at; above, a payload carried by robots hardly moves
    """

    clocks: bool = True
    gains: bool = True
    highest_hz: float = 4.0

    def identify(self, log: TeamLog) -> TeamEstimate:
        """Return the team's answer in the reference grasp. Raises CannotAnswer where the data leave it open."""
        require_wrenches(log)
        parts, fit, late = self._grasps(log)
        grasps = fit.team.grasps
        frame = balance_frame(grasps)
        D, size = summing(frame.inverse() @ grasps), reach(grasps)
        groups = self._groups(log, parts, fit)
        six_axis = np.array([not log.force_only(name) for name in log.names])
        payload = fit_payload(groups, D, unit_bias(D, six_axis, size), size, self.gains)
        return assembled(log, fit, payload, D, late)

    def _grasps(self, log: TeamLog) -> tuple[tuple[Stretch, ...], PoseFit, dict[str, float]]:
        """Return the recordings with their clocks right, the joint fit of poses, and how late each clock is [s]."""
        reference = log.names.index(log.reference)
        late = dict.fromkeys(log.names, 0.0)
        parts = stretches(log, late)
        data = TeamMotion(*all_poses(parts))
        start = first_team(data, reference, log.names)
        few = slice(None, None, max(1, len(data.valid) // FEW_ROWS if self.clocks else 1))
        fit = fit_poses(data.rows(few), replace(start, motion=start.motion[few]), reference)
        if len(data.valid) > len(fit.team.motion.position):
            fit = replace(fit, team=replace(fit.team, motion=data.motion_seen(fit.team.grasps, fit.team.homes)))
        if not self.clocks:
            return parts, fit, late
        for _ in range(CLOCK_ROUNDS):
            timed = replace(data, twist=_twists(parts, fit))
            fit = fit_poses(timed, replace(fit.team, delays=np.zeros(len(log.names))), reference, fit.noise)
            step = fit.team.delays
            doubt = np.zeros_like(step)
            timed_ones = fit.unknown % OWN == OWN - 1
            doubt[fit.unknown[timed_ones] // OWN] = np.sqrt(np.diag(fit.solved.inverse)[timed_ones])
            late = {name: late[name] + float(d) for name, d in zip(log.names, step, strict=True)}
            if (np.abs(step) < np.maximum(PUNCTUAL, DOUBTED * doubt)).all():
                break
            parts = stretches(log, late)
            data = TeamMotion(*all_poses(parts))
            if data.valid.shape[0] != len(fit.team.motion.position):
                fit = replace(fit, team=replace(fit.team, motion=data.motion_seen(fit.team.grasps, fit.team.homes)))
        return parts, fit, late

    def _groups(self, log: TeamLog, parts: tuple[Stretch, ...], fit: PoseFit) -> tuple[Group, ...]:
        """Return the recordings that have complete wrenches, those at rest and those in motion."""
        gravity = _gravity(log, fit.team.homes)
        frame = balance_frame(fit.team.grasps)
        noise = np.linalg.inv(np.einsum("nia,ni,nib->ab", fit.linear.J, fit.linear.W, fit.linear.J))
        noise = adjoint_inverse(frame) @ noise @ adjoint_inverse(frame).T
        made: dict[bool, list[tuple[BodyRows, Array]]] = {True: [], False: []}
        start = 0
        for part in parts:
            rows = slice(start, start + len(part))
            start += len(part)
            body = from_poses(part, fit.team.motion[rows] @ frame, part.seen.any(1), gravity, self.highest_hz)
            if body.runs:
                made[body.still].append((body, fit.linear.residual[rows]))
        groups = tuple(_group(*zip(*some, strict=True), noise, self.highest_hz, 2) for some in made.values() if some)
        if not groups:
            raise CannotAnswer("no recording has rows in which every robot that carries measured a wrench.")
        return groups


def _group(
    rows: tuple[BodyRows, ...], residuals: tuple[Array, ...], noise: Array, highest_hz: float, order: int
) -> Group:
    edges = band_edges(rows, highest_hz)
    spectra = tuple(gathered(r, edges, highest_hz) for r in rows)
    return Group(spectra, motion_noise(rows, residuals, noise, edges, highest_hz, order), np.ones((len(edges), 6)))


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
