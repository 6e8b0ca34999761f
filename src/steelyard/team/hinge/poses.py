"""Grasps, homes, clocks and hinge of a team whose payload is two bodies with a hinge, all from poses.

With the first body X(t) in the home of the reference robot, the hinge's screw s at the angle q(t), and S_i = exp(q s)
for robots that hold the second body, the identity for the others,
    T_i(t) = Z_i^-1 X(t) S_i(t) G_i exp(e_i),   e_i ~ N(0, W^-1).
A row has seven unknowns of motion, which are eliminated row by row; homes of robots that share no body are tied to each
other by the hinge alone. Robots are taken to err alike: a body that one robot holds tells little of how that robot
errs. In `poses.fit`, of one body, what a row says of its motion depends on who was seen alone, so that rows are summed
before they are weighed; here it changes with the angle, and every row has equations of its own.
Source: own; the paper names jointed payloads as future work.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array, Integers, Mask
from steelyard.spatial import Pose, Rotation
from steelyard.spatial.screws import log_pose
from steelyard.team.adjoint import adjoint_inverse, exp
from steelyard.team.adjoint import log as pose_log
from steelyard.team.definite import shown_axes
from steelyard.team.poses.covariance import WIDTH, sum_variance
from steelyard.team.poses.measured import TeamMotion
from steelyard.team.poses.solver import OWN

STEPS = 30
# A fit is done where a step lowers chi^2 by less than this and noise changes by a smaller share.
CLOSE, SETTLED = 1e-6, 1e-3
# Noise to begin with, and what encoders resolve at best [rad, m].
GUESS, LEAST = np.array([1e-3, 1e-3]), np.array([1e-7, 1e-7])
# Rows on which what the motion takes up is worked out for the noise, and windows that tell how noise is correlated.
JUDGED, WINDOWS = 40, 30
# Rows that are worked on at a time where all are: they need some 10 kB each with four robots.
CHUNK = 2000
# Information along a direction, in units of its parameters' own, below which it is one that nothing can show.
NULL = 1e-9
# Directions that nothing can show: the hinge along and about itself, the angle that counts as zero.
FREE = 3


@dataclass(frozen=True, eq=False)
class Hinged:
    """Where everything is.

    grasps  G (N,) in the reference grasp R, those of the second body with the hinge at zero     homes  Z (N,)
    second  (N,) which robots hold the second body; the reference holds the first
    axis    (3,) of the hinge, a unit vector, and a point (3,) [m] on it, in R
    motion  X (T,) of R in the reference home     angle  (T,) of the hinge [rad]
    delays  (N,) [s] how late each clock stamps
    """

    grasps: Pose
    homes: Pose
    second: Mask
    axis: Array
    point: Array
    motion: Pose
    angle: Array
    delays: Array

    @property
    def screw(self) -> Array:
        """Twist (6,) of the second body in R per unit rate of the angle."""
        return np.concatenate([self.axis, np.cross(self.point, self.axis)])

    def rows(self, chosen: slice | Integers) -> Hinged:
        """Return the team with some of the rows."""
        return replace(self, motion=self.motion[chosen], angle=self.angle[chosen])

    def placed(self) -> Pose:
        """Return every grasp seen from R (T, N), those of the second body turned by the hinge."""
        turn = Rotation.exp(self.angle[:, None] * self.axis).matrix[:, None]
        R = np.where(self.second[:, None, None], turn, np.eye(3))
        lever = np.where(self.second[:, None], self.point, 0.0)
        place = lever + np.einsum("tnij,nj->tni", R, self.grasps.position - lever)
        return Pose(Rotation(R @ self.grasps.rotation.matrix), place)

    def moved(self, step: Array, paths: Array) -> Hinged:
        """Return the team after steps of the parameters (13 N + 6,) and of the motion (T, 7)."""
        each, line = step[:-6].reshape(-1, OWN), exp(step[-6:])
        return replace(
            self, grasps=self.grasps @ exp(each[:, :6]), homes=self.homes @ exp(each[:, 6:12]),
            delays=self.delays + each[:, 12], axis=line.rotation.apply(self.axis), point=line.apply(self.point),
            motion=self.motion @ exp(paths[:, :6]), angle=self.angle + paths[:, 6],
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class HingedFit:
    """The optimum, with the covariance (13 N + 6,) of its parameters that holds for correlated noise.

    residual  (T, N, 6) of the rows that were fitted, in each grasp's own axes     noise  (2,) [rad, m]
    path      (7, 7) covariance of a row of the motion: X in its own axes, and the angle
    lost      how many directions beyond those that nothing can show the motion leaves open
    """

    team: Hinged
    covariance: Array
    residual: Array
    noise: Array
    path: Array
    lost: int


def rates(team: Hinged, rate: float) -> Array:
    """Return twist of X and rate of the angle (T, 7) of one recording; zero at the ends, where one side is known."""
    half, out = max(1, round(0.05 * rate)), np.zeros((len(team.angle), 7))
    if len(out) > 2 * half:
        between = team.motion[: -2 * half].inverse() @ team.motion[2 * half :]
        out[half:-half, :6] = log_pose(between) * (rate / (2 * half))
        out[half:-half, 6] = (team.angle[2 * half :] - team.angle[: -2 * half]) * (rate / (2 * half))
    return out


def _seen(data: TeamMotion, team: Hinged) -> tuple[Array, Array, Array]:
    """Return residuals (T, N, 6), how predictions move with the motion (T, N, 6, 7), and Ad^-1 of them (T, N, 6, 6)."""
    placed = team.placed()
    predicted = team.homes.inverse() @ (team.motion[:, None] @ placed)
    left = pose_log(predicted.inverse() @ data.poses) * data.valid[..., None]
    along = np.zeros((*left.shape, 7))
    along[..., :6] = adjoint_inverse(placed)
    along[..., 6][:, team.second] = adjoint_inverse(team.grasps[team.second]) @ team.screw
    return left, along, adjoint_inverse(predicted)


def _slopes(team: Hinged, along: Array, turned: Array, speed: Array | None, robot: int) -> Array:
    """Return how predictions of one robot (T, 6) move with its own 13 parameters and the hinge's 6."""
    out = np.zeros((len(along), 6, OWN + 6))
    out[..., :6] = np.eye(6)
    out[..., 6:12] = -turned[:, robot]
    if speed is not None:
        out[..., 12] = -np.einsum("tab,tb->ta", along[:, robot], speed)
    if team.second[robot]:
        out[..., OWN:] = along[:, robot, :, :6] - adjoint_inverse(team.grasps[robot])
    return out


def _inner(along: Array, W: Array) -> Array:
    """Return the inverse information (T, 7, 7) about the motion; a breath of ridge where a body is not seen.

    Rows that nobody saw say nothing: any motion will do, and the identity stands for what is known of it.
    """
    A = np.einsum("tnai,tna,tnaj->tij", along, W, along, optimize=True)
    size = A[:, range(7), range(7)].max(1)
    ridge = np.where(size > 0, 1e-10 * size, 1.0)
    return np.asarray(np.linalg.inv(A + ridge[:, None, None] * np.eye(7)))


def followed(data: TeamMotion, team: Hinged, noise: Array, sweeps: int) -> Hinged:
    """Return the team with its motion (T,) where grasps, homes and hinge put it."""
    W = np.repeat(noise**-2.0, 3) * data.valid[..., None]
    for _ in range(sweeps):
        left, along, _ = _seen(data, team)
        step = np.einsum("tij,tnaj,tna->ti", _inner(along, W), along, W * left, optimize=True)
        team = team.moved(np.zeros(OWN * data.count + 6), step)
    return team


@dataclass(frozen=True, eq=False)
class _Normal:
    """One Gauss-Newton step with the motion eliminated: H (P, P), scores (T, P), and what the motion answers.

    inside (T, 7) of the residuals, carried (T, 7, P) of the parameters     inner (T, 7, 7) its covariance
    """

    H: Array
    scores: Array
    inside: Array
    carried: Array
    inner: Array
    left: Array
    along: Array

    @classmethod
    def of(cls, data: TeamMotion, team: Hinged, noise: Array, speed: Array | None) -> _Normal:
        """Return the step's equations in all 13 N + 6 parameters."""
        left, along, turned = _seen(data, team)
        if speed is not None:
            late = np.einsum("tnai,ti->tna", along, speed) * team.delays[:, None]
            left = left + late * data.valid[..., None]
        rows, count = data.valid.shape
        size = OWN * count + 6
        W = np.repeat(noise**-2.0, 3) * data.valid[..., None]
        inner = _inner(along, W)
        H, scores, pulled = np.zeros((size, size)), np.zeros((rows, size)), np.zeros((rows, 7, size))
        inside = np.zeros((rows, 7))
        for i in range(count):
            own = np.concatenate([OWN * i + np.arange(OWN), OWN * count + np.arange(6)])
            J = _slopes(team, along, turned, speed, i)
            weighed = J * W[:, i, :, None]
            H[np.ix_(own, own)] += J.reshape(-1, OWN + 6).T @ weighed.reshape(-1, OWN + 6)
            pulled[..., own] += np.swapaxes(along[:, i], 1, 2) @ weighed
            scores[:, own] += np.einsum("tap,ta->tp", weighed, left[:, i])
            inside += np.einsum("tai,ta->ti", along[:, i], W[:, i] * left[:, i])
        inside = np.einsum("tij,tj->ti", inner, inside)
        carried = inner @ pulled
        H -= pulled.reshape(-1, size).T @ carried.reshape(-1, size)
        scores -= np.einsum("tip,ti->tp", pulled, inside)
        return cls(H, scores, inside, carried, inner, left, along)

    def path(self, data: TeamMotion) -> Array:
        """Return the mean covariance (7, 7) of a row of the motion: one that all robots saw, where there is any."""
        whole = data.valid.all(1)
        return np.asarray(self.inner[whole if whole.any() else data.valid.any(1)].mean(0))

    def noise(self, data: TeamMotion, noise: Array) -> Array:
        """Return the noise (2,) after one step of restricted maximum likelihood, which knows what the motion takes up.

        Residuals that fit the motion best are those of M e = W e, M = W - W L A^-1 L^T W. Source: as `poses.noise`.
        """
        rows, count = data.valid.shape
        some = np.linspace(0, rows - 1, min(rows, JUDGED)).astype(np.int64)
        W = (np.repeat(noise**-2.0, 3) * data.valid[some][..., None]).reshape(len(some), -1)
        L = self.along[some].reshape(len(some), 6 * count, 7) * W[..., None]
        M = -L @ self.inner[some] @ np.swapaxes(L, 1, 2)
        M[:, range(6 * count), range(6 * count)] += W
        kind = np.tile(np.repeat([0, 1], 3), count)
        pick = np.eye(2)[kind]
        size = np.einsum("taa,ak->k", M, pick) * (rows / len(some))
        squares = np.einsum("tab,ak,bl->kl", M**2, pick, pick, optimize=True) * (rows / len(some))
        variance = noise**2
        # The motion followed another noise: what it should have taken up is taken out here.
        left = self.left - np.einsum("tnai,ti->tna", self.along, self.inside) * data.valid[..., None]
        slope = 0.5 * variance * ((left**2).reshape(-1, 2, 3).sum((0, 2)) / variance**2 - size)
        curve = 0.5 * np.outer(variance, variance) * squares
        step = np.linalg.solve(curve + 1e-9 * np.trace(curve) * np.eye(2), slope)
        return np.asarray(np.maximum(noise * np.sqrt(np.exp(np.clip(step, -3.0, 3.0))), LEAST))


def fit_hinged(data: TeamMotion, start: Hinged, reference: int, noise: Array, speed: Array | None) -> HingedFit:
    """Return the optimum near `start`; delays are estimated where the motion's `speed` (T, 7) is given."""
    count, team = data.count, start
    unknown = _unknown(count, reference, speed is not None)
    for _ in range(STEPS):
        now = _Normal.of(data, team, noise, speed)
        H, pull = now.H[np.ix_(unknown, unknown)], now.scores[:, unknown].sum(0)
        inverse, lost = _inverse(H, speed is not None)
        step = np.zeros(OWN * count + 6)
        step[unknown] = inverse @ pull
        team = team.moved(step, now.inside - now.carried @ step)
        new = now.noise(data, noise)
        settled = bool(np.abs(np.log(new / noise)).max() < SETTLED)
        noise = new
        if settled and float(step[unknown] @ pull) < CLOSE:
            break
    team, spread = _centred(team, unknown, now.carried[:, 6].mean(0))
    inflated = _inflation(now.scores[:, unknown], H) * inverse
    return HingedFit(team, spread @ inflated @ spread.T, now.left, noise, now.path(data), lost)


def finished(data: TeamMotion, fit: HingedFit, reference: int, speed: Array | None) -> HingedFit:
    """Return a fit of some rows, whose team has the motion (T,) of all, after one step with all rows, CHUNK at a time.

    One step is enough so near the optimum; the residuals are those after it.
    """
    count, rows = data.count, len(data.valid)
    unknown = _unknown(count, reference, speed is not None)
    H, scores, answer = np.zeros((OWN * count + 6,) * 2), [], np.zeros(OWN * count + 6)
    for start in range(0, rows, CHUNK):
        some = slice(start, start + CHUNK)
        now = _Normal.of(data.rows(some), fit.team.rows(some), fit.noise, None if speed is None else speed[some])
        H += now.H
        scores.append(now.scores[:, unknown])
        answer += now.carried[:, 6].sum(0) / rows
    every, H = np.concatenate(scores), H[np.ix_(unknown, unknown)]
    inverse, lost = _inverse(H, speed is not None)
    step = np.zeros(OWN * count + 6)
    step[unknown] = inverse @ every.sum(0)
    team = followed(data, fit.team.moved(step, np.zeros((rows, 7))), fit.noise, 1)
    team, spread = _centred(team, unknown, answer)
    inflated = _inflation(every, H) * inverse
    return HingedFit(team, spread @ inflated @ spread.T, _seen(data, team)[0], fit.noise, fit.path, lost)


def _unknown(count: int, reference: int, timed: bool) -> Integers:
    """Return which of the 13 N + 6 parameters are unknown: the reference's grasp and home, and clocks, may be known."""
    known = np.concatenate([OWN * reference + np.arange(12), np.arange(0 if timed else count) * OWN + 12])
    return np.setdiff1d(np.arange(OWN * count + 6), known)


def _inverse(H: Array, timed: bool) -> tuple[Array, int]:
    """Return the inverse of H along what is shown, and how many directions are not, beyond those that nothing can show.

    timed  whether clocks are among the unknown: what they have in common shows in nothing
    """
    root, values = shown_axes(H, NULL)
    return (root / values) @ root.T, max(len(H) - root.shape[1] - FREE - timed, 0)


def _inflation(scores: Array, H: Array) -> float:
    """Return how many times larger than for white noise the variance of the scores is."""
    part = max(1, len(scores) // (WIDTH * WINDOWS))
    variance = sum_variance(np.add.reduceat(scores, np.arange(0, len(scores), part), axis=0))
    return max(1.0, float((variance / np.maximum(np.diag(H), 1e-300)).mean()))


def _centred(team: Hinged, unknown: Integers, carried: Array) -> tuple[Hinged, Array]:
    """Return the team with angles that are zero on average, and how the parameters (13 N + 6, P) go with the unknown.

    carried  (13 N + 6,) minus the mean angle's answer to the parameters: it moves the second body's grasps
    """
    spread = np.zeros((len(carried), len(unknown)))
    spread[unknown] = np.eye(len(unknown))
    middle = float(team.angle.mean())
    turn = Rotation.exp(middle * team.axis)
    back = Pose(turn, team.point - turn.apply(team.point))
    grasps = np.array(team.grasps.matrix())
    grasps[team.second] = back.matrix() @ grasps[team.second]
    team = replace(team, grasps=Pose.from_matrix(grasps), angle=team.angle - middle)
    for i in np.flatnonzero(team.second):
        spread[OWN * i : OWN * i + 6] -= np.outer(adjoint_inverse(team.grasps[i]) @ team.screw, carried[unknown])
    return team, spread
