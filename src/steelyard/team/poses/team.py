"""A team with standing bases: grasps, homes and clocks from poses, and the rows that its payload is weighed by."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.logs.team_log import TeamLog
from steelyard.spatial import Pose, Rotation
from steelyard.team.adjoint import adjoint_inverse, twists_between
from steelyard.team.changes.found import Edit, without_changes
from steelyard.team.changes.slips import Slip
from steelyard.team.changes.slips_between import slip_between
from steelyard.team.clocks.errors import ClockErrors
from steelyard.team.clocks.unsteady import clock_errors
from steelyard.team.motion_fit import CLOCK_ROUNDS, DOUBTED, LEVEL, PUNCTUAL, MotionFit, Tilted, later, tilted, unlevel
from steelyard.team.payload.body_rows import PayloadRows, balance_frame, from_poses
from steelyard.team.poses import rows as pose_rows
from steelyard.team.poses.covariance import Spread
from steelyard.team.poses.fit import NEARLY, ROUGHLY, PoseFit, Rows, fit_poses
from steelyard.team.poses.measured import ENOUGH, Team, TeamMotion, first_team
from steelyard.team.poses.recurring import shares_at_rest
from steelyard.team.stacked import Stretch, stretches, with_rows

# Clocks that were moved are moved until they stand still to this [s]: a step of 10 ms depends by a microsecond on who
# is the reference, and by where noisy rows are then read the answer does in its sixth digit.
STILL = 1e-7
# Clocks that move by less [s] leave what the rows say as it is: nobody turns a payload far in that time.
UNCHANGED = 0.02
# Rows that are enough to come near the optimum; all rows then finish. A row of many robots says more of the motion, so
# that so many poses of all robots together are enough.
FEW_ROWS, FEW_POSES = 1500, 4500
# Sweeps over a row with which the motion follows grasps and homes from wherever it was.
FOLLOWED = 2
# Noise above this share of the motion asks whether the payload is rigid.
LOUD = 0.05
# From this share on nobody can say that the payload turned at all.
STILL_TURNS = 0.9
HELD = "The mean was taken, and bars hold how far it may be off."


@dataclass(frozen=True, eq=False)
class PoseTeam(MotionFit):
    """The joint fit of poses; how late clocks are is zero on average."""

    parts: tuple[Stretch, ...]
    fit: PoseFit

    @classmethod
    def of(cls, log: TeamLog, clocks: bool, other: Sequence[bool] = ()) -> PoseTeam:
        """Return the joint fit; raises CannotAnswer where poses or rows in common are missing.

        Robots that let go for a while and grasps that slip are found on the way; `other` as in `without_changes`.
        """
        raw = stretches(log, {})
        return without_changes(log, clocks, raw, lambda edit: cls._fitted(log, clocks, raw, edit), other)

    @classmethod
    def _fitted(cls, log: TeamLog, clocks: bool, parts: tuple[Stretch, ...], edit: Edit) -> PoseTeam:
        """Return the fit of recordings as they are (`parts`) after an edit."""
        reference = log.names.index(log.reference)
        late = dict.fromkeys(log.names, 0.0)
        parts = edit(parts)
        data = TeamMotion.of(parts)
        enough = min(FEW_ROWS, max(ENOUGH, FEW_POSES // data.count))
        few = slice(None, None, max(1, len(data.valid) // enough))
        start = first_team(data, reference, log.names, _down(log), few)
        fit = fit_poses(data.rows(few), start, reference, close=ROUGHLY)
        timed = data
        if not clocks:
            fit = fit_poses(data, _followed(data, fit), reference, fit.noise)
        known, close = None, ROUGHLY
        for left in reversed(range(CLOCK_ROUNDS if clocks else 0)):
            team = _followed(data, fit)
            timed = replace(data, twist=_twists(parts, team))
            fit = fit_poses(timed, replace(team, delays=np.zeros(data.count)), reference, fit.noise, close, known)
            step = np.abs(fit.team.delays)
            near = STILL if any(late.values()) else np.maximum(PUNCTUAL, DOUBTED * fit.doubt)
            if not left or (step < near).all():
                break
            known, close = fit.known if step.max() < UNCHANGED else None, NEARLY
            late = later(late, fit.team.delays)
            parts = edit(stretches(log, late))
            data = TeamMotion.of(parts)
        share = shares_at_rest(parts, fit)
        if share is not None:
            fit = fit_poses(replace(timed, share=share), fit.team, reference, fit.noise)
        elif clocks:
            fit = fit_poses(timed, fit.team, reference, fit.noise, known=fit.known)
        return cls(parts, fit, later(late, fit.team.delays))

    def clock_errors(self, log: TeamLog) -> ClockErrors:
        """Return what clocks seem to be off by in single recordings."""
        slope = (self.fit.rows.data.twist[rows] for _, rows in with_rows(self.parts))
        return clock_errors(log, self._left(), slope, self.J, self.W)

    def _left(self) -> list[tuple[Stretch, Array]]:
        return [(part, self.fit.rows.residual[rows]) for part, rows in with_rows(self.parts)]

    def _left_of_all(self, log: TeamLog) -> list[tuple[Stretch, Array]]:
        every = zip(stretches(log, self.late), with_rows(self.parts), strict=True)
        return [(raw, self._residuals(raw, rows.start)) for raw, (_, rows) in every]

    def _slip_between(self, log: TeamLog, parts: Sequence[Stretch], apart: Sequence[Array]) -> Slip | None:
        return slip_between(parts, apart)

    @cached_property
    def rough(self) -> bool:
        """Whether poses err by a good part of what the payload moves, as they do where it is not rigid."""
        return bool((self.fit.noise > LOUD * self.fit.team.extent).any())

    @property
    def apart(self) -> Array | None:
        """By how much robots disagree (2,) [rad, m], where that is a good part of a turn that is more than it."""
        worst = self.fit.noise.max(0)
        return worst if LOUD < worst[0] / self.fit.team.extent[0] < STILL_TURNS else None

    def down(self, log: TeamLog) -> Array:
        """Return the mean direction of gravity (3,) in R."""
        mean = mean_gravity(log, self.fit.team.homes) @ self.fit.team.mean_turn
        return np.asarray(mean / max(float(np.linalg.norm(mean)), 1e-300))

    def tilt(self, log: TeamLog, spread: Spread) -> Tilted | None:
        """Return who disagrees on where gravity points, for homes turned as well as grasps are known to be."""
        return tilted(log.names, self._called_down(log), spread, HELD)

    def tipped(self, log: TeamLog, spread: Spread) -> tuple[Array, ...]:
        """Return turns (3,) of gravity in H about two level axes, as far as bases leave open; none if they agree."""
        off, down = unlevel(self._called_down(log), spread), mean_gravity(log, self.fit.team.homes)
        return tuple(off * way for way in np.linalg.svd(down[None])[2][1:]) if off else ()

    def _called_down(self, log: TeamLog) -> Array:
        """Return in H what each robot calls down (N, 3), zero of those who do not tell."""
        return np.asarray(np.einsum("nij,nj->ni", self.fit.team.homes.rotation.matrix, _down(log)))

    def level(self, log: TeamLog) -> Array:
        """Return the direction of gravity over how well it is known (N, 3), as in `Spread`."""
        team, said = self.fit.team, _down(log)
        seen = np.einsum("ba,nbc,nc->na", team.mean_turn, team.homes.rotation.matrix, said)
        own = seen[log.names.index(log.reference)]
        apart = np.linalg.norm(seen - own, axis=1, keepdims=True)
        told = said.any(1, keepdims=True) & own.any()
        return np.where(told, team.grasps.rotation.inverse().apply(seen) / np.hypot(LEVEL, apart), 0.0)

    def _residuals(self, raw: Stretch, start: int) -> Array:
        """Return rotation vector and position (T, N, 6) from where the team says to what was measured, used or not."""
        motion = self.fit.team.motion[np.minimum(start + np.arange(len(raw)), len(self.fit.team.motion.position) - 1)]
        G, Z = self.fit.grasps, self.fit.team.homes
        return pose_rows.residuals(
            raw.poses.rotation.matrix, raw.poses.position, raw.seen, G.rotation.matrix, G.position, Z.rotation.matrix,
            Z.position, motion.rotation.matrix, motion.position,
        )  # fmt: skip

    def rows(self, log: TeamLog, highest_hz: float, tip: Array | None = None) -> tuple[PayloadRows, Array]:
        """Return the rows of every recording beside the residuals (T, N, 6) of their poses, and a row's covariance.

        The covariance (6, 6) is that of the path, in the balance frame's axes.

        tip  (3,) [rad] by which gravity is turned in H
        """
        gravity, fit = mean_gravity(log, self.fit.team.homes), self.fit
        gravity = gravity if tip is None else Rotation.exp(tip).apply(gravity)
        frame = balance_frame(fit.grasps)
        noise = np.linalg.inv(np.einsum("nia,ni,nib->ab", self.J, self.W, self.J))
        noise = adjoint_inverse(frame) @ noise @ adjoint_inverse(frame).T
        out = []
        for part, rows in with_rows(self.parts):
            body = from_poses(part, fit.team.motion[rows] @ frame, np.asarray(part.seen.any(1)), gravity, highest_hz)
            out.append((body, fit.rows.residual[rows]))
        return out, noise


def _followed(data: TeamMotion, fit: PoseFit) -> Team:
    """Return the team of a fit with the motion that its grasps and homes give the rows of `data`."""
    seen = replace(fit.team, motion=data.motion_seen(fit.grasps, fit.team.homes), delays=0 * fit.team.delays)
    return Rows.settled(data, seen, fit.noise, FOLLOWED).team


def _twists(parts: tuple[Stretch, ...], team: Team) -> Array:
    """Return how each grasp's pose moves (T, N, 6) in its own axes per second that its stamps are late.

    At the ends of recordings, where only one side is known, it stays zero.
    """
    J, out = adjoint_inverse(team.grasps), []
    for part, rows in with_rows(parts):
        motion = team.motion[rows]
        half = max(1, round(0.05 * part.rate))
        twist = np.zeros((len(part), 6))
        if len(part) > 2 * half:
            between = twists_between(motion[: -2 * half], motion[2 * half :])
            twist[half:-half] = between * (part.rate / (2 * half))
        out.append(-(twist @ J.reshape(-1, 6).T).reshape(len(part), -1, 6))
    return np.concatenate(out)


def _down(log: TeamLog) -> Array:
    """Return the direction of gravity (N, 3) in every home, zero where the base does not tell it."""
    said = [np.zeros(3) if r.gravity is None else r.gravity / np.linalg.norm(r.gravity) for r in log.robots]
    return np.array(said)


def mean_gravity(log: TeamLog, homes: Pose) -> Array:
    """Return gravity (3,) [m/s^2] in the reference home: the mean of what the robots' level bases say."""
    said = [homes[i].rotation.apply(r.gravity) for i, r in enumerate(log.robots) if r.gravity is not None]
    if not said:
        raise CannotAnswer("somebody must know where gravity points: give [team] gravity for level bases.")
    size = np.mean([np.linalg.norm(one) for one in said])
    mean = np.mean(said, axis=0)
    return np.asarray(mean * (size / np.linalg.norm(mean)))
