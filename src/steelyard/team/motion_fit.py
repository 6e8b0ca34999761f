"""MotionFit: the joint fit of what moves, of poses where bases stand or of twists where they move."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

from steelyard.check import Array
from steelyard.findings import Finding
from steelyard.logs.team_log import TeamLog
from steelyard.team.changes.slips import SlipAt
from steelyard.team.clocks.errors import NOTHING, ClockErrors

# A level sensor, or a base that is said to be level, is so to within this [rad].
LEVEL = 0.02
# Clocks are moved where they are off by more than this [s] and so many (white) standard deviations: less may be noise,
# and a fit has allowed for it to first order. They are moved at most so often.
PUNCTUAL, DOUBTED, CLOCK_ROUNDS = 2e-4, 4.0, 10


def later(late: Mapping[str, float], more: Array) -> dict[str, float]:
    """Return how late clocks are [s], by robot, and more (N,) besides."""
    return {name: seconds + float(step) for (name, seconds), step in zip(late.items(), more, strict=True)}


def against(late: Mapping[str, float], reference: str) -> dict[str, float]:
    """Return how late every clock is against the reference's."""
    return {name: seconds - late[reference] for name, seconds in late.items()}


@dataclass(frozen=True, eq=False)
class MotionFit(ABC):
    """Recordings with their clocks right, the optimum, with its noise (N, 2), and how late each clock is [s].

    findings     what was found on the way
    clocks_left  what clocks seem to be off by in single recordings, told before slips are looked for
    """

    parts: tuple[Any, ...]
    fit: Any
    late: Mapping[str, float]
    findings: tuple[Finding, ...] = ()
    clocks_left: ClockErrors = NOTHING

    @property
    @abstractmethod
    def rough(self) -> bool:
        """Whether robots disagree by a good part of what the payload moves, as they do where it is not rigid."""

    @abstractmethod
    def clock_errors(self, log: TeamLog) -> ClockErrors:
        """Return what clocks seem to be off by in single recordings."""

    @abstractmethod
    def off(self, log: TeamLog) -> list[Array]:
        """Return by how many times its noise each grasp is off (T, N) where the others say, for every recording."""

    @abstractmethod
    def slip(self, log: TeamLog) -> SlipAt | None:
        """Return the clearest slip, within a recording or else between two."""

    @abstractmethod
    def measured(self, log: TeamLog, found: SlipAt) -> SlipAt:
        """Return a slip with time and step by this fit, which was made without what follows it."""


F = TypeVar("F", bound=MotionFit)
