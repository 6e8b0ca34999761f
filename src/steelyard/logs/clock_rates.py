"""Clocks that run fast or slow beside the wrench's: a delay that grows along the log.

What free linear fits leave of the wrench is compared with what later stamps of a stream, and stamps that get later and
later, would do to it: r = s (late + rate (t - middle)). It starts in the middle, where one delay still holds, and grows
outward, so that a clock may be off by far more at the ends than a motion lasts. Standard deviations come from the
scores of time blocks, so that slow noise does not pass for a clock.
Source: own; the wrench is linear in ten parameters (Atkeson, An, Hollerbach 1986).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array, Integers
from steelyard.logs.delays import Question, features
from steelyard.logs.kinematics import Delays
from steelyard.logs.noise import robust_std
from steelyard.logs.recording import Recording
from steelyard.logs.runs import picked

# A clock is called from so many standard deviations, where it leaves at most this share of the squared residual that
# one delay leaves, is off at the ends by so much [s], and by no more than a clock or a noted rate may be [s/s].
SURE, LEFT, LEAST_S, LARGEST = 8.0, 0.95, 5e-5, 0.05
# A clock shows everywhere; errors that vary with the pose feign another one in each stretch. So the rate must stand out
# by so many standard deviations of what leaving out each of some stretches does to it.
HOLDS, _STRETCHES = 2.0, 8
# The first stretch is at least this long on either side of the middle [s]; each is twice as long as the one before.
_FIRST_S, _STEPS = 4.0, 4
# Rows that are enough, and that a stretch must have, and blocks of them whose scores tell standard deviations.
_ROWS, _FEWEST, _BLOCKS = 3000, 100, 20
# How far [s] a delay may be from the one found, and a rate [s/s] from one, beforehand.
_LATE, _RATE = 0.1, 0.02
_STEP = 1e-3  # [s] for differences
_SETTLED = 0.5  # standard deviations
_FAR = 2.0  # standard deviations from which on a row counts less


@dataclass(frozen=True)
class ClockRate:
    """Stamps that are late by `late` [s] at `middle` [s] on the wrench's clock, and from there by `rate` [s/s] more.

    rate_std  standard deviation of the rate
    """

    late: float
    rate: float
    middle: float
    rate_std: float = 0.0

    def at(self, time: Array) -> Array:
        """Return how late (N,) [s] stamps are at times (N,) [s] of the wrench's clock."""
        return np.asarray(self.late + self.rate * (time - self.middle))

    def right(self, stamps: Array) -> Array:
        """Return stamps (N,) [s] as a clock of the right rate had given them, as late as this one was at the first."""
        true = self.middle + (stamps - self.late - self.middle) / (1 + self.rate)
        return np.asarray(true + self.at(true[:1]))


def clock_rates(question: Question, delays: Mapping[str, float]) -> dict[str, ClockRate]:
    """Return the clocks of streams that surely run fast or slow beside the wrench's, by stream.

    delays  [s] of every stream, as one delay for the whole log; the question says which were sought
    """
    names = tuple(n for n in question.unknown if n != question.felt.stream)
    time = question.time
    middle, full = 0.5 * float(time[0] + time[-1]), 0.5 * float(time[-1] - time[0])
    if not names or full <= 0:
        return {}
    start = {n: ClockRate(delays[n], 0.0, middle) for n in names}
    found, half = start, full
    while half > 2 * _FIRST_S:
        half /= 2
    while half <= full:
        rows = np.flatnonzero(np.abs(time - middle) <= half * (1 + 1e-9)).astype(np.int64)
        if len(rows) >= _FEWEST:
            found = _settled(_rows(question, rows[picked(len(rows), _ROWS)]), start, found, half)
        half *= 2
    every = _rows(question, picked(len(time), _ROWS))
    if not _better(every, start, found):
        return {}
    least = LEAST_S / full
    sure = {n: f for n, f in found.items() if max(SURE * f.rate_std, least) < abs(f.rate) < LARGEST}
    if not sure:
        return {}
    loose = _by_leaving_out(every, start, found, full)
    return {n: f for n, f in sure.items() if abs(f.rate) > HOLDS * loose[n]}


def put_right(recording: Recording, rates: Mapping[str, ClockRate]) -> Recording:
    """Return the recording with the stamps of these streams put right; they stay as late as they begin."""
    streams = tuple(
        replace(s, time=rates[s.name].right(s.time)) if s.name in rates and s.time is not None else s
        for s in recording.streams
    )
    return replace(recording, streams=streams)


def _rows(question: Question, rows: Integers) -> Question:
    return replace(question, time=question.time[rows], felt=question.felt.rows(rows), _cache={})


def _seen(question: Question, clocks: Mapping[str, ClockRate]) -> tuple[Array, Array]:
    """Return features (N, F) of the motion and the channels (N, C) of the wrench that measure, by these clocks."""
    late = {n: clock.at(question.time) for n, clock in clocks.items()}
    delays: Delays = {**question.known, **late}
    motion, force = question.kinematics.at(question.time, delays), None
    if question.imu is not None:
        force = question.imu.signal.at(question.time + delays.get(question.imu.name, 0.0))
    alive = ~np.array(question.felt.dead)
    return np.concatenate(features(motion, force), 1), question.felt.in_sensor(motion.rotation)[:, alive]


@dataclass(frozen=True, eq=False)
class _Linear:
    """A free linear fit of the wrench: features scaled (N, F), their basis Q, coefficients, residual (N, C)."""

    scale: Array
    basis: Array
    coefficients: Array
    residual: Array

    @classmethod
    def of(cls, X: Array, wrench: Array) -> _Linear:
        scale = np.maximum(np.abs(X).max(0), 1e-12)
        coefficients = np.linalg.lstsq(X / scale, wrench, rcond=1e-9)[0]
        residual = wrench - X / scale @ coefficients
        return cls(scale, np.linalg.qr(X / scale)[0], coefficients, residual)

    @property
    def spread(self) -> Array:
        """Spread (C,) of the residual, not drawn by rows far off."""
        return robust_std(self.residual) + 1e-12

    def unexplained(self, values: Array) -> Array:
        """Return what the features leave of values (N, C)."""
        return np.asarray(values - self.basis @ (self.basis.T @ values))


def _settled(
    question: Question, start: Mapping[str, ClockRate], found: Mapping[str, ClockRate], half: float
) -> dict[str, ClockRate]:
    """Return the clocks after Gauss-Newton steps on rows within `half` [s] of the middle."""
    clocks = dict(found)
    for _ in range(_STEPS):
        step, std = _step(question, start, clocks, half)
        clocks = {
            n: replace(clock, late=clock.late + late, rate=clock.rate + rate / half, rate_std=spread / half)
            for (n, clock), (late, rate), (_, spread) in zip(clocks.items(), step, std, strict=True)
        }
        if (np.abs(step) < _SETTLED * std).all():
            break
    return clocks


def _by_leaving_out(
    question: Question, start: Mapping[str, ClockRate], found: Mapping[str, ClockRate], half: float
) -> dict[str, float]:
    """Return the standard deviation [s/s] of each rate by leaving out each of some stretches (jackknife)."""
    stretch = np.arange(len(question.time)) * _STRETCHES // len(question.time)
    without = [np.flatnonzero(stretch != k).astype(np.int64) for k in range(_STRETCHES)]
    told = [_settled(_rows(question, rows), start, found, half) for rows in without]
    spread = np.sqrt(_STRETCHES - 1)
    return {n: float(spread * np.std([clocks[n].rate for clocks in told])) for n in found}


def _step(
    question: Question, start: Mapping[str, ClockRate], clocks: Mapping[str, ClockRate], half: float
) -> tuple[Array, Array]:
    """Return how much later (S, 2) [s] clocks are, in the middle and by growth over `half`, and standard deviations."""
    fit = _Linear.of(*_seen(question, clocks))
    grows = ((question.time - next(iter(clocks.values())).middle) / half)[:, None]
    slopes = []
    for name in clocks:
        slope = fit.unexplained(_slope(question, clocks, name, fit))
        slopes += [slope, fit.unexplained(slope * grows)]
    A = np.stack(slopes, -1) / fit.spread[:, None]
    r = fit.residual / fit.spread
    weighted = A * np.minimum(1.0, _FAR / np.maximum(np.sqrt((r**2).mean(1)), 1e-12))[:, None, None]
    known = np.tile([1 / _LATE**2, 1 / (_RATE * half) ** 2], len(clocks))
    off = np.ravel([[c.late - start[n].late, c.rate * half] for n, c in clocks.items()])
    H = np.einsum("nck,ncl->kl", weighted, A) + np.diag(known)
    step = np.linalg.solve(H, np.einsum("nck,nc->k", weighted, r) - known * off)
    scores = np.einsum("nck,nc->nk", weighted, r - A @ step)
    block = np.minimum(np.arange(len(r)) * _BLOCKS // len(r), _BLOCKS - 1)
    sums = np.stack([np.bincount(block, column, _BLOCKS) for column in scores.T], 1)
    back = np.linalg.inv(H)
    covariance = back @ (sums.T @ sums * _BLOCKS / (_BLOCKS - 1) + np.diag(known)) @ back
    return step.reshape(-1, 2), np.sqrt(np.diag(covariance)).reshape(-1, 2)


def _slope(question: Question, clocks: Mapping[str, ClockRate], name: str, fit: _Linear) -> Array:
    """Return by how much (N, C) the fit says more of the wrench, per second that a stream is later."""
    sides = []
    for by in (_STEP, -_STEP):
        X, wrench = _seen(question, {**clocks, name: replace(clocks[name], late=clocks[name].late + by)})
        sides.append(X / fit.scale @ fit.coefficients - wrench)
    return np.asarray((sides[0] - sides[1]) / (2 * _STEP))


def _better(question: Question, start: Mapping[str, ClockRate], found: Mapping[str, ClockRate]) -> bool:
    """Tell whether clocks leave plainly less of the wrench than one delay each; rows far off count as far."""
    after = _Linear.of(*_seen(question, found))
    before = _Linear.of(*_seen(question, start)).residual / after.spread
    sizes = [np.minimum((r**2).mean(1), _FAR**2).mean() for r in (before, after.residual / after.spread)]
    return bool(sizes[1] < LEFT * sizes[0])
