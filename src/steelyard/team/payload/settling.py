"""Parameters and noise in turn: the payload by the noise of every band, and that noise by what the payload leaves.

Source: expectation maximisation, Dempster, Laird, Rubin 1977.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np

from steelyard.check import Array
from steelyard.team.payload.bias_models import Models, Recordings
from steelyard.team.payload.model import Normal
from steelyard.team.stacked import row_slices


class Banded(Protocol):
    """Recordings of one kind with common bands."""

    @property
    def wrench_noise(self) -> Array:
        """Variances (K, ...) of the wrench in every band."""


G = TypeVar("G", bound=Banded)


class Equations(Protocol[G]):
    """The wrench equations of a payload of P parameters."""

    def weights(self, group: G, phi: Array) -> Array:
        """Return the inverse (K, E, E) of the noise of a row, for parameters phi (P,)."""

    def normals(self, group: G, W: Array) -> list[Normal]:
        """Return the normal equations of every recording with these weights."""

    def judged(self, group: G, W: Array, beside: Recordings, start: int) -> G:
        """Return the group, whose recordings are `start` and those after it, with its noise renewed."""


@dataclass(frozen=True, eq=False)
class Round(Generic[G]):
    """The models of one round, with what they were made from, and the groups renewed by them.

    normals  of all recordings, from the noise and the weights of groups

    phi  (P,)     blind  (P, B) per group and recording, as of `Recordings`
    """

    phi: Array
    normals: tuple[Normal, ...]
    models: Models
    blind: tuple[tuple[Array, ...], ...]
    groups: tuple[G, ...]
    weights: tuple[Array, ...]
    renewed: tuple[G, ...]

    @classmethod
    def of(
        cls, groups: tuple[G, ...], phi: Array, equations: Equations[G], C: Array, ladder: Array, scale: Array
    ) -> Round[G]:
        """Return the round from phi (P,) and the noise of groups; C, ladder and scale as of `Models`."""
        weights = tuple(equations.weights(group, phi) for group in groups)
        normals = [equations.normals(group, W) for group, W in zip(groups, weights, strict=True)]
        every = tuple(one for each in normals for one in each)
        models = Models.of(every, C, ladder, scale)
        beside = models.recordings(models.best)
        places = row_slices(normals)
        renewed = tuple(
            equations.judged(group, W, beside, own.start) for group, W, own in zip(groups, weights, places, strict=True)
        )
        blind = tuple(tuple(beside.blind[own]) for own in places)
        return cls(models.mean(), every, models, blind, groups, weights, renewed)

    @property
    def change(self) -> float:
        """By how much the noise of a band changed at most: the logarithm of its share."""
        pairs = zip(self.renewed, self.groups, strict=True)
        return max(float(np.abs(np.log(new.wrench_noise / old.wrench_noise)).max()) for new, old in pairs)


def settled(
    groups: tuple[G, ...], phi: Array, equations: Equations[G], C: Array, ladder: Array, scale: Array,
    fewest: int, most: int, least: float,
) -> Round[G]:  # fmt: skip
    """Return the last of `fewest` to `most` rounds: that in which no noise changes by the share `least` or more."""
    for number in range(1, most + 1):
        now = Round.of(groups, phi, equations, C, ladder, scale)
        if number >= fewest and now.change < least:
            break
        groups, phi = now.renewed, now.phi
    return now
