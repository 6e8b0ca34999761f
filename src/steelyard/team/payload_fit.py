"""The ten parameters of the payload from all recordings at once, force bias and gain of each under one prior.

Still and moving rows are fitted together: the force equation in motion and the spread of tilts share the centre of
mass. How large bias and gain are is averaged over a ladder by its evidence: with none, no accuracy is lost to them;
with some, none is pretended. Noise of the wrench per band by expectation maximisation.
Source: the linear form of Atkeson, An, Hollerbach 1986; the paper fits mass, centre and inertia one after the other.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from steelyard.check import Array
from steelyard.identify.regressor import motion_map
from steelyard.logs.log import Mask
from steelyard.team.definite import definite, inverses
from steelyard.team.payload_model import ROUNDING, Group, Normal, normal, residual_scatter

# [N] bias of a force axis: from none to as much as a light payload weighs. Error of its gain: from none to 10 %.
BIAS = np.geomspace(1e-3, 10.0, 13)
# That gains have no error at all is beforehand as likely as so many other sizes together.
NO_GAIN_ERROR = 3.0
GAIN = np.array([0.0, 3e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1])
# With two robots, whose moment is balanced through the payload alone, it takes up to nine.
ROUNDS = 12
# Noise has settled where it changes by less than this share.
SETTLED = 0.03
# What a body of this mass and size could be: a direction whose error is not below this share of it is lost.
SHOWN = 0.3
# Information below this share of the largest is rounding.
RANK = 1e-11


@dataclass(frozen=True, eq=False)
class PayloadFit:
    """Ten parameters (10,) in B with covariance (10, 10), and how they came about.

    lost         (10, L) directions, in units of mass and size, that the rows do not show
    scale        (10,) those units
    information  (10, 10) F, so that a change of the rows that moves F phi by d moves phi by F^-1 d
    gain         spread of the force axes' gains that the recordings show
    weights      (K, 6, 6) per group     groups  with their noise     blind  (10, 6) per recording: H_pb H_bb^-1
    """

    parameters: Array
    covariance: Array
    lost: Array
    scale: Array
    information: Array
    condition: float
    gain: float
    groups: tuple[Group, ...]
    weights: tuple[Array, ...]
    blind: tuple[tuple[Array, ...], ...]
    residual: Array
    chi2: float


def fit_payload(groups: tuple[Group, ...], D: Array, C: Array, size: float, with_gain: bool = True) -> PayloadFit:
    """Return the fit of groups of recordings.

    D  (6, 6 N) sums the pushes at B     C  (6, 6) of a unit bias per force axis     size  of the team [m]
    """
    ladder = np.array([(b, g) for b in BIAS for g in (GAIN if with_gain else GAIN[:1])])
    phi, groups = _start(groups, D, size)
    scale = _units(phi, size)
    starts = np.cumsum([0, *(len(group.parts) for group in groups)])
    for left in reversed(range(ROUNDS)):
        weights = tuple(group.weights(phi) for group in groups)
        normals = [
            normal(part, D, W, group.motion_noise)
            for group, W in zip(groups, weights, strict=True)
            for part in group.parts
        ]
        models = Models.of(normals, C, ladder, scale)
        weight = ladder_shares(models, ladder)
        phi, best = weight @ models.phi, int(np.argmax(weight))
        renewed = tuple(_judged(g, D, models, best, int(s)) for g, s in zip(groups, starts[:-1], strict=True))
        change = max(
            float(np.abs(np.log(new.wrench_noise / old.wrench_noise)).max())
            for new, old in zip(renewed, groups, strict=True)
        )
        # Weights and groups that are told belong together, however it ends.
        if not left or change < SETTLED:
            break
        groups = renewed
    off = models.phi - phi
    covariance = np.tensordot(weight, models.covariance, 1) + np.einsum("l,lp,lq->pq", weight, off, off)
    # Weights come from the noise of as many bands, each found from its rows: Meier 1953, of whose 4 / rows one half is
    # in the noise already.
    last = groups[-1]
    covariance = covariance * (1 + 2 * len(last.wrench_noise) / max(sum(float(p.rows.sum()) for p in last.parts), 1.0))
    gain = float(np.sqrt(weight @ np.square(ladder[:, 1])))
    rows = sum(float(part.rows.sum()) for group in groups for part in group.parts)
    blind = tuple(tuple(models.blind[best, a:b]) for a, b in pairwise(starts))
    noise = sum((n.noise for n in normals), np.zeros((10, 10)))
    unit = np.outer(scale, scale)
    values, vectors = np.linalg.eigh((models.information[best] - noise) * unit)
    shown = shown_of(values, vectors, noise * unit)
    condition = float(np.sqrt(values[-1] / values[shown][0])) if shown.any() else np.inf
    return PayloadFit(
        phi, covariance, vectors[:, ~shown], scale, models.information[best], condition, gain,
        groups, weights, blind, _residual(groups), float(models.chi2[best]) / max(6 * rows - 10, 1.0),
    )  # fmt: skip


def ladder_shares(models: Models, ladder: Array) -> Array:
    """Return the share (L,) of every spread of bias and gain (L, 2) by evidence; none in the gain is the likeliest."""
    chance = models.evidence + np.where(ladder[:, 1] == 0, np.log(NO_GAIN_ERROR), 0.0)
    weight = np.exp(chance - chance.max())
    return np.asarray(weight / weight.sum())


def _units(phi: Array, size: float) -> Array:
    mass = max(abs(float(phi[0])), 1e-3)
    return np.concatenate([[mass], np.full(3, mass * size), np.full(6, mass * size**2)])


def _start(groups: tuple[Group, ...], D: Array, size: float) -> tuple[Array, tuple[Group, ...]]:
    """Return phi by least squares with moments in units of force times size, and the noise that is then left."""
    unit = np.concatenate([np.full(3, size**2), np.ones(3)])
    loud = tuple(
        replace(g, motion_noise=np.zeros_like(g.motion_noise), wrench_noise=np.tile(unit, (len(g.wrench_noise), 1)))
        for g in groups
    )
    weight = np.linalg.inv(np.diag(unit))[None]
    every = [
        normal(part, D, np.repeat(weight, len(g.wrench_noise), 0), g.motion_noise) for g in loud for part in g.parts
    ]
    flat = np.concatenate([[1.0], np.full(3, size), np.full(6, size**2)])
    first = Models.of(every, np.diag(unit), np.array([[1.0, 0.0]]), flat)
    left, count = np.zeros(6), 0.0
    for k, part in enumerate(part for group in loud for part in group.parts):
        left += residual_scatter(part, D, first.solution(0, k), np.zeros((16, 16))).sum(0)
        count += float(part.judged_rows.sum())
    phi = first.phi[0]
    noise = np.maximum(left / max(count, 1.0), (ROUNDING * abs(phi[0]) * 9.81) ** 2 * unit)
    return phi, tuple(replace(g, wrench_noise=np.tile(noise, (len(g.wrench_noise), 1))) for g in groups)


@dataclass(frozen=True, eq=False)
class Models:
    """The answers at L sizes (bias, gain), and the bias of every recording beside each: P parameters, B of a bias.

    phi (L, P)     covariance, information (L, P, P)     evidence, chi2 (L,)
    inner (L, R, B, B) covariance of a bias beside a known body     blind (L, R, P, B) H_pb H_bb^-1
    """

    phi: Array
    covariance: Array
    information: Array
    evidence: Array
    chi2: Array
    inner: Array
    blind: Array
    right: Array

    @classmethod
    def of(cls, normals: list[Normal], C: Array, ladder: Array, scale: Array) -> Models:
        """Return the models at every (bias, gain) of the ladder (L, 2); C (B, B) of a unit bias, scale (P,) units."""
        size = len(scale)
        H, g = np.stack([n.H for n in normals]), np.stack([n.g for n in normals])
        pulled = np.stack([n.pulled for n in normals])
        bias, gain = np.square(ladder.T)[..., None, None, None]
        spread = bias * C + gain * pulled
        narrow, wide = inverses(spread)
        inner, held = inverses(H[:, size:, size:] + narrow)
        blind = H[:, :size, size:] @ inner
        plain = H[:, :size, :size].sum(0) - (blind @ H[:, size:, :size]).sum(1)
        right = g[:, :size].sum(0) - (blind @ g[:, size:, None])[..., 0].sum(1)
        taken = np.einsum("ri,lrij,rj->l", g[:, size:], inner, g[:, size:])
        unit = np.outer(scale, scale)
        full = plain * unit
        ridge = 1e-12 * np.trace(full, axis1=1, axis2=2)[:, None, None] * np.eye(size)
        seen = (inverses(full + ridge)[0] @ (scale * right)[..., None])[..., 0]
        chi2 = sum(n.constant for n in normals) - taken - np.einsum("lp,lp->l", seen, scale * right)
        evidence = -0.5 * (chi2 + inverses(np.eye(size) + full)[1] + (wide + held).sum(1))
        phi, covariance = _answers(full, sum((n.noise for n in normals), np.zeros((size, size))) * unit, scale * right)
        return cls(
            scale * phi, unit * covariance, plain, evidence, np.asarray(chi2), np.asarray(inner), blind, g[:, size:]
        )

    def solution(self, model: int, recording: int) -> Array:
        """Return [phi, bias] (P + B,) of one recording."""
        phi, blind = self.phi[model], self.blind[model, recording]
        return np.concatenate([phi, self.inner[model, recording] @ self.right[recording] - blind.T @ phi])

    def doubt(self, model: int, recording: int) -> Array:
        """Return their covariance (P + B, P + B)."""
        covariance, blind = self.covariance[model], self.blind[model, recording]
        cross = -blind.T @ covariance
        return np.block([[covariance, cross.T], [cross, self.inner[model, recording] - cross @ blind]])


def _answers(full: Array, noise: Array, right: Array) -> tuple[Array, Array]:
    """Return phi (L, P) and covariance (L, P, P) in units of `scale`.

    What noise in the motion adds to the information is taken out. A lost direction stays at zero, as unsure as a body
    of this mass and size can be.
    """
    known, all_of = full - noise, np.eye(len(noise))
    least = np.maximum(SHOWN**-2.0, RANK * np.trace(known, axis1=1, axis2=2))[:, None, None]
    if definite(known - noise).all() and definite(known - least * all_of).all():
        # Every direction is shown, whichever they are.
        inverse = inverses(known)[0]
        return (inverse @ right[..., None])[..., 0], inverse @ full @ inverse
    values, vectors = np.linalg.eigh(known)
    shown = shown_of(values, vectors, noise)
    inverse = (vectors * np.where(shown, 1 / np.where(shown, values, 1.0), 0.0)[:, None]) @ vectors.swapaxes(1, 2)
    lost = vectors * ~shown[:, None]
    covariance = inverse @ full @ inverse + lost @ lost.swapaxes(1, 2)
    return (inverse @ right[..., None])[..., 0], covariance


def shown_of(values: Array, vectors: Array, noise: Array) -> Mask:
    """Return which rising information (..., P), in units of what a body can be, is more than noise and rounding.

    What noise in the motion alone would seem to say, `noise`, is known to no better than its own size.
    """
    seeming = np.einsum("...pk,pq,...qk->...k", vectors, noise, vectors)
    return np.asarray((values > SHOWN**-2.0) & (values > RANK * values[..., -1:]) & (values > seeming))


def _judged(group: Group, D: Array, models: Models, best: int, start: int) -> Group:
    """Return the group with its wrench noise renewed: what is left in each band, less the motion's share."""
    squares, rows = np.zeros((len(group.wrench_noise), 6)), np.zeros(len(group.wrench_noise))
    for k, part in enumerate(group.parts):
        squares += residual_scatter(part, D, models.solution(best, start + k), models.doubt(best, start + k))
        rows += part.judged_rows
    phi = models.phi[best]
    M = motion_map(phi)[:, :6]
    shared = np.einsum("kii->ki", M @ group.motion_noise @ M.T)
    # The mean of a variance given its rows, not the likeliest: weights must not be promised too high.
    seen = squares / np.maximum(rows - 2, 0.5 * rows + 1e-9)[:, None]
    thin = rows < 1
    if thin.any() and not thin.all():
        seen[thin] = seen[~thin].mean(0)
    size = np.maximum((D[:, np.arange(D.shape[1]) % 6 >= 3] ** 2).mean(1), 1e-12)
    seen = np.maximum(seen, (ROUNDING * abs(phi[0]) * 9.81) ** 2 * size)
    least = np.maximum(0.02 * seen, (ROUNDING * abs(phi[0]) * 9.81) ** 2 * size)
    # Where the path errs less than was thought, its noise shrinks with it.
    share = np.minimum(1.0, (seen / np.maximum(shared, 1e-300)).max(1))
    return replace(
        group,
        motion_noise=group.motion_noise * share[:, None, None],
        wrench_noise=np.maximum(seen - shared * share[:, None], least),
    )


def _residual(groups: tuple[Group, ...]) -> Array:
    """Return the rms (6,) of what is left of the summed moment and force, per row."""
    rows = sum(float(p.rows.sum()) for g in groups for p in g.parts)
    each = [np.einsum("ki,k->i", g.wrench_noise, p.rows) for g in groups for p in g.parts]
    total = np.sum(each, axis=0)
    return np.asarray(np.sqrt(total / max(rows, 1.0)))
