"""One robot whose forces are in another unit, or whose axes have another order or other signs than they should.

Read rightly, what robots push against one another cancels, and what is left carries one body. Of one robot at a time
every reading is tried on sums of products that are there already: a factor times a signed permutation X of its axes
changes the sum of forces by R (X - 1) f. What a mass and a first moment that move as the grasps do leave of the sum
must fall with biases left out of it, and with forces taken to be free of bias: either alone misses what the other sees.
Where gains are wrong besides, or two robots leave a tie, a sign is told by what adds up and would cancel if turned.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding, percent, quoted
from steelyard.inertia.regressor import basis
from steelyard.team.misread.readings import AXES, FACTORS, READINGS, SIGN, WrenchReading, torques_beside
from steelyard.team.misread.signs import sign_finding
from steelyard.team.payload.gain_sight import of_force
from steelyard.team.payload.model import Group, centred, left_of_pushes, pseudoinverse, scatter

# Both variances that are left must together, on average, fall by this factor each; what any motion leaves of the sum
# must where signs alone are asked for.
FALLS = 4.0
# What is left, biases and all, must be below this share of the variance of all forces: gains of 10 % leave less.
MISSES = 0.01
# A reading is clear where the next best leaves so many times as much of both together.
CLEAR = 2.0
# What is no motion's must not rise by more than this factor: else motion or gravity are wrong, not forces.
RISES = 2.0
# A robot is named without a reading where more than this share is left as given.
UNFIT = 0.02
# Lengths that a turn leaves as they are, to within this factor.
LIKE_A_TURN = 1.25
# A map is a factor where no entry is off by more than this share of it.
LIKE_A_FACTOR = 0.15
# Share of the variance of forces that is rounding.
ROUNDING = 1e-18
# What each reading changes (R, 9).
CHANGES = (READINGS - np.eye(3)).reshape(len(READINGS), 9)


@dataclass(frozen=True, eq=False)
class _Left:
    """What one body leaves of the sum of forces, and how that changes with each robot's reading in its own axes.

    variance  as given     slope  (N, 9)     curvature  (N, 9, 9)     size  (N,) of what each robot pushes
    """

    variance: float
    slope: Array
    curvature: Array
    size: Array

    @property
    def misfit(self) -> float:
        """Share of all forces that is left as given."""
        return self.variance / max(float(self.size.sum()), 1e-300)

    def any_map(self) -> tuple[Array, Array]:
        """Return the least (N,) that any linear map of each robot's force leaves, and that map (N, 3, 3)."""
        change = -np.stack([pseudoinverse(Q) @ g for Q, g in zip(self.curvature, self.slope, strict=True)])
        return self.variance + (self.slope * change).sum(1), np.eye(3) + change.reshape(-1, 3, 3)

    def shares(self) -> tuple[Array, Array]:
        """Return what each reading (N, R) leaves against what is left as given, and its share of all forces likewise.

        The share is the same where all forces are made larger alike.
        """
        left = self.variance + 2 * self.slope @ CHANGES.T
        left += ((CHANGES @ self.curvature) * CHANGES).sum(-1)
        all_forces = self.size.sum() + (FACTORS**2 - 1) * self.size[:, None]
        least = ROUNDING * float(self.size.sum())
        ratio = np.maximum(left, least) / max(self.variance, least)
        return ratio, ratio * self.size.sum() / np.maximum(all_forces, least)

    def left_out(self) -> Array:
        """Return what is left (N,) without each robot's force, against what is left as given."""
        none = -np.eye(3).ravel()
        left = self.variance + 2 * self.slope @ none + self.curvature @ none @ none
        return np.asarray(left / max(self.variance, ROUNDING * float(self.size.sum())))


def with_one_reading(
    groups: Sequence[Group], D: Array, names: Sequence[str]
) -> tuple[tuple[Group, ...], tuple[Finding, ...], tuple[int, Array] | None]:
    """Return the groups with one robot's wrench read as it fits the others', why, and whose wrench was mapped by what
    (6, 6), None where all were left.

    D  (6, 6 N) sums the pushes at B
    """
    groups = tuple(groups)
    S = scatter(groups)
    given = _left(S, D)
    # Nothing fits better, and not much is left: so it is with most logs.
    if not np.maximum(*given.shares()).min() < 1.0 and given.misfit < UNFIT:
        return groups, (), None
    both = (given, _left(_without_bias(groups), D))
    shares = [one.shares() for one in both]
    score = shares[0][1] * shares[1][1]
    fallen = np.prod([np.maximum(*one) for one in shares], axis=0)
    near = np.flatnonzero(score < CLEAR * score.min())
    equal = [divmod(int(k), len(READINGS)) for k in near[np.argsort(score.flat[near])]]
    robot, number = equal[0]
    fits = min(fallen[one] for one in equal) < FALLS**-2 and given.misfit * shares[0][1][robot, number] < MISSES
    left = np.prod([share[0][robot, number] for share in shares])
    without = np.prod([one.left_out()[robot] for one in both])
    # A sensor that is merely loud is best left out, and every reading that makes it small seems right.
    fits &= CLEAR * left < without
    kinds = [scatter([group]) for group in groups]
    fits &= _beside_others(kinds, D, robot, READINGS[number]) < RISES
    if not fits or len(equal) > 1:
        signs = not fits or any(k == SIGN for _, k in equal)
        turned = _of_other_sign(groups, D, given) if signs else None
        if turned is None:
            return groups, (_undecided(equal, names),) if fits else _odd_one(groups, D, names, both), None
        robot, number = turned, SIGN
    reading = _with_torque(S, D, robot, number)
    read = reread(groups, robot, reading.wrench())
    return read, (_finding(names[robot], reading, score[robot, number]),), (robot, reading.wrench())


def reread(groups: Sequence[Group], robot: int, wrench: Array) -> tuple[Group, ...]:
    """Return the groups with one robot's wrench mapped by (6, 6)."""
    return tuple(_reread(group, robot, wrench) for group in groups)


def _of_other_sign(groups: Sequence[Group], D: Array, given: _Left) -> int | None:
    """Return the robot whose sign must be turned for forces to cancel beside one another, whatever else is wrong."""
    each = [part.scatter.sum(0) for group in groups for part in group.parts]
    asks = np.flatnonzero(given.shares()[0][:, SIGN] < 1.0)
    asking = [int(i) for i in asks if _beside_others(each, D, int(i), READINGS[SIGN]) < 1 / FALLS]
    # Of two robots each asks for it: it is the one that pulls down.
    lifted = np.einsum("aix,ixa->i", D[3:].reshape(3, -1, 6), scatter(groups)[12:-1, 3:6].reshape(-1, 6, 3))
    return min(asking, key=lambda robot: float(lifted[robot]), default=None)


def _odd_one(groups: Sequence[Group], D: Array, names: Sequence[str], both: Sequence[_Left]) -> tuple[Finding, ...]:
    """Return the finding of a robot whose forces fit turned by some angle, though with no reading."""
    if both[0].misfit < UNFIT:
        return ()
    found = _mapped(both)
    if found is None or _beside_others([scatter([group]) for group in groups], D, *found) > RISES:
        return ()
    robot, X = found
    # A map that is no turn may stand for a large bias, or for gravity that is wrong.
    u, sizes, v = np.linalg.svd(X)
    if not (np.linalg.det(X) > 0 and sizes[-1] > 1 / LIKE_A_TURN and sizes[0] < LIKE_A_TURN):
        return ()
    angle = np.degrees(np.arccos(np.clip((np.trace(u @ v) - 1) / 2, -1, 1)))
    text = (
        f"What '{names[robot]}' pushes fits neither the others nor one body, in no unit and no order of its axes, but "
        f"would turned by about {angle:.0f} deg. Nothing was changed, and the answer is not to be trusted."
    )
    remedy = f"Check mount and frame of the wrench of '{names[robot]}', and units, order and signs of its columns."
    return (Finding("wrench-unexplained", text, remedy),)


def likely_factor(groups: Sequence[Group], D: Array) -> tuple[int, float] | None:
    """Return the one robot whose forces fit times a factor, and that factor; None where none does clearly."""
    found = _mapped((_left(scatter(groups), D), _left(_without_bias(groups), D)))
    if found is None:
        return None
    robot, X = found
    factor = float(np.trace(X)) / 3
    return (robot, factor) if np.abs(X - factor * np.eye(3)).max() < LIKE_A_FACTOR * abs(factor) else None


def _mapped(both: Sequence[_Left]) -> tuple[int, Array] | None:
    """Return the robot whose forces fit by some linear map (3, 3), and that map; None where none does clearly."""
    any_map = [one.any_map() for one in both]
    fallen = np.prod([left / max(one.variance, 1e-300) for one, (left, _) in zip(both, any_map, strict=True)], axis=0)
    robot, *others = (int(i) for i in np.argsort(fallen))
    fits = fallen[robot] < FALLS**-2 and any_map[0][0][robot] < MISSES * float(both[0].size.sum())
    clear = fits and fallen[others[0]] > CLEAR * fallen[robot]
    return (robot, any_map[0][1][robot]) if clear else None


def _without_bias(groups: Sequence[Group]) -> Array:
    """Return the scatter with a constant left out of every motion, and one of all that is at rest."""
    out = []
    for group in groups:
        each = [part.scatter.sum(0) for part in group.parts]
        out += [centred(S) for S in ([np.sum(each, axis=0)] if group.parts[0].still else each)]
    return np.asarray(np.sum(out, axis=0))


def _left(S: Array, D: Array) -> _Left:
    """Return what mass and first moment leave of the sum of forces."""
    own, E = 12 + np.flatnonzero(of_force(len(S) - 13)), basis()[:4, 3:].reshape(12, 12)
    total, count = D[3:, own - 12], len(own) // 3
    both, seen = S[own[:, None], own], (E @ S[:12, own]).reshape(4, -1)
    inverse = pseudoinverse((E @ S[:12, :12]).reshape(4, 36) @ E.reshape(4, 36).T)
    pushed, along = total @ both, seen @ total.ravel()
    fitted = inverse @ along
    slope = pushed - (fitted @ seen).reshape(3, -1)
    variance = float((pushed * total).sum() - fitted @ along)
    # In each robot's own axes.
    back = np.moveaxis(total.reshape(3, count, 3), 0, 2)
    mine = (back[:, None] @ np.moveaxis(seen.reshape(4, 3, count, 3), 2, 0)).reshape(count, 4, 9)
    pairs = both.reshape(count, 3, count, 3)
    blocks = pairs[range(count), :, range(count)]
    curvature = np.zeros((count, 3, 3, 3, 3))
    for axis in range(3):
        curvature[:, axis, :, axis] = blocks
    nine = curvature.reshape(count, 9, 9) - np.swapaxes(mine, 1, 2) @ inverse @ mine
    sloped = back @ np.moveaxis(slope.reshape(3, count, 3), 1, 0)
    return _Left(variance, sloped.reshape(count, 9), nine, np.trace(blocks, axis1=1, axis2=2))


def _turned(S: Array, robot: int, wrench: Array) -> Array:
    """Return scatters (..., Z, Z) with one robot's wrench mapped by (6, 6), or its force by (3, 3)."""
    X, own = np.eye(S.shape[-1]), slice(18 + 6 * robot - len(wrench), 18 + 6 * robot)
    X[own, own] = wrench
    return np.asarray(X @ S @ X.T)


def _reread(group: Group, robot: int, wrench: Array) -> Group:
    own = slice(18 + 6 * robot - len(wrench), 18 + 6 * robot)
    parts = []
    for part in group.parts:
        room = part.room.copy()
        room[..., own] = room[..., own] @ wrench.T
        read, judged = (_turned(S, robot, wrench) for S in (part.scatter, part.judged))
        parts.append(replace(part, scatter=read, room=room, judged=judged))
    return replace(group, parts=tuple(parts))


def _beside_others(each: Sequence[Array], D: Array, robot: int, X: Array) -> float:
    """Return what any motion whatever leaves of the sum of forces with one's mapped by X (3, 3), over that as given.

    each  scatters with a motion and a bias of their own
    """
    given, read = (
        sum(left_of_pushes(D[3:], np.eye(12), S) for S in some) for some in (each, [_turned(S, robot, X) for S in each])
    )
    return read / max(given, 1e-300)


def _with_torque(S: Array, D: Array, robot: int, number: int) -> WrenchReading:
    """Return the reading with that of the torque by which moments balance, as it is given where none is clear."""
    given, *others = torques_beside(number)
    own = slice(12 + 6 * robot, 15 + 6 * robot)
    if not np.trace(S[own, own]) > 0:
        axes = AXES[number % len(AXES)]
        return WrenchReading(number, axes if np.linalg.det(axes) > 0 else given.torque)
    if number == SIGN:
        return WrenchReading(number, -given.torque)
    E = basis()[1:, :3]
    left = [left_of_pushes(D[:3], E, _turned(S, robot, one.wrench())) for one in (given, *others)]
    best = int(np.argmin(left))
    return (given, *others)[best] if CLEAR * left[best] < left[0] else given


def _finding(name: str, reading: WrenchReading, score: float) -> Finding:
    """Return the finding of forces that were put right."""
    if reading.number == SIGN:
        return sign_finding(name)
    text = (
        f"What '{name}' and the others push carries one body, and cancels besides, only with its forces taken as "
        f"{reading.words()}: that leaves {percent(float(np.sqrt(score)))} of the variance that is left as given. "
        "They were taken so."
    )
    return Finding("force-unit", text, reading.remedy(name))


def _undecided(equal: Sequence[tuple[int, int]], names: Sequence[str]) -> Finding:
    """Return the finding of forces that fit with more than one reading."""
    who = list(dict.fromkeys(robot for robot, _ in equal))
    robots = quoted((names[robot] for robot in who), " or ")
    ways = [f"those of '{names[robot]}' as {WrenchReading(number, np.eye(3)).words()}" for robot, number in equal[:3]]
    text = (
        f"What robots push does not fit one body as given, and would with the forces of {robots} read otherwise: "
        f"{'; or '.join(ways)}{' or in other ways' if len(equal) > 3 else ''}. Nothing was changed, and the answer is "
        "not to be trusted."
    )
    return Finding("force-unit", text, f"Check unit, order, signs and frame of the force columns of {robots}.")
