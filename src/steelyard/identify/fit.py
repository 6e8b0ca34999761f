"""The frame that every estimator shares: noise filled in, rest verified, statistic, solution, conclusion."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import ClassVar, Literal

import numpy as np

from steelyard.check import BREAKDOWNS, Array
from steelyard.errors import BadValue, CannotAnswer
from steelyard.identify.bars.correlated import score_in_time
from steelyard.identify.conclude import conclude
from steelyard.identify.estimate import Estimate
from steelyard.identify.noise_levels import with_noise
from steelyard.identify.problem import NOTHING_KNOWN, BiasPrior, Problem, require_rows, without_drift
from steelyard.identify.rest import at_rest, without_noise_of_rest
from steelyard.identify.solution import Solution
from steelyard.logs.drift import STEADILY
from steelyard.logs.log import MotionLog
from steelyard.logs.moments import Moments


@dataclass(frozen=True)
class Bias:
    """What the force-torque sensor reads without a load.

    kind   "free": a constant force and torque are estimated; "none": the sensor is known to be tared
    prior  what another run has shown of it
    drift  the bias also drifts over the log
    settling  time constant [s] in which such a drift settles; infinite, it grows in a line
    """

    kind: Literal["free", "none"] = "free"
    prior: BiasPrior = NOTHING_KNOWN
    drift: bool = False
    settling: float = STEADILY

    def __post_init__(self) -> None:
        if self.kind not in ("free", "none"):
            raise BadValue(f"bias must be free or none; got {self.kind!r}.")
        if self.drift and self.kind == "none":
            raise BadValue('A tared sensor (bias "none") cannot drift; use bias "free" with drift.')

    @classmethod
    def of(cls, bias: Bias | str) -> Bias:
        """Return `bias`, or the one of that kind."""
        return bias if isinstance(bias, Bias) else cls(bias)  # type: ignore[arg-type]

    @property
    def free(self) -> bool:
        """Whether a bias is estimated."""
        return self.kind == "free"


@contextmanager
def within_numbers() -> Iterator[None]:
    """Turn a breakdown of the linear algebra into CannotAnswer: only rows that hold no body at all lead there."""
    try:
        with np.errstate(all="ignore"):
            yield
    except BREAKDOWNS:
        raise CannotAnswer(
            "The equations of this log cannot be solved: its channels are constant, or their sizes are far from those "
            "of a held body. Check units and columns; `steelyard doctor` tells whether the installation is sound."
        ) from None


def problem_of(moments: Moments, bias: Bias) -> Problem:
    """Return the problem of a statistic that carries its noise, with what is known of the bias."""
    return replace(Problem.of(moments, bias.free), bias_prior=bias.prior)


class Estimator(ABC):
    """A way to solve the problem of a log; its dataclass holds the options.

    method       what results call it
    verify_rest  whether the acceleration of resting rows is fused with zero where the wrench agrees
    bias         "free", "none" or a Bias; a sensor is taken to be tared where the options have none
    """

    method: ClassVar[str]
    verify_rest: ClassVar[bool] = False
    bias: Bias | str = "none"

    @within_numbers()
    def identify(self, log: MotionLog) -> Estimate:
        """Return the estimate of a log.

        Noise that it does not declare is estimated; the order of its rows in time widens the error bars. Raises
        CannotAnswer where the data do not fix mass and centre of mass.
        """
        bias = Bias.of(self.bias)

        def rested(steady: MotionLog) -> MotionLog:
            steady = without_noise_of_rest(steady)
            first = self.solution(_problem(steady, replace(bias, drift=False), by_block=False))
            return at_rest(steady, first.linear[:10], first.bias)

        log, problem = prepared(log, bias, rested if self.verify_rest and log.still.any() else None)
        solution = self.solution(problem)
        score = score_in_time(log, problem, solution)
        return conclude(problem, solution, self.method, score).noted(*score.notes)

    @within_numbers()
    def solve(self, moments: Moments) -> Estimate:
        """Return the estimate from a statistic that carries its noise."""
        problem = problem_of(moments, Bias.of(self.bias))
        return conclude(problem, self.solution(problem), self.method)

    @abstractmethod
    def solution(self, problem: Problem) -> Solution:
        """Return the solution of a problem."""


def prepared(
    log: MotionLog, bias: Bias, settled: Callable[[MotionLog], MotionLog] | None = None
) -> tuple[MotionLog, Problem]:
    """Return the log with the noise that it does not declare estimated, and the problem of it.

    Noise is judged with a drift taken out; `settled` may change such a log before the drift is given back.
    """
    require_rows(len(log))
    steady = without_drift(log, bias.settling) if bias.drift else log
    lost = log.wrench - steady.wrench
    steady = with_noise(steady, bias.free)
    if settled is not None:
        steady = settled(steady)
    log = _drifting(steady, log, lost) if bias.drift else steady
    return log, _problem(log, bias, by_block=True)


def _drifting(steady: MotionLog, log: MotionLog, lost: Array) -> MotionLog:
    """Return the rows of `steady`, which may be fewer than those of `log`, with the drift `lost` (N, 6) given back."""
    if steady.time is None or log.time is None:
        return replace(steady, wrench=steady.wrench + lost)
    order = np.argsort(log.time, kind="stable")
    back = [np.interp(steady.time, log.time[order], column) for column in lost[order].T]
    return replace(steady, wrench=steady.wrench + np.stack(back, 1))


def _problem(log: MotionLog, bias: Bias, by_block: bool) -> Problem:
    problem = problem_of(Moments.of_log(log, by_block), bias)
    return problem.with_drift(log, bias.settling) if bias.drift else problem
