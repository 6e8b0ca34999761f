"""Grasps, and the arms behind them, that yield to what they push: grippers stand off from where they hold.

With e_i what the poses of robot i leave, w_i its wrench and c_i what its grasp yields per newton (and newton metre),
    e_i = c_i w_i,
beside grasps and homes, which the fit has set as well as it could, and the payload's motion. Poses are put right by
what the wrench of the same row makes of them, and the wrench is moved to where the grasp is: grasps are told as they
are without a load.
Source: own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import FAILURES, Array, Integers
from steelyard.findings import Finding
from steelyard.logs.team_log import TeamLog
from steelyard.logs.team_track import Track
from steelyard.spatial import Pose, Rotation, cross
from steelyard.team.adjoint import adjoint_inverse
from steelyard.team.poses.covariance import Spread
from steelyard.team.poses.team import PoseTeam
from steelyard.team.scores import Scores

# Rows that are enough, stretches that they are cut into, and the least there must be.
ROWS, STRETCHES, LEAST = 3000, 40, 200
# A grasp yields where it does so by this many standard deviations, all axes alike; axes differ by about this share.
# Below SUSPECT, beside grasps and homes as they are, it is not looked into.
BEYOND, ALIKE, SUSPECT = 6.0, 0.5, 4.0
# Rounds in which it is put right, until it changes by less than so many standard deviations.
ROUNDS, SETTLED = 4, 0.3
# By how much noise must fall, on average, where robots disagree by a good part of what they move.
BETTER = 2.0


@dataclass(frozen=True, eq=False)
class Yields:
    """How far every grasp yields, per newton metre and newton about and along its axes (N, 6).

    std    (N, 6), infinite where nothing is pushed
    mean   (N, 6) mean wrench [N m, N]
    """

    size: Array
    std: Array
    mean: Array

    def corrected(self, log: TeamLog) -> TeamLog:
        """Return the log with poses and wrenches as they would be if no grasp yielded.

        Where a wrench is not known, poses are off by the mean one, and left out where other recordings in motion do.
        """
        yielding = [i for i in range(len(log.names)) if self.size[i].any()]
        felt = (
            {name for name, track in r.tracks.items() if track.has("force")}
            for r in log.recordings
            if r.kind != "still"
        )
        enough = any(names >= {log.names[i] for i in yielding} for names in felt)
        by_name = {log.names[i]: (self.size[i], self.mean[i], enough) for i in yielding}
        return log.with_recordings(*(r.changed(_stiff, by_name) for r in log.recordings))

    def widened(self, spread: Spread, grasps: Pose, reference: int) -> Spread:
        """Return the spread of the grasps (N,) with what is open of how far the mean load moves them."""
        return _moved(spread, grasps, reference, np.where(self.size > 0, self.std, 0.0) * np.abs(self.mean))

    def biased(self, spread: Spread, grasps: Pose, reference: int, biases: Array) -> Spread:
        """Return the spread of the grasps (N,) in R with what biases of sensors move them by.

        biases  (R, N, 6) moment and force [N m, N] of every recording's bias as felt at each grasp, in any axes of it

        Without a load a sensor reads its bias: one that was tared under load says that a grasp yields from there.
        """
        sizes = np.linalg.norm(biases.reshape(*biases.shape[:2], 2, 3), axis=-1).max(0, initial=0.0)
        return _moved(spread, grasps, reference, self.size * np.repeat(sizes / np.sqrt(3), 3, axis=1))

    def findings(self, log: TeamLog) -> Iterator[Finding]:
        """Yield grasp-yields for every robot whose grasp does."""
        for i, name in enumerate(log.names):
            turn, place = np.linalg.norm((self.size[i] * self.mean[i]).reshape(2, 3), axis=1)
            said = [
                (f"{_rounded(1 / each.mean())} {unit}", f"{off:.2g} {small}")
                for each, unit, off, small in (
                    (self.size[i, 3:], "N/m", 1e3 * place, "mm"),
                    (self.size[i, :3], "N m/rad", np.rad2deg(turn), "deg"),
                )
                if each.any()
            ]
            if said:
                stiff, off = (" and ".join(words) for words in zip(*said, strict=True))
                yield Finding.of(
                    "grasp-yields",
                    f"The grasp of '{name}', or the arm behind it, yields to what it pushes, by about {stiff}; it is "
                    f"told as it is without a load, {off} from where it is under the mean one.",
                )


def stiffened(log: TeamLog, team: PoseTeam, of: Callable[[TeamLog], PoseTeam]) -> tuple[TeamLog, PoseTeam, Yields]:
    """Return log and fit with what yields put right, and how far it does."""
    count = len(log.names)
    nothing = known = Yields(np.zeros((count, 6)), np.full((count, 6), np.inf), _mean_wrench(log))
    stiff, fit = log, team
    for _ in range(ROUNDS):
        found = _yields(fit, known)
        if (np.abs(found.size - known.size) <= SETTLED * found.std).all():
            break
        corrected = found.corrected(log)
        try:
            known, stiff, fit = found, corrected, of(corrected)
        except FAILURES:
            break
    # A payload that is not rigid, or poses that are misread, may go with what robots push, too.
    if team.rough and float(np.log(team.fit.noise / fit.fit.noise).mean()) < np.log(BETTER):
        return log, team, nothing
    return stiff, fit, known


def _moved(spread: Spread, grasps: Pose, reference: int, off: Array) -> Spread:
    """Return the spread of the grasps (N,) with each moved by so much (N, 6) more, in its own axes."""
    if not off.any():
        return spread
    # What moves the reference, in whose frame all are told, moves all others the other way.
    moves = np.eye(off.size)
    moves[:, 6 * reference : 6 * reference + 6] -= adjoint_inverse(grasps).reshape(-1, 6)
    moved = moves * off.ravel()
    return replace(spread, full=spread.full + moved @ moved.T)


def _mean_wrench(log: TeamLog) -> Array:
    """Return the mean wrench (N, 6) that every robot measured."""
    out = np.zeros((len(log.names), 6))
    for i, name in enumerate(log.names):
        tracks = [track for _, track in log.tracks_of(name) if track.has("force")]
        total = sum((track.wrench().T @ track.valid["force"] for track in tracks), np.zeros(6))
        out[i] = total / max(sum(int(track.valid["force"].sum()) for track in tracks), 1)
    return out


@dataclass(frozen=True, eq=False)
class _Pushed:
    """Rows in which all robots have poses and forces: residuals and wrenches (T, N, 6), poses (T, N)."""

    team: PoseTeam
    rows: Integers
    wrench: Array

    @classmethod
    def of(cls, team: PoseTeam) -> _Pushed | None:
        """Return such rows; None where there are too few."""
        felt, seen = (np.concatenate([getattr(part, name) for part in team.parts]) for name in ("felt", "seen"))
        rows = np.flatnonzero((felt & seen).all(1))
        rows = rows[:: max(1, len(rows) // ROWS)]
        wrench = np.concatenate([part.wrench for part in team.parts])[rows]
        return cls(team, rows, wrench) if len(rows) >= LEAST else None

    def explained(self, columns: Array, robot: Integers) -> tuple[Array, Array]:
        """Return how far residuals go with columns (T, C, 6) of robots (C,), and standard deviations (C,)."""
        fit = self.team.fit
        scores = Scores.of(fit.rows.residual[self.rows], columns, robot, self.team.J, self.team.W, STRETCHES)
        size, covariances = scores.solved()
        std = np.sqrt(np.maximum(*(np.diag(V) for V in covariances)))
        return size, np.where(std > 0, std, np.inf)

    def suspect(self) -> bool:
        """Return whether a grasp seems to yield, all axes alike, beside grasps and homes as they are."""
        wrench = self.wrench - self.wrench.mean(0)
        robot, kind = np.nonzero(np.ptp(wrench, axis=0).reshape(-1, 2, 3).any(-1))
        if not len(robot):
            return False
        columns = wrench[:, robot] * (np.arange(6) // 3 == kind[:, None])
        size, std = self.explained(columns, robot)
        return bool((size > SUSPECT * std).any())


def _yields(team: PoseTeam, known: Yields) -> Yields:
    """Return how far grasps yield where `known` was put right already."""
    pushed = _Pushed.of(team)
    if pushed is None or not (known.size.any() or pushed.suspect()):
        return known
    robot, axis = np.nonzero(np.ptp(pushed.wrench, axis=0) > 0)
    columns = pushed.wrench[:, robot, axis, None] * np.eye(6)[axis]
    beside, whose = _grasps_and_homes(team, pushed.rows)
    size, std = pushed.explained(np.concatenate([columns, beside], axis=1), np.concatenate([robot, whose]))
    more, doubt = np.zeros_like(known.size), np.full_like(known.std, np.inf)
    more[robot, axis], doubt[robot, axis] = size[: len(robot)], std[: len(robot)]
    return Yields(*_positive(known.size + more, doubt), known.mean)


def _grasps_and_homes(team: PoseTeam, rows: Integers) -> tuple[Array, Integers]:
    """Return how residuals move with grasps and homes (T, C, 6) of all but the reference, and whose they are (C,)."""
    poses, others = team.fit.rows.data.poses[rows], [i for i in range(len(team.fit.noise)) if i != team.fit.reference]
    ones = np.broadcast_to(np.eye(6), (len(rows), 6, 6))
    columns = [np.concatenate([ones, adjoint_inverse(poses[:, i]).swapaxes(1, 2)], axis=1) for i in others]
    return np.concatenate(columns, axis=1), np.repeat(others, 12)


def _positive(size: Array, std: Array) -> tuple[Array, Array]:
    """Return what yields beyond doubt (N, 6), and its standard deviations.

    Forces push grippers forward, never back, along all axes about alike.
    """
    out, weight, doubt = np.zeros_like(size), std**-2.0, std.copy()
    for i in range(len(size)):
        for axes in (slice(0, 3), slice(3, 6)):
            w, told = weight[i, axes], size[i, axes]
            if not w.any():
                continue
            alike = float(w @ told / w.sum())
            if alike * np.sqrt(w.sum()) > BEYOND:
                prior = (ALIKE * alike) ** -2.0
                out[i, axes] = np.maximum((w * told + prior * alike) / (w + prior), 0.0) * (w > 0)
                doubt[i, axes] = (w + prior) ** -0.5
    return out, doubt


def _stiff(track: Track, by: tuple[Array, Array, bool]) -> Track:
    """Return the track with poses of the grasp as it is without a load, and wrenches there.

    by  how far it yields (6,), the mean wrench (6,), and whether poses without a wrench are to be left out
    """
    size, mean, enough = by
    felt = track.mask("force")
    off = size * (np.where(felt[:, None], track.wrench(), mean) if felt.any() else mean[None].repeat(len(track), 0))
    turn, channels, valid = Rotation.exp(off[:, :3]), dict(track.channels), dict(track.valid)
    for name in {"rotation", "position"} & valid.keys() if enough else ():
        valid[name] = valid[name] & felt
    if "rotation" in channels:
        channels["rotation"] = channels["rotation"] @ turn.inverse().matrix
        if "position" in channels:
            channels["position"] = channels["position"] - np.einsum("tij,tj->ti", channels["rotation"], off[:, 3:])
    if felt.any():
        channels["force"] = turn.apply(channels["force"])
    if "torque" in channels:
        channels["torque"] = turn.apply(channels["torque"]) + cross(off[:, 3:], channels["force"])
    return replace(track, channels=channels, valid=valid)


def _rounded(value: float) -> str:
    return f"{float(f'{value:.2g}'):,.0f}".replace(",", " ")
