"""Clocks that are set anew between recordings, or run fast: told by what a fit with one offset per robot leaves.

What is left of a grasp's poses or twists, along how they move, is how late its stamps are beside the offset that all
recordings share: e_i = s_i (late_i + rate_i (t - middle)), with the payload's motion, which all robots see, taken out.
Standard deviations come from the scores of stretches of each recording, so that slow noise does not pass for a clock.
Source: own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import FAILURES, Array
from steelyard.logs.log import Integers, Mask
from steelyard.logs.runs import distinct_rows
from steelyard.logs.team_log import TeamLog
from steelyard.team.clocks.errors import NOTHING, ClockError, ClockErrors
from steelyard.team.clocks.jumps import LEAST_S as PART_S
from steelyard.team.clocks.jumps import MOST, cut_at_step
from steelyard.team.clocks.steps import Best, Step, clearest
from steelyard.team.motion_fit import F
from steelyard.team.scores import Scores

# Stretches of a recording whose scores tell the standard deviations, and rows that a recording must have.
STRETCHES, ROWS = 20, 100
# Stretches by which the time of a step is told last so long [s].
STEP_S = 0.1
# A clock is unsteady from so many standard deviations, and where it is late by so much [s] or fast by so much [s/s].
# One that is called so is put right until less than SETTLED standard deviations are left, at most so many times.
BEYOND, LEAST_S, LEAST_RATE = 8.0, 1e-4, 1e-6
SETTLED, ROUNDS = 0.5, 6


@dataclass(frozen=True, eq=False)
class Left:
    """What a fit leaves of one recording.

    time   (T,) [s]                  seen  (T, N)
    apart  (T, N, 6) residuals of each grasp in its own axes
    slope  (T, N, 6) residuals per second that the robot's stamps are late
    """

    time: Array
    seen: Mask
    apart: Array
    slope: Array


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
        if not any(_unsettled(error) for each in wrong.recordings for error in each.values()):
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


def _unsettled(error: ClockError) -> bool:
    return abs(error.late) > SETTLED * error.late_std or abs(error.rate) > SETTLED * error.rate_std


def clock_errors(log: TeamLog, parts: tuple[Left, ...], J: Array, W: Array) -> ClockErrors:
    """Return what clocks seem to be off by, recording by recording, against the reference's.

    J  (N, 6, 6) residuals per motion of the payload      W  (N, 6) their weights
    """
    told: list[_Told | None] = [
        None if recording.kind == "still" else _Told.of(part, J, W, log.names.index(log.reference))
        for recording, part in zip(log.recordings, parts, strict=True)
    ]
    steps = [step for k, one in enumerate(told) if one is not None and (step := one.step(k, log.names)) is not None]
    return ClockErrors(tuple({} if one is None else one.errors(log.names) for one in told), steps[0] if steps else None)


@dataclass(frozen=True, eq=False)
class _Told:
    """What the rows of one recording that most often see the same robots tell of their clocks.

    robots  (n,) numbers of those     base  which of them clocks are told against
    time    (T,) [s] of those rows    apart, slope  (T, n, 6) as in `Left`
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
    def of(cls, part: Left, J: Array, W: Array, reference: int) -> _Told | None:
        """Return what is told, None where rows or robots are too few."""
        found, which = distinct_rows(part.seen)
        most = int(np.argmax(np.bincount(which) * (found.sum(1) > 1)))
        robots, rows = np.flatnonzero(found[most]), np.flatnonzero(which == most)
        if len(robots) < 2 or len(rows) < ROWS:
            return None
        middle, half = 0.5 * float(part.time[0] + part.time[-1]), 0.5 * float(part.time[-1] - part.time[0])
        time, some = part.time[rows], len(robots)
        apart, slope = part.apart[rows][:, robots], part.slope[rows][:, robots]
        columns = np.concatenate([slope, slope * ((time - middle) / half)[:, None, None]], axis=1)
        scores = Scores.of(apart, columns, np.tile(np.arange(some), 2), J[robots], W[robots], STRETCHES)
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
