"""Clocks that part from the wrench's in the course of a log, fitted to what the wrench says of the motion.

What free linear fits leave of the wrench is compared with what later stamps of a stream, and stamps that get later in
some course of time, would do to it: r = s (late + more * course). Standard deviations come from the scores of time
blocks, so that slow noise does not pass for a clock.
Source: own; the wrench is linear in ten parameters (Atkeson, An, Hollerbach 1986).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, TypeVar

import numpy as np

from steelyard.check import Array
from steelyard.logs.delays import Question, features
from steelyard.logs.noise import FAR, block_covariance, huber, robust_std
from steelyard.logs.runs import stretches

# A clock is called from so many standard deviations, where it leaves at most this share of the squared residual that
# one delay leaves.
SURE, LEFT = 8.0, 0.95
# A clock shows everywhere; errors that vary with the pose feign another one in each stretch. So it must stand out by so
# many standard deviations of what leaving out each of some stretches does to it.
_HOLDS, _STRETCHES = 2.0, 8
# Rows that are enough, and blocks of them whose scores tell standard deviations.
ROWS, _BLOCKS = 3000, 20
_STEPS = 4
# How far [s] a delay may be from the one that is started from, beforehand.
_LATE = 0.1
_STEP = 1e-3  # [s] for differences
_SETTLED = 0.5  # standard deviations


@dataclass(frozen=True)
class ClockCourse(ABC):
    """Stamps that are late by `late` [s], and by `more` times a course that has to do with `middle` [s] besides.

    Times are those of the wrench's clock; more_std is the standard deviation of `more`.
    """

    late: float
    more: float
    middle: float
    more_std: float = 0.0
    # How far `more` may be from what is started from, beforehand.
    WIDTH: ClassVar[float]

    @abstractmethod
    def course(self, time: Array) -> Array:
        """Return the course (N,) at times (N,) [s] of the wrench's clock."""

    def at(self, time: Array) -> Array:
        """Return how late (N,) [s] stamps are at times (N,) [s] of the wrench's clock."""
        return np.asarray(self.late + self.more * self.course(time))


Clock = TypeVar("Clock", bound=ClockCourse)


def seen(question: Question, clocks: Mapping[str, ClockCourse]) -> tuple[Array, Array]:
    """Return features (N, F) of the motion and the channels (N, C) of the wrench that measure, by these clocks."""
    late = {n: clock.at(question.time) for n, clock in clocks.items()}
    motion, wrench, force = question.seen_anew({**question.known, **late})
    return np.concatenate(features(motion, force), 1), wrench[:, ~np.array(question.felt.dead)]


@dataclass(frozen=True, eq=False)
class Linear:
    """A free linear fit of the wrench: features scaled (N, F), their basis Q, coefficients, residual (N, C)."""

    scale: Array
    basis: Array
    coefficients: Array
    residual: Array

    @classmethod
    def of(cls, question: Question, clocks: Mapping[str, ClockCourse]) -> Linear:
        """Return the fit with stamps that are as late as these clocks say."""
        X, wrench = seen(question, clocks)
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

    def left(self, question: Question, clocks: Mapping[str, ClockCourse]) -> Array:
        """Return what its coefficients leave (N, C) of the wrench by other clocks."""
        X, wrench = seen(question, clocks)
        return np.asarray(wrench - X / self.scale @ self.coefficients)

    def slope(self, question: Question, clocks: Mapping[str, ClockCourse], name: str) -> Array:
        """Return by how much (N, C) the fit says more of the wrench, per second that a stream is later."""
        own = clocks[name]
        sides = (replace(own, late=own.late + by) for by in (-_STEP, _STEP))
        early, late = (self.left(question, {**clocks, name: side}) for side in sides)
        return np.asarray((early - late) / (2 * _STEP))


def settled(question: Question, start: Mapping[str, Clock], found: Mapping[str, Clock]) -> dict[str, Clock]:
    """Return the clocks after Gauss-Newton steps from `found`, softly held at `start`."""
    clocks = dict(found)
    for _ in range(_STEPS):
        step, std = _step(question, start, clocks)
        clocks = {
            n: replace(clock, late=clock.late + late, more=clock.more + more, more_std=spread)
            for (n, clock), (late, more), (_, spread) in zip(clocks.items(), step, std, strict=True)
        }
        if (np.abs(step) < _SETTLED * std).all():
            break
    return clocks


def holding(
    question: Question, start: Mapping[str, Clock], found: Mapping[str, Clock], sure: Mapping[str, Clock]
) -> dict[str, Clock]:
    """Return those of the `sure` clocks whose `more` holds when each of some stretches is left out (jackknife)."""
    stretch = stretches(len(question.time), _STRETCHES)
    without = [np.flatnonzero(stretch != k).astype(np.int64) for k in range(_STRETCHES)]
    told = [settled(question.rows(rows), start, found) for rows in without]
    loose = {n: np.sqrt(_STRETCHES - 1) * float(np.std([clocks[n].more for clocks in told])) for n in sure}
    return {n: clock for n, clock in sure.items() if abs(clock.more) > _HOLDS * loose[n]}


def _step(
    question: Question, start: Mapping[str, ClockCourse], clocks: Mapping[str, ClockCourse]
) -> tuple[Array, Array]:
    """Return how much later (S, 2) clocks are, at first [s] and by their course, and standard deviations."""
    fit = Linear.of(question, clocks)
    slopes = []
    for name, clock in clocks.items():
        slope = fit.unexplained(fit.slope(question, clocks, name))
        slopes += [slope, fit.unexplained(slope * clock.course(question.time)[:, None])]
    A = np.stack(slopes, -1) / fit.spread[:, None]
    r = fit.residual / fit.spread
    weighted = A * huber(r)[:, None, None]
    known = np.ravel([[1 / _LATE**2, 1 / clock.WIDTH**2] for clock in clocks.values()])
    off = np.ravel([[c.late - start[n].late, c.more - start[n].more] for n, c in clocks.items()])
    H = np.einsum("nck,ncl->kl", weighted, A) + np.diag(known)
    step = np.linalg.solve(H, np.einsum("nck,nc->k", weighted, r) - known * off)
    scores = np.einsum("nck,nc->nk", weighted, r - A @ step)
    covariance = block_covariance(H, scores, known, _BLOCKS)
    return step.reshape(-1, 2), np.sqrt(np.diag(covariance)).reshape(-1, 2)


def share_left(question: Question, before: Mapping[str, ClockCourse], after: Mapping[str, ClockCourse]) -> float:
    """Return what clocks leave of the wrench beside what those before leave (squares); rows far off count as far."""
    fit = Linear.of(question, after)
    rivals = Linear.of(question, before).residual / fit.spread, fit.residual / fit.spread
    sizes = [np.minimum((r**2).mean(1), FAR**2).mean() for r in rivals]
    return float(sizes[1] / sizes[0])
