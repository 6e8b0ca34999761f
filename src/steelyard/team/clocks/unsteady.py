"""Clocks that are set anew between recordings, or run fast: told by what a fit with one offset per robot leaves.

What is left of a grasp's poses or twists, along how they move, is how late its stamps are beside the offset that all
recordings share: e_i = s_i (late_i + rate_i (t - middle)), with the payload's motion, which all robots see, taken out.
Standard deviations come from the scores of stretches of each recording, so that slow noise does not pass for a clock.
A jump too small to show in how fast robots turn is a step of how late a fit finds the stamps: beside an offset and a
rate of every clock, one that steps at some time explains what the fit leaves by so many standard deviations. These hold
for slow noise, since they are those of long stretches. Where it stepped, short ones tell.
Source: own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import FAILURES, Array, Integers
from steelyard.logs.runs import distinct_rows
from steelyard.logs.team_log import TeamLog
from steelyard.team.clocks.errors import NOTHING, ClockError, ClockErrors, Step
from steelyard.team.clocks.jumps import MOST, cut_at_step
from steelyard.team.clocks.shifts import LEAST_S as PART_S
from steelyard.team.motion_fit import F
from steelyard.team.scores import Scores
from steelyard.team.stacked import Stretch

# Stretches of a recording whose scores tell the standard deviations, and rows that a recording must have.
STRETCHES, ROWS = 20, 100
# Stretches by which the time of a step is told last so long [s].
STEP_S = 0.1
# A clock is unsteady from so many standard deviations, and where it is late by so much [s] or fast by so much [s/s].
# One that is called so is put right until less than SETTLED standard deviations are left, at most so many times.
BEYOND, LEAST_S, LEAST_RATE = 8.0, 1e-4, 1e-6
SETTLED, ROUNDS = 0.5, 6
# A clock steps by so much [s] at least, and beyond so many standard deviations; this share of what is known of it comes
# from either side: of rests, noise alone tells, and amiss.
STEP_LEAST_S, STEP_BEYOND, EITHER = 5e-4, 8.0, 0.08


def steadied(
    log: TeamLog, team: F, of: Callable[[TeamLog], F], errors: ClockErrors = NOTHING
) -> tuple[TeamLog, F, ClockErrors]:
    """Return log and fit with clocks put right in every recording, and what they were off by.

    errors  what stamps were put right by before, which is told, too
    """
    called = _Called()
    for _ in range(MOST):
        step = team.clocks_left.step
        if step is None:
            break
        try:
            cut, before = cut_at_step(log, errors, step, team.late)
            team = of(cut)
        except FAILURES:
            break
        log, errors = cut, before
    for _ in range(ROUNDS):
        called = called.joined(team.clocks_left)
        wrong = called.of(team.clocks_left)
        every = [error for each in wrong.recordings for error in each.values()]
        if all(abs(e.late) <= SETTLED * e.late_std and abs(e.rate) <= SETTLED * e.rate_std for e in every):
            break
        try:
            moved = wrong.corrected(log)
            team = of(moved)
        except FAILURES:
            break
        log, errors = moved, errors + wrong
    of_reference = errors.of_reference(log) if errors else NOTHING
    if of_reference:
        log, errors = of_reference.corrected(log), errors + of_reference
        team = of(log)
    return log, team, errors


@dataclass(frozen=True)
class _Called:
    """Robots whose clocks are set anew, and pairs of recording and robot where one runs fast or slow."""

    late: frozenset[str] = frozenset()
    fast: frozenset[tuple[int, str]] = frozenset()

    def joined(self, errors: ClockErrors) -> _Called:
        """Return these and those that errors call."""
        every = [(k, n, e) for k, each in enumerate(errors.recordings) for n, e in each.items()]
        fast = {(k, n) for k, n, e in every if abs(e.rate) > max(LEAST_RATE, BEYOND * e.rate_std)}
        late = {n for _, n, e in every if abs(e.late) > max(LEAST_S, BEYOND * e.late_std)} | {n for _, n in fast}
        return _Called(self.late | late, self.fast | fast)

    def of(self, errors: ClockErrors) -> ClockErrors:
        """Return the errors of those that were called."""
        return ClockErrors(tuple(
            {n: e if (k, n) in self.fast else replace(e, rate=0.0) for n, e in each.items() if n in self.late}
            for k, each in enumerate(errors.recordings)
        ))  # fmt: skip


def clock_errors(
    log: TeamLog, left: Iterable[tuple[Stretch, Array]], slopes: Iterable[Array], J: Array, W: Array
) -> ClockErrors:
    """Return what clocks seem to be off by, recording by recording, against the reference's.

    left    rows of every recording, and residuals (T, N, 6) of each grasp in its own axes
    slopes  (T, N, 6) residuals per second that the robot's stamps are late, of every recording
    J       (N, 6, 6) residuals per motion of the payload     W  (N, 6) their weights
    """
    reference = log.names.index(log.reference)
    told = [
        None if part.kind == "still" else _Told.of(part, apart, slope, J, W, reference)
        for (part, apart), slope in zip(left, slopes, strict=True)
    ]
    steps = [step for k, one in enumerate(told) if one is not None and (step := one.step(k, log.names)) is not None]
    return ClockErrors(tuple({} if one is None else one.errors(log.names) for one in told), steps[0] if steps else None)


@dataclass(frozen=True, eq=False)
class _Told:
    """What the rows of one recording that most often see the same robots tell of their clocks.

    robots  (n,) numbers of those     base  which of them clocks are told against
    time    (T,) [s] of those rows    apart, slope  (T, n, 6) as of `clock_errors`
    J, W    of those robots
    scores  of offsets, and of rates per half of the recording [s], of all robots in turn
    common  (2 n, 2 n) information on what all clocks have in common: it moves the motion along itself
    """

    robots: Integers
    base: int
    time: Array
    apart: Array
    slope: Array
    J: Array
    W: Array
    middle: float
    half: float
    scores: Scores
    common: Array

    @classmethod
    def of(cls, part: Stretch, apart: Array, slope: Array, J: Array, W: Array, reference: int) -> _Told | None:
        """Return what is told, None where rows or robots are too few."""
        found, which = distinct_rows(part.seen)
        most = int(np.argmax(np.bincount(which) * (found.sum(1) > 1)))
        robots, rows = np.flatnonzero(found[most]), np.flatnonzero(which == most)
        if len(robots) < 2 or len(rows) < ROWS:
            return None
        middle, half = 0.5 * float(part.time[0] + part.time[-1]), 0.5 * float(part.time[-1] - part.time[0])
        time, some = part.time[rows], len(robots)
        if len(rows) < len(apart) or some < len(J):
            apart, slope = apart[rows][:, robots], slope[rows][:, robots]
        powers = np.stack([np.ones(len(time)), (time - middle) / half], axis=1)
        scores = Scores.of(apart, slope, np.arange(some), J[robots], W[robots], STRETCHES, powers)
        common = np.kron(np.eye(2), np.ones((some, some))) * np.trace(scores.information.sum(0)) / (2 * some)
        if not common.any():
            return None
        base = int(np.argmax(robots == reference))
        return cls(robots, base, time, apart, slope, J[robots], W[robots], middle, half, scores, common)

    def errors(self, names: tuple[str, ...]) -> dict[str, ClockError]:
        """Return offsets and rates by robots' `names` (N,)."""
        some = len(self.robots)
        size, covariances = self.scores.solved(self.common)
        against = np.kron(np.diag([1.0, 1 / self.half]), np.eye(some) - np.eye(some)[self.base])
        late, rate = (against @ size).reshape(2, some)
        noise = [((against @ V) * against).sum(1) for V in covariances]
        # Of a fit that went nowhere variances are rounding, and may be below zero.
        late_std, rate_std = np.sqrt(np.maximum(np.maximum(*noise), 0.0)).reshape(2, some)
        return {
            names[i]: ClockError(float(late[k]), float(rate[k]), self.middle, float(late_std[k]), float(rate_std[k]))
            for k, i in enumerate(self.robots)
            if k != self.base
        }

    def step(self, recording: int, names: tuple[str, ...]) -> Step | None:
        """Return the step of a clock in this `recording` of robots `names` (N,), None where there surely is none."""
        some = len(self.robots)
        held = self.common[:some, :some]
        found = self._clearest(self.scores, STRETCHES, held)
        if not found.sure:
            return None
        count = int(min(len(self.time), max(STRETCHES, 2 * self.half / STEP_S)))
        fine = Scores.of(self.apart, self.slope, np.arange(some), self.J, self.W, count)
        best = self._clearest(fine, count, held)
        first = float(np.array_split(self.time, count)[best.first][0])
        if min(first - self.time[0], self.time[-1] - first) < PART_S:
            return None
        return Step(recording, names[self.robots[best.robot]], first, best.size)

    def _clearest(self, scores: Scores, stretches: int, held: Array) -> Best:
        at = np.array([rows.mean() for rows in np.array_split((self.time - self.middle) / self.half, stretches)])
        some = len(self.robots)
        return clearest(scores.pull[:, :some], scores.information[:, :some, :some], at, held)


@dataclass(frozen=True)
class Best:
    """The clearest step: of which robot, from which stretch on, its size [s], and its share of its own noise."""

    robot: int
    first: int
    size: float
    score: float

    @property
    def sure(self) -> bool:
        """Whether it is no noise."""
        return abs(self.size) > STEP_LEAST_S and self.score > STEP_BEYOND


def clearest(pull: Array, information: Array, at: Array, held: Array) -> Best:
    """Return the clearest step of one clock beside offsets and rates of all.

    pull         (B, n) scores of how late each of n robots is, by stretches in order
    information  (B, n, n) theirs
    at           (B,) the stretches' times, -1 to 1
    held         (n, n) information on what all have in common, which nothing shows
    """
    count = pull.shape[1]
    powers = np.stack([np.ones_like(at), at], axis=1)
    # Columns of offset and rate by robots: (B, n, 2 n).
    beside = (information[:, :, None] * powers[:, None, :, None]).reshape(len(at), count, -1)
    H = np.einsum("bp,bic->pic", powers, beside).reshape(2 * count, -1) + np.kron(np.eye(2), held)
    inverse = np.linalg.pinv(H, rcond=1e-12, hermitian=True)
    left = pull - beside @ (inverse @ (powers.T @ pull).ravel())
    # A step from every stretch on: (B, n, ...), the first being an offset.
    after = [np.cumsum(x[::-1], axis=0)[::-1][1:] for x in (left, beside, np.einsum("bii->bi", information))]
    known = after[2] - ((after[1] @ inverse) * after[1]).sum(-1)
    share = after[2] / np.maximum(np.einsum("bii->i", information), 1e-300)
    known = np.where((share > EITHER) & (share < 1 - EITHER) & (known > 1e-9 * after[2]), known, np.inf)
    k, i = np.unravel_index(int(np.argmax(after[0] ** 2 / known)), known.shape)
    size = float(after[0][k, i] / known[k, i])
    own = information[:, :, i] * (np.arange(len(at)) > k)[:, None] - beside @ (inverse @ after[1][k, i])
    left = left - size * own
    noise = np.einsum("bi,bi->i", left, left)[i] / max(float(np.einsum("bii->bi", information)[:, i].sum()), 1e-300)
    score = abs(size) * float(np.sqrt(known[k, i] / max(noise, 1.0))) if np.isfinite(known[k, i]) else 0.0
    return Best(int(i), int(k) + 1, size, score)
