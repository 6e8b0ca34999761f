"""What a team with standing bases measures, where everything is, and where the joint fit starts.

First grasps and homes come pair by pair in closed form. With the poses of the reference r and of robot i relative to
the row m, A(t) = T_r(m)^-1 T_r(t) and B(t) likewise, A G = G B: rotation vectors turn as alpha = R beta (Wahba), and
(R_A - 1) p = R b - a is linear in p. Where all rotation is about one axis, or there is none, positions decide the rest
of R, and gravity, where bases are level: R turns its direction in one grasp into that in the other.
Source: AX = XB as in hand-eye calibration; the paper's eq. 3-8 are the same with twists.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from steelyard.check import Array, Integers, Mask
from steelyard.errors import CannotAnswer
from steelyard.logs.middles import mean
from steelyard.logs.runs import distinct_rows
from steelyard.spatial import Pose, Rotation
from steelyard.team.adjoint import extent, moved, turns_between
from steelyard.team.poses.rows import first_seen
from steelyard.team.poses.solver import scatter
from steelyard.team.stacked import Stretch

# Turns about the one axis of rotation that are tried where it is the only one.
TURNS = 24
# Rotation about a second axis is at least this share of that about the first, or it counts as none.
ONE_AXIS = 0.1
# That is no more than noise where two robots' turns, laid upon each other, differ by such a share of it.
NOISE_SHARE = 2.0
# Fewer common rows than this start nothing.
FEWEST = 8
# [rad] Rotations below this are noise and place nothing.
ROTATION_NOISE = 1e-3
# Evenly spread rows that are enough.
ENOUGH = 300
ALL = slice(None)


@dataclass(frozen=True, eq=False)
class TeamMotion:
    """Measured poses of N grasps, each in the home of its robot, at T common times.

    poses  X_HG (T, N); where not `valid` they hold anything finite
    valid  (T, N) whether the robot has a pose at that time
    twist  (T, N, 6) of each grasp in its own axes per second that its stamps are late; none where not asked for
    share  (T,) how much each row counts; None where all count as one
    """

    poses: Pose
    valid: Mask
    twist: Array = field(default_factory=lambda: np.zeros((0, 0, 6)))
    share: Array | None = None

    def __post_init__(self) -> None:
        # One layout, one compiled form of what passes over the rows.
        object.__setattr__(self, "valid", np.ascontiguousarray(self.valid))
        object.__setattr__(self, "twist", np.ascontiguousarray(self.twist))

    @classmethod
    def of(cls, parts: Sequence[Stretch]) -> TeamMotion:
        """Return the poses of all recordings one after the other.

        Rows that one robot alone saw say nothing of grasps and are kept: the motion is still theirs. Raises
        CannotAnswer where nobody's poses were measured.
        """
        seen = np.concatenate([p.seen for p in parts])
        if not seen.any():
            raise CannotAnswer(
                "the joint fit from poses needs the pose of every grasp in its robot's home; there is none."
            )
        if len(parts) == 1:
            return cls(parts[0].poses, seen)
        place = np.concatenate([p.poses.position for p in parts])
        return cls(Pose(Rotation.joined([p.poses.rotation for p in parts]), place), seen)

    def rows(self, chosen: Any) -> TeamMotion:
        """Return some of the rows."""
        twist = self.twist[chosen] if len(self.twist) else self.twist
        share = None if self.share is None else self.share[chosen]
        return TeamMotion(self.poses[chosen], self.valid[chosen], twist, share)

    @property
    def shares(self) -> Array:
        """How much each row (T,) counts."""
        return np.ones(len(self.valid)) if self.share is None else self.share

    @property
    def count(self) -> int:
        """Number of robots."""
        return int(self.valid.shape[1])

    @cached_property
    def complete(self) -> Mask:
        """Rows (T,) in which all robots have poses."""
        return np.asarray(self.valid.all(1))

    @cached_property
    def patterns(self) -> tuple[Mask, Integers]:
        """Return the different sets of robots that have poses (C, N), and which of them each row (T,) has."""
        return distinct_rows(self.valid)

    def motion_seen(self, grasps: Pose, homes: Pose) -> Pose:
        """Return the payload (T,) in the reference home as the first robot with a pose at that time sees it."""
        G, Z = grasps, homes
        turns, places = first_seen(
            self.poses.rotation.matrix, self.poses.position, self.valid, G.rotation.matrix, G.position,
            Z.rotation.matrix, Z.position,
        )  # fmt: skip
        return Pose.trusted(Rotation.trusted(turns), places)

    @cached_property
    def scatter(self) -> list[Array]:
        """Scatter (25 N, 25 N) of the features of every row per pattern; see `poses.solver`."""
        found, place = self.patterns
        every = [self] if len(found) == 1 else [self.rows(place == k) for k in range(len(found))]
        return [scatter(r.poses.rotation.matrix, r.poses.position, r.twist, r.valid, r.share) for r in every]


def in_words(noise: Array) -> str:
    """Return the rms over robots of the noise (N, 2) [rad, m] of their turns and places, in deg and mm."""
    turn, place = np.sqrt((noise**2).mean(0))
    return f"{np.rad2deg(turn):.2g} deg and {1e3 * place:.2g} mm"


@dataclass(frozen=True, eq=False)
class Team:
    """Where everything is.

    grasps   G (N,) in the reference grasp; the reference's own is the identity
    homes    Z (N,) in the reference home; the reference's own is the identity
    motion   X (T,) the reference grasp in the reference home
    delays   (N,) [s] how late each clock stamps
    """

    grasps: Pose
    homes: Pose
    motion: Pose
    delays: Array

    @cached_property
    def extent(self) -> Array:
        """How far the payload turned and moved (2,), rms [rad, m]."""
        return extent(self.motion)

    @cached_property
    def mean_turn(self) -> Array:
        """Mean of the payload's rotation matrices (3, 3)."""
        return mean(self.motion.rotation.matrix)

    def moved(self, steps: Array) -> Team:
        """Return the team with grasps, homes and delays a small step (N, 13) on, the motion where it is."""
        grasps, homes = moved(self.grasps, steps[:, :6]), moved(self.homes, steps[:, 6:12])
        return Team(grasps, homes, self.motion, self.delays + steps[:, 12])


def first_team(
    data: TeamMotion, reference: int, names: tuple[str, ...], gravity: Array | None = None, rows: slice = ALL
) -> Team:
    """Return grasps and homes from pairs with the reference; raises CannotAnswer where two have no rows in common.

    gravity  (N, 3) its direction in every home, zero where that is not known; None = in none
    rows     for which the motion is told
    """
    count = data.valid.shape[1]
    turns, places = np.tile(np.eye(3), (2, count, 1, 1)), np.zeros((2, count, 3))
    for both, robots in _rows_in_common(data, reference):
        if len(both) < FEWEST:
            raise CannotAnswer(
                f"robots '{names[reference]}' and '{names[robots[0]]}' have {len(both)} rows in common; at least "
                f"{FEWEST} are needed to find where one holds the payload from the other. Record them together."
            )
        both = both[:: max(1, len(both) // ENOUGH)]
        T_r, T = data.poses[both, reference], data.poses[both[:, None], robots]
        level = _level(T_r, T, gravity[reference], gravity[robots]) if gravity is not None else None
        G = _grasps(T_r, T, level)
        middle = len(both) // 2
        Z = T_r[middle] @ G @ T[middle].inverse()
        turns[:, robots] = G.rotation.matrix, Z.rotation.matrix
        places[:, robots] = G.position, Z.position
    G, Z = (Pose(Rotation(turn), place) for turn, place in zip(turns, places, strict=True))
    return Team(G, Z, data.rows(rows).motion_seen(G, Z), np.zeros(count))


def _rows_in_common(data: TeamMotion, reference: int) -> list[tuple[Integers, list[int]]]:
    """Return rows that the reference has in common with other robots, and which robots these are."""
    groups: dict[bytes, tuple[Integers, list[int]]] = {}
    for i in range(data.count):
        if i != reference:
            both = data.valid[:, reference] & data.valid[:, i]
            groups.setdefault(both.tobytes(), (np.flatnonzero(both), []))[1].append(i)
    return list(groups.values())


class _Level(NamedTuple):
    """Direction of gravity in the grasps of r (M, 3) and of others (M, K, 3), zero where the base does not tell it."""

    own: Array
    others: Array


def _unlike(own: Array, others: Array, R: Rotation) -> Array:
    """Return the squares (K,) by which vectors (M, K, 3), turned by R (K,), are unlike those of r (M, 3)."""
    return np.asarray(((own[:, None] - R.apply(others)) ** 2).sum((0, 2)))


def _level(T_r: Pose, T: Pose, own: Array, others: Array) -> _Level | None:
    """Return the direction of gravity in the grasps, from that in the homes (3,) and (K, 3); None where unknown."""
    if not own.any() or not others.any():
        return None
    return _Level(T_r.rotation.inverse().apply(own), T.rotation.inverse().apply(others))


def _grasps(T_r: Pose, T: Pose, level: _Level | None) -> Pose:
    """Return the grasps (K,) in that of r that explain their motions best, among a few; poses T_r (M,), T (M, K)."""
    middle, rows = len(T_r.position) // 2, len(T_r.position)
    A, B = T_r[middle].inverse() @ T_r, T[middle].inverse() @ T
    alpha, beta = (turns_between(Rotation.identity(), X.rotation) for X in (A, B))
    a, b = A.position - A.position.mean(0), B.position - B.position.mean(0)
    turning, moving = (x.T @ y.swapaxes(0, 1) for x, y in ((alpha, beta), (a, b)))
    first = Rotation.aligning(turning)
    seen, axes = np.linalg.eigh(alpha.T @ alpha)
    unlike = _unlike(alpha, beta, first)
    two = seen[1] > ONE_AXIS**2 * seen[2] and seen[1] > rows * (10 * ROTATION_NOISE) ** 2
    if two and (level is None or seen[1] > NOISE_SHARE * unlike.max() / 3):
        return Pose(first, _positions(A, B, first)[0])
    candidates, about = [first, Rotation.aligning(moving)], [axes[:, 2]]
    if level is not None:
        # Directions and turns err alike; places are brought to the size of turns.
        leveling = turning + np.einsum("ma,mkb->kab", *level)
        upright = Rotation.aligning(leveling)
        scale = seen.sum() / max(float((a**2).sum()), 1e-300)
        candidates += [upright, Rotation.aligning(leveling + scale * moving)]
        about.append(level.own.mean(0))
    else:
        upright = first
    angles = np.arange(TURNS) * (2 * np.pi / TURNS)
    candidates += [Rotation.exp(angle * axis) @ upright for axis in about for angle in angles]
    found = [_positions(A, B, R) for R in candidates]
    spread = float(np.linalg.norm(alpha, axis=1).mean()) + 1e-12
    size = float(np.linalg.norm(a, axis=1).mean()) + 1e-12
    cost = [
        left / size**2 + (_unlike(alpha, beta, R) + (0.0 if level is None else _unlike(*level, R))) / spread**2
        for R, (_, left) in zip(candidates, found, strict=True)
    ]
    best, each = np.argmin(cost, axis=0), np.arange(len(first.matrix))
    turns = np.stack([R.matrix for R in candidates])[best, each]
    return Pose(Rotation(turns), np.stack([place for place, _ in found])[best, each])


def _positions(A: Pose, B: Pose, R: Rotation) -> tuple[Array, Array]:
    """Return positions (K, 3) by least squares, near zero where no rotation shows them, and the squares left (K,)."""
    left = A.rotation.matrix - np.eye(3)
    right = R.apply(B.position) - A.position[:, None]
    # An offset of the row m itself is noise: means are taken away.
    left, right = left - left.mean(0), right - right.mean(0)
    ridge = len(left) * ROTATION_NOISE**2
    along = np.tensordot(left, right, ((0, 1), (0, 2)))
    held = np.tensordot(left, left, ((0, 1), (0, 1))) + ridge * np.eye(3)
    p = np.asarray(np.linalg.solve(held, along).T)
    off = (left @ p.T).swapaxes(1, 2) - right
    return p, (off**2).sum((0, 2)) + ridge * (p**2).sum(1)
