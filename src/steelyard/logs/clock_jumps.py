"""Clocks that jump within a log: one delay fits up to some time, and another from there on.

A look at how late the rows of each stretch seem costs little, and says whether it is worth a search. That tries every
delay on either side of every time, each side with a linear fit of its own, from moments. What it finds is fitted with
one body for both sides, and must leave plainly less than one delay, or one that grows steadily, does.
Source: own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array
from steelyard.logs.clock_fit import ROWS, SURE, ClockCourse, Linear, holding, seen, settled, share_left
from steelyard.logs.clock_rates import ClockRate
from steelyard.logs.delays import Question
from steelyard.logs.noise import huber
from steelyard.logs.runs import picked

# A jump is at least so long [s], and leaves less by this factor than one delay does, or one that grows steadily.
LEAST_S, BETTER = 2e-3, 1.1
# The search is made where rows seem late by two amounts that explain so many times what is left of a stretch's, or
# where that is so many times what noise makes of it; of so many stretches, and so many on either side of a jump.
_APART, _LOUD, _STRETCHES, _ENDS = 10.0, 8.0, 60, 4
# Delays that it tries reach so far [s], and over so much of the log, in steps [s]; by rows, in bins, of which each side
# has a share.
_FAR_S, _FAR, _LAG_S, _FEW_ROWS, _BINS, _SIDE = 1.2, 0.1, 0.02, 1500, 40, 0.15
# Standard deviations beyond which a row counts as so far off.
_FAR_OFF = 10.0


@dataclass(frozen=True)
class ClockJump(ClockCourse):
    """Stamps that are late by `late` [s] up to `middle` [s], and by `more` [s] besides from there on."""

    WIDTH = 0.1

    def course(self, time: Array) -> Array:
        """Return zero before and one after the jump, (N,)."""
        return np.asarray(time >= self.middle, dtype=np.float64)


def clock_jumps(question: Question, delays: Mapping[str, float]) -> dict[str, ClockJump]:
    """Return the clocks of streams that surely jump beside the wrench's, all at one time, by stream.

    delays  [s] of every stream, as one delay for the whole log; the question says which were sought
    """
    every = question.thinned(ROWS)
    start = {n: ClockJump(delays[n], 0.0, np.inf) for n in question.others}
    if not start or not _worth_a_search(every, start):
        return {}
    # One stream's clock, or the wrench's, beside which all jump.
    moves = dict.fromkeys([*((name,) for name in start), tuple(start)])
    found = [clocks for clocks in (_fitted(every, start, moved) for moved in moves) if clocks]
    if not found:
        return {}
    best = min(found, key=lambda clocks: share_left(every, start, clocks))
    return _sure(every, start, best)


def _worth_a_search(question: Question, start: Mapping[str, ClockJump]) -> bool:
    """Tell whether rows seem late by two amounts, or by more than noise makes of it."""
    fit = Linear.of(question, start)
    r = fit.residual / fit.spread
    counts = huber(r)
    for name in start:
        slope = fit.unexplained(fit.slope(question, start, name)) / fit.spread
        told = np.einsum("n,nc,nc->n", counts, slope, slope)
        share = np.cumsum(told) / max(float(told.sum()), 1e-300)
        stretch = np.minimum((share * _STRETCHES).astype(np.int64), _STRETCHES - 1)
        weight = np.asarray(np.bincount(stretch, told, _STRETCHES) + 1e-300)
        score = np.einsum("n,nc,nc->n", counts, slope, r)
        size, apart, loud = _two_levels(np.bincount(stretch, score, _STRETCHES) / weight, weight)
        if size > LEAST_S and (apart > _APART or loud > _LOUD):
            return True
    return False


def _two_levels(values: Array, weight: Array) -> tuple[float, float, float]:
    """Return how far apart two levels of values (K,) are, how much they explain over what is left, and that."""
    sums, up_to = np.cumsum(values * weight), np.cumsum(weight)
    before, after = up_to[:-1], up_to[-1] - up_to[:-1]
    one, two = sums[:-1] / before, (sums[-1] - sums[:-1]) / after
    gain = (one - two) ** 2 * before * after / up_to[-1]
    k = int(gain[_ENDS - 1 : -_ENDS + 1].argmax()) + _ENDS - 1
    level = np.where(np.arange(len(values)) <= k, one[k], two[k])
    loud = float(((values - level) ** 2 * weight).sum()) / (len(values) - 2)
    return abs(float(two[k] - one[k])), float(gain[k]) / max(loud, 1e-300), loud


def _fitted(question: Question, start: Mapping[str, ClockJump], moved: tuple[str, ...]) -> dict[str, ClockJump]:
    """Return the clocks with a jump of these streams, where delays of either side fit best; empty where too short."""
    split = _searched(question, start, moved)
    if split is None:
        return {}
    at, before, after = split
    clocks = {
        n: replace(c, late=c.late + before, more=after - before, middle=at) if n in moved else replace(c, middle=at)
        for n, c in start.items()
    }
    for _ in range(2):
        clocks = settled(question, clocks, clocks)
        clocks = _better_placed(question, clocks)
    return settled(question, clocks, clocks)


def _searched(
    question: Question, start: Mapping[str, ClockJump], moved: tuple[str, ...]
) -> tuple[float, float, float] | None:
    """Return the time of a jump and how much later [s] streams are before and after it than they start."""
    time = question.time
    far = min(_FAR_S, _FAR * float(time[-1] - time[0]))
    inner = np.flatnonzero((time > time[0] + far) & (time < time[-1] - far)).astype(np.int64)
    if len(inner) < 4 * _BINS:
        return None
    in_bins = min(len(inner), _FEW_ROWS) // _BINS * _BINS
    few = question.rows(inner[picked(len(inner), in_bins)])
    spread, steps = Linear.of(few, start).spread, round(far / _LAG_S)
    lags = _LAG_S * np.arange(-steps, steps + 1)
    moments: list[Array] = []
    for lag in lags:
        X, wrench = seen(few, {n: replace(c, late=c.late + (lag if n in moved else 0.0)) for n, c in start.items()})
        if not moments:
            scale = np.abs(X).max(0) + 1e-12
        z = np.concatenate([X / scale, wrench / spread], 1).reshape(_BINS, -1, X.shape[1] + wrench.shape[1])
        moments.append(z.swapaxes(1, 2) @ z)
    sums = np.cumsum(moments, axis=1)
    columns = sums.shape[-1] - len(spread)
    one, two = _left(sums[:, :-1], columns), _left(sums[:, -1:] - sums[:, :-1], columns)
    ends = round(_SIDE * _BINS)
    k = int((one.min(0) + two.min(0))[ends - 1 : -ends + 1].argmin()) + ends - 1
    at = float(few.time.reshape(_BINS, -1)[k + 1, 0])
    return at, float(lags[one[:, k].argmin()]), float(lags[two[:, k].argmin()])


def _left(moments: Array, columns: int) -> Array:
    """Return the squares (..) that linear fits by the first columns leave of the others, from moments (.., M, M)."""
    normal, right = moments[..., :columns, :columns], moments[..., :columns, columns:]
    size = np.trace(normal, axis1=-2, axis2=-1)[..., None, None] / columns
    answer = np.linalg.solve(normal + 1e-9 * size * np.eye(columns), right)
    whole = np.trace(moments[..., columns:, columns:], axis1=-2, axis2=-1)
    return np.asarray(whole - (right * answer).sum((-2, -1)))


def _better_placed(question: Question, clocks: Mapping[str, ClockJump]) -> dict[str, ClockJump]:
    """Return the clocks with the jump at the time at which both delays together fit best."""
    fit = Linear.of(question, clocks)
    early, late = (
        (np.minimum(np.abs(left) / fit.spread, _FAR_OFF) ** 2).sum(1)
        for left in (fit.left(question, _at(clocks, middle)) for middle in (np.inf, -np.inf))
    )
    total = np.concatenate([[0.0], np.cumsum(early - late)])
    ends = round(_SIDE * len(total))
    k = int(total[ends:-ends].argmin()) + ends
    return _at(clocks, float(question.time[k]))


def _at(clocks: Mapping[str, ClockJump], middle: float) -> dict[str, ClockJump]:
    """Return clocks that jump at another time [s]."""
    return {n: replace(clock, middle=middle) for n, clock in clocks.items()}


def _sure(question: Question, start: Mapping[str, ClockJump], found: Mapping[str, ClockJump]) -> dict[str, ClockJump]:
    """Return the clocks that surely jump, of those found."""
    sure = {n: f for n, f in found.items() if abs(f.more) > max(LEAST_S, SURE * f.more_std)}
    if not sure or not share_left(question, start, found) < 1 / BETTER:
        return {}
    time = question.time
    span, middle = float(time[-1] - time[0]), 0.5 * float(time[-1] + time[0])
    growing = {n: ClockRate(f.late + f.more / 2, 1.5 * f.more / span, middle) for n, f in found.items()}
    if not share_left(question, settled(question, growing, growing), found) < 1 / BETTER:
        return {}
    return holding(question, found, found, sure)
