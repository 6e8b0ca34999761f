"""A team with standing bases: grasps, homes and clocks from poses, and the rows that its payload is weighed by."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.logs.team_log import TeamLog
from steelyard.spatial import Pose
from steelyard.team.adjoint import adjoint_inverse
from steelyard.team.body_rows import BodyRows, balance_frame, from_poses
from steelyard.team.pose_fit import FEW_ROWS, PoseFit, fit_poses
from steelyard.team.pose_rows import OWN
from steelyard.team.pose_start import first_team
from steelyard.team.poses import TeamMotion
from steelyard.team.stacked import Stretch, all_poses, stretches

# Clocks are put right until they move by less than this [s]; the joint fit has allowed for the rest to first order.
PUNCTUAL = 2e-4
# A step of so many (white) standard deviations may be noise: the wrench is not moved for it.
DOUBTED = 4.0
CLOCK_ROUNDS = 6


@dataclass(frozen=True, eq=False)
class PoseTeam:
    """Recordings with their clocks right, the joint fit of poses, and how late each clock is [s]."""

    parts: tuple[Stretch, ...]
    fit: PoseFit
    late: Mapping[str, float]

    @classmethod
    def of(cls, log: TeamLog, clocks: bool) -> PoseTeam:
        """Return the joint fit; raises CannotAnswer where poses or rows in common are missing."""
        reference = log.names.index(log.reference)
        late = dict.fromkeys(log.names, 0.0)
        parts = stretches(log, late)
        data = TeamMotion(*all_poses(parts))
        start = first_team(data, reference, log.names)
        few = slice(None, None, max(1, len(data.valid) // FEW_ROWS if clocks else 1))
        fit = fit_poses(data.rows(few), replace(start, motion=start.motion[few]), reference)
        if len(data.valid) > len(fit.team.motion.position):
            fit = replace(fit, team=replace(fit.team, motion=data.motion_seen(fit.team.grasps, fit.team.homes)))
        if not clocks:
            return cls(parts, fit, late)
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
        return cls(parts, fit, late)

    def rows(self, log: TeamLog, highest_hz: float) -> tuple[list[tuple[BodyRows, Array]], Array]:
        """Return the rows of every recording beside the residuals (T, N, 6) of their poses, and a row's covariance.

        The covariance (6, 6) is that of the path, in the balance frame's axes.
        """
        gravity, fit = _gravity(log, self.fit.team.homes), self.fit
        frame = balance_frame(fit.team.grasps)
        noise = np.linalg.inv(np.einsum("nia,ni,nib->ab", fit.linear.J, fit.linear.W, fit.linear.J))
        noise = adjoint_inverse(frame) @ noise @ adjoint_inverse(frame).T
        out, start = [], 0
        for part in self.parts:
            rows = slice(start, start + len(part))
            start += len(part)
            body = from_poses(part, fit.team.motion[rows] @ frame, part.seen.any(1), gravity, highest_hz)
            out.append((body, fit.linear.residual[rows]))
        return out, noise


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
