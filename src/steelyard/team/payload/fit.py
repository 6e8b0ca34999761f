"""The ten parameters of the payload from all recordings at once, biases and gains under priors of their own.

Still and moving rows are fitted together: the force equation in motion and the spread of tilts share the centre of
mass. How large biases and gains are is averaged over a ladder by its evidence: with none, no accuracy is lost to them;
with some, none is pretended. Noise of the wrench per band by expectation maximisation.
Source: the linear form of Atkeson, An, Hollerbach 1986; the paper fits mass, centre and inertia one after the other.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Generic, Protocol, TypeVar

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding
from steelyard.inertia.regressor import motion_map
from steelyard.team.payload.bias_models import Models, Recordings, ladder_of
from steelyard.team.payload.body_rows import PayloadRows
from steelyard.team.payload.gain_sight import of_force
from steelyard.team.payload.model import (
    LEAST_MASS,
    Group,
    Normal,
    least_noise,
    residual_scatter,
    units_of_body,
)
from steelyard.team.payload.spectra import NO_LEVERS
from steelyard.team.stacked import row_slices

# With two robots, whose moment is balanced through the payload alone, it takes up to nine.
ROUNDS = 12
# Noise has settled where it changes by less than this share.
SETTLED = 0.03


@dataclass(frozen=True, eq=False)
class PayloadFit:
    """Ten parameters (10,) in B with covariance (10, 10), and how they came about.

    lost         (10, L) directions, in units of mass and size, that the rows do not show
    scale        (10,) those units
    information  (10, 10) F, so that a change of the rows that moves F phi by d moves phi by F^-1 d
    gain         spread of the force axes' gains that the recordings show
    gain_squares mean products of the gains' errors: drawn anew (R, 3 N, 3 N), and lasting (3 N, 3 N)
    gainless     share of the evidence that gains do not err at all
    biases       (R, 6) that every recording is taken to have
    weights      (K, 6, 6) per group     groups  with their noise     blind  (10, 6) per recording: H_pb H_bb^-1
    unsure       factor by which weights that come from the rows widen the covariance
    levers       (U, 6, Q) of biases that keep their direction in the room (`room_forces`); none in this module. Where
                 there are, information and blind are those of [phi, u]
    """

    parameters: Array
    covariance: Array
    lost: Array
    scale: Array
    information: Array
    condition: float
    gain: float
    gain_squares: tuple[Array, Array]
    gainless: float
    groups: tuple[Group, ...]
    biases: Array
    weights: tuple[Array, ...]
    blind: tuple[tuple[Array, ...], ...]
    residual: Array
    chi2: float
    unsure: float = 1.0
    levers: Array = field(default_factory=lambda: NO_LEVERS)


@dataclass(frozen=True, eq=False)
class Weighing:
    """The payload of some rows, and how forces were read.

    given  (6, 6 N) sums the pushes at B as rows have them, which groups have as they were read
    read   why they were read so     taken  by robot, what (6, 6) makes of a wrench what it was taken for
    """

    groups: tuple[Group, ...]
    given: Array
    read: tuple[Finding, ...]
    taken: Mapping[str, Array]
    payload: PayloadFit


Fitted = Callable[[PayloadRows], Weighing]


def fit_payload(groups: tuple[Group, ...], D: Array, C: Array, size: float, with_gain: bool = True) -> PayloadFit:
    """Return the fit of groups of recordings.

    D  (6, 6 N) sums the pushes at B     C  (6, 6) of a unit bias per force axis     size  of the team [m]
    """
    ladder = ladder_of(sum(len(group.parts) for group in groups), with_gain)
    phi, groups = _start(groups, D, size)
    scale = units_of_body(max(abs(float(phi[0])), LEAST_MASS), size)
    found = settled(groups, phi, _Equations(D), C, ladder, scale, SETTLED)
    phi, models, groups = found.phi, found.models, found.groups
    # Weights come from the noise of as many bands, each found from its rows: Meier 1953, of whose 4 / rows one half is
    # in the noise already.
    last = groups[-1]
    unsure = 1 + 2 * len(last.wrench_noise) / max(sum(float(p.rows.sum()) for p in last.parts), 1.0)
    shown = models.shown(scale)
    return PayloadFit(
        phi, models.covariance_about(phi) * unsure, shown.lost, scale, models.information[models.best],
        shown.condition, models.gain, models.gain_squares, models.gainless, groups,
        models.recordings(models.best).biases, found.weights, found.blind, _residual(groups),
        float(models.chi2[models.best]) / max(6 * _rows(groups) - 10, 1.0), unsure,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Equations:
    """Those of a rigid payload; D (6, 6 N) as of `fit_payload`."""

    D: Array

    def weights(self, group: Group, phi: Array) -> Array:
        return group.weights(phi)

    def normals(self, group: Group, W: Array) -> list[Normal]:
        return group.normals(self.D, W)

    def judged(self, group: Group, W: Array, beside: Recordings, start: int) -> Group:
        """Return the group with its wrench noise renewed: what is left in each band, less the motion's share."""
        squares, rows = np.zeros((len(group.wrench_noise), 6)), np.zeros(len(group.wrench_noise))
        for k, part in enumerate(group.parts):
            squares += residual_scatter(part, self.D, beside.solution(start + k), beside.doubt(start + k))
            rows += part.judged_rows
        phi = beside.phi
        M = motion_map(phi)[:, :6]
        shared = np.einsum("kii->ki", M @ group.motion_noise @ M.T)
        # The mean of a variance given its rows, not the likeliest: weights must not be promised too high.
        seen = squares / np.maximum(rows - 2, 0.5 * rows + 1e-9)[:, None]
        thin = rows < 1
        if thin.any() and not thin.all():
            seen[thin] = seen[~thin].mean(0)
        size = np.maximum((self.D[:, of_force(self.D.shape[1])] ** 2).mean(1), 1e-12)
        seen = np.maximum(seen, least_noise(phi) * size)
        least = np.maximum(0.02 * seen, least_noise(phi) * size)
        # Where the path errs less than was thought, its noise shrinks with it.
        share = np.minimum(1.0, (seen / np.maximum(shared, 1e-300)).max(1))
        return replace(
            group,
            motion_noise=group.motion_noise * share[:, None, None],
            wrench_noise=np.maximum(seen - shared * share[:, None], least),
        )


def _start(groups: tuple[Group, ...], D: Array, size: float) -> tuple[Array, tuple[Group, ...]]:
    """Return phi by least squares with moments in units of force times size, and the noise that is then left."""
    unit = np.concatenate([np.full(3, size**2), np.ones(3)])
    blind = tuple(replace(g, motion_noise=np.zeros_like(g.motion_noise), sighted=False) for g in groups)
    weight = np.linalg.inv(np.diag(unit))
    every = [one for g in blind for one in g.normals(D, np.tile(weight, (len(g.wrench_noise), 1, 1)))]
    flat = units_of_body(1.0, size)
    first = Models.of(every, np.diag(unit), np.array([[0.0, 1.0, 0.0, 0.0]]), flat).recordings(0)
    left, count = np.zeros(6), 0.0
    for k, part in enumerate(part for group in groups for part in group.parts):
        left += residual_scatter(part, D, first.solution(k), np.zeros((16, 16))).sum(0)
        count += float(part.judged_rows.sum())
    phi = first.phi
    noise = np.maximum(left / max(count, 1.0), least_noise(phi) * unit)
    return phi, tuple(replace(g, wrench_noise=np.tile(noise, (len(g.wrench_noise), 1))) for g in groups)


def _residual(groups: tuple[Group, ...]) -> Array:
    """Return the rms (6,) of what is left of the summed moment and force, per row."""
    each = [np.einsum("ki,k->i", g.wrench_noise, p.rows) for g in groups for p in g.parts]
    total = np.sum(each, axis=0)
    return np.asarray(np.sqrt(total / max(_rows(groups), 1.0)))


def _rows(groups: tuple[Group, ...]) -> float:
    """Return how many rows there are in all bands."""
    return sum(float(part.rows.sum()) for group in groups for part in group.parts)


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

    phi  (P,)     blind  (P, B) per group and recording, as of `Recordings`
    """

    phi: Array
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
        models = Models.of([one for each in normals for one in each], C, ladder, scale)
        beside = models.recordings(models.best)
        places = row_slices(normals)
        renewed = tuple(
            equations.judged(group, W, beside, own.start) for group, W, own in zip(groups, weights, places, strict=True)
        )
        blind = tuple(tuple(beside.blind[own]) for own in places)
        return cls(models.mean(), models, blind, groups, weights, renewed)

    @property
    def change(self) -> float:
        """By how much the noise of a band changed at most: the logarithm of its share."""
        pairs = zip(self.renewed, self.groups, strict=True)
        return max(float(np.abs(np.log(new.wrench_noise / old.wrench_noise)).max()) for new, old in pairs)


def settled(
    groups: tuple[G, ...], phi: Array, equations: Equations[G], C: Array, ladder: Array, scale: Array, least: float
) -> Round[G]:
    """Return the round in which no noise changes by the share `least` or more, or the last of ROUNDS."""
    for _ in range(ROUNDS):
        now = Round.of(groups, phi, equations, C, ladder, scale)
        if now.change < least:
            break
        groups, phi = now.renewed, now.phi
    return now
