"""MotionFit: the joint fit of what moves, of poses where bases stand or of twists where they move.

Motion tells how homes, or grasps, are turned, so that what every robot calls down can be compared. A base that is
tilted, a level sensor that sits askew, and twists that are given in other axes than gravity all show so; what the one
says that is alone is left out.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, TypeVar

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding
from steelyard.logs.team_log import TeamLog
from steelyard.spatial import unit_vectors
from steelyard.team.adjoint import adjoint_inverse
from steelyard.team.changes.slips import Slip, alone, clearest, find_slip, noise_alone
from steelyard.team.changes.slips_between import step_between
from steelyard.team.clocks.errors import NOTHING, ClockErrors
from steelyard.team.poses.covariance import Spread
from steelyard.team.stacked import Stretch

# A level sensor, or a base that is said to be level, is so to within this [rad].
LEVEL = 0.02
# Clocks are moved where they are off by more than this [s] and so many (white) standard deviations: less may be noise,
# and a fit has allowed for it to first order. They are moved at most so often.
PUNCTUAL, DOUBTED, CLOCK_ROUNDS = 2e-4, 4.0, 10
# Bases that are said to be level, or told where gravity points, are so to within this [rad]; apart by more, and by so
# many standard deviations of how they are turned, one is not.
TILTED, TILTED_BEYOND = 0.03, 5.0
# One is alone where the others agree by this factor better.
ALONE = 3.0
LEFT_OUT = "It was left out: gravity is what the others say."
MEAN = "The mean was taken; mass and centre of mass may be off by more than their bars."


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
    ORDER        how often what is fitted is differentiated to accelerations: poses twice, twists once
    """

    ORDER: ClassVar[int] = 2

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
    def _left(self) -> list[tuple[Stretch, Array]]:
        """Return the rows of every recording that were used beside their residuals (T, N, 6) in each grasp's axes."""

    @abstractmethod
    def _left_of_all(self, log: TeamLog) -> list[tuple[Stretch, Array]]:
        """Return all rows, used or not, beside residuals (T, N, 6) against the motion that those used show."""

    @abstractmethod
    def _slip_between(self, log: TeamLog, parts: Sequence[Stretch], apart: Sequence[Array]) -> Slip | None:
        """Return the clearest slip between two recordings, from where grasps are (T, N, 6) against the others."""

    @property
    def apart(self) -> Array | None:
        """By how much robots disagree (2,) [rad, m], where that may hide what the payload turned."""
        return None

    @property
    def drifts(self) -> bool:
        """Whether residuals are of how fast grasps move: added up, they wander."""
        return self.ORDER == 1

    @property
    def J(self) -> Array:
        """What grasps do per motion of the payload (N, 6, 6), each in its own axes."""
        return adjoint_inverse(self.fit.grasps)

    @property
    def W(self) -> Array:
        """Weights of residuals (N, 6)."""
        return np.repeat(self.fit.noise**-2.0, 3, axis=1)

    def off(self, log: TeamLog) -> list[Array]:
        """Return by how many times its noise each grasp is off (T, N) where the others say, for every recording."""
        # How two robots share their noise is open: one alone may seem to have next to none.
        noise = np.sqrt(np.einsum("nii->ni", noise_alone(self.J, self.W)))
        return [np.sqrt(((left / noise) ** 2).mean(-1)) for _, left in self._left_of_all(log)]

    def slip(self, log: TeamLog) -> Slip | None:
        """Return the clearest slip, within a recording or else between two."""
        J, W, every = self.J, self.W, self._left()
        parts = [part for part, _ in every]
        apart = [self._places(alone(left, J, W), part) for part, left in every]
        noise, each = noise_alone(J, W), enumerate(zip(parts, apart, strict=True))
        within = clearest(find_slip(k, part, moved, noise, self.drifts) for k, (part, moved) in each)
        return self._slip_between(log, parts, apart) if within is None else within

    def measured(self, log: TeamLog, found: Slip) -> Slip | None:
        """Return a slip with time and step by this fit, which was made without what follows it; None where it is gone.

        What it was found by may have bent the fit that it was found in.
        """
        # Between recordings of twists, fits to what is before and after have told it.
        if found.between and self.drifts:
            return found
        every = self._left_of_all(log)
        if found.between:
            return step_between(found, [part for part, _ in every], [left for _, left in every])
        part, left = every[found.recording]
        noise = noise_alone(self.J, self.W)[found.robot]
        slip = found.renewed(part, self._places(left[:, found.robot], part), noise, self.drifts)
        return slip if slip.large else None

    def _places(self, left: Array, part: Stretch) -> Array:
        """Return how far grasps are off (T, ..., 6) by their residuals."""
        return np.cumsum(left, axis=0) / part.rate if self.drifts else left


F = TypeVar("F", bound=MotionFit)


@dataclass(frozen=True)
class Tilted:
    """Bases that disagree: number of the robot that is alone with what it says, None where nobody clearly is."""

    odd: int | None
    finding: Finding


def unlevel(down: Array, spread: Spread) -> float:
    """Return how far [rad] the mean of what robots call down may be off, by how far they disagree; zero if they agree.

    down  (N, 3) as of `tilted`
    """
    if _disagreeing(down, spread) is None:
        return 0.0
    each = unit_vectors(down[down.any(1)])
    off, n = each - unit_vectors(each.mean(0)), len(each)
    return float(np.sqrt((off**2).sum() / (n * (n - 1))))


def _disagreeing(down: Array, spread: Spread) -> Array | None:
    """Return the angles (n, n) [rad] between what robots that tell it call down (N, 3); None where they agree."""
    each = unit_vectors(down[down.any(1)])
    if len(each) < 2 or spread.blind.size:
        return None
    apart = np.arccos(np.clip(each @ each.T, -1.0, 1.0))
    # Where nothing is lost, the size of the team does not matter.
    return None if apart.max() < TILTED_BEYOND * spread.turn(1.0) else np.asarray(apart)


def tilted(names: tuple[str, ...], down: Array, spread: Spread, mean: str = MEAN) -> Tilted | None:
    """Return who disagrees on where gravity points; None where all agree, or where some turn is not known.

    down  (N, 3) what each robot calls down, in common axes; zero of those who do not tell
    mean  what is said where nobody is alone, so that the mean counts
    """
    apart, who = _disagreeing(down, spread), np.flatnonzero(down.any(1))
    if apart is None or apart.max() < TILTED:
        return None
    # The one who is farthest from the others, where those agree far better.
    odd = int(np.argmax(np.median(apart, axis=1)))
    others = np.delete(np.delete(apart, odd, 0), odd, 1)
    alone = len(who) > 2 and others.max() < apart.max() / ALONE
    if alone:
        degrees = np.rad2deg(float(np.median(np.delete(apart[odd], odd))))
        said = f"Gravity of '{names[who[odd]]}' points {degrees:.1f} deg from where that of the others does"
    else:
        i, j = (names[who[k]] for k in np.unravel_index(np.argmax(apart), apart.shape))
        said = f"Gravity of '{i}' and of '{j}' points {np.rad2deg(apart.max()):.1f} deg apart"
    text = (
        f"{said}, though motion tells how they are turned: a base, or a level sensor, is tilted, gravity is not what "
        f"was said, or twists are in other axes. {LEFT_OUT if alone else mean}"
    )
    return Tilted(int(who[odd]) if alone else None, Finding.of("base-tilted", text))
