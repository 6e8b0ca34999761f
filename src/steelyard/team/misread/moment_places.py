"""Moments about another point than the grasp whose pose is logged, as of a sensor behind the tool.

Moments about a point s_i of robot i's grasp axes lack s_i x f_i. That is linear: three columns per six-axis wrist,
beside the ten parameters and the biases. What robots push against one another tells the places apart; a part that all
share looks like another centre of mass at rest, and shows in motion, where forces tell how the centre is accelerated.
Three ways are tried: the same place in all grasps, one robot's alone, and a place for each. The likeliest by evidence
is taken to the grasps, and the payload fitted anew, until no step is worth another. Then all is judged once more, by
the noise of that fit: what places leave unexplained had hidden them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array, Mask
from steelyard.errors import CannotAnswer
from steelyard.findings import Finding, about, quoted
from steelyard.spatial import cross_matrix
from steelyard.team.misread.forces import reread
from steelyard.team.payload.bias_models import Models, ladder_of
from steelyard.team.payload.doubt import moved_by
from steelyard.team.payload.fit import PayloadFit
from steelyard.team.payload.model import Group, Normal
from steelyard.team.payload.spectra import NO_LEVERS, SEEN, Spectra, regressors

# [m] how far such a place usually is.
USUAL_M = 0.1
# Evidence, as a logarithm, from which places are tried and from which they count.
ASKED, COUNTS = 0.0, 15.0
# They count from so far [m] and so many standard deviations: nearer, a grasp may be off by as much.
FAR_M, FAR_STD = 0.02, 5.0
# Bands count in which turns are so many times their noise: elsewhere it hides what all places share.
LOUD = 10.0
# Places are moved until a step is below this share of its standard deviation, at most so many times.
SETTLED, ROUNDS = 0.2, 8

Fitted = Callable[[tuple[Group, ...]], PayloadFit]


@dataclass(frozen=True, eq=False)
class MomentPlaces:
    """Places (N, 3) [m] in every grasp that its moments are about, with covariance (3 N, 3 N).

    ways      (3 N, U) in which they may differ from the grasps
    evidence  logarithm of how likely they are against none
    """

    metres: Array
    covariance: Array
    ways: Array
    evidence: float

    @property
    def sure(self) -> bool:
        """Whether moments are about other points beyond doubt, all places taken together."""
        flat, count = self.metres.ravel(), self.ways.shape[1]
        size = np.sqrt(flat @ np.linalg.pinv(self.covariance, rcond=1e-9, hermitian=True) @ flat)
        far = bool(np.abs(flat).max() > FAR_M and size > FAR_STD + np.sqrt(count - 1))
        return far and self.evidence > COUNTS

    def finding(self, names: Sequence[str]) -> Finding:
        """Return motion-mismatch with the places and whose they are."""
        std = np.sqrt(np.diag(self.covariance)).reshape(-1, 3)
        off = [i for i in range(len(names)) if std[i].any()]
        who = [off] if self.ways.shape[1] == 3 else [[i] for i in off]

        def where(some: Sequence[int]) -> str:
            place = ", ".join(f"{1e3 * x + 0.0:.0f}" for x in self.metres[some[0]])
            bar = about(1e3 * float(np.linalg.norm(std[some[0]])))
            return f"those of {quoted(names[i] for i in some)} about ({place}) ± {bar} mm"

        said = "; ".join(where(some) for some in who)
        return Finding(
            "motion-mismatch",
            f"Moments balance as if they were about other points than the grasps whose poses are logged: {said} in the "
            "axes of the grasp, as where a tool's tip is logged and its sensor sits behind it. They were taken so.",
            "Log the poses of the sensors, or give the streams of their wrenches a mount with that position.",
        )

    def taken(self, names: Sequence[str]) -> dict[str, Array]:
        """Return by robot what (6, 6) takes a wrench to the origin of its grasp."""
        maps = np.tile(np.eye(6), (len(names), 1, 1))
        maps[:, :3, 3:] = cross_matrix(self.metres)
        return {name: M for name, M, place in zip(names, maps, self.metres, strict=True) if place.any()}


def with_moments_at_grasps(
    groups: tuple[Group, ...], fit: PayloadFit, fitted: Fitted, D: Array, C: Array, six_axis: Mask
) -> tuple[tuple[Group, ...], PayloadFit, MomentPlaces | None]:
    """Return groups and their fit with moments taken to the grasps; None where they are about these as they are.

    D, C  as of `fit_payload`     six_axis  (N,) whose moments are measured
    """
    own = np.eye(3 * len(six_axis))[:, np.repeat(six_axis, 3)]
    alone = own.reshape(len(own), -1, 3).swapaxes(0, 1)
    if not len(alone):
        return groups, fit, None
    nowhere, single = np.zeros((len(six_axis), 3)), list(alone) if len(alone) == 1 else [alone.sum(0), *alone]
    found = _likeliest(fit, D, C, single, nowhere)
    if found.evidence < ASKED:
        return groups, fit, None
    # Places for each, which cost as much as all other ways, are tried only where one of these is of use already.
    found = max(found, _likeliest(fit, D, C, [own], nowhere), key=lambda one: one.evidence)
    read, better = groups, fit
    for _ in range(ROUNDS):
        read = _at_grasps(groups, found)
        try:
            better = fitted(read)
        except CannotAnswer:
            return groups, fit, None
        step = _likeliest(better, D, C, [found.ways], found.metres)
        found = replace(step, metres=found.metres + step.metres)
        if (np.abs(step.metres.ravel()) <= SETTLED * np.sqrt(np.diag(step.covariance))).all():
            break
    given = tuple(replace(new, parts=old.parts) for new, old in zip(better.groups, groups, strict=True))
    judged = _likeliest(replace(better, groups=given), D, C, [found.ways], np.zeros_like(found.metres))
    found = replace(found, evidence=judged.evidence)
    if not found.sure:
        return groups, fit, None
    moved = moved_by(better, _levers(D))
    return read, replace(better, covariance=better.covariance + moved @ found.covariance @ moved.T), found


def _at_grasps(groups: tuple[Group, ...], places: MomentPlaces) -> tuple[Group, ...]:
    numbers = [str(robot) for robot in range(len(places.metres))]
    for robot, wrench in places.taken(numbers).items():
        groups = reread(groups, int(robot), wrench)
    return groups


def _likeliest(fit: PayloadFit, D: Array, C: Array, tried: Sequence[Array], at: Array) -> MomentPlaces:
    """Return by how much places differ from `at` (N, 3), to which moments were taken, in the likeliest way (3 N, U)."""
    plain, wide = _equations(fit, D)
    # Beside places a bias that lasts is one of every recording.
    ladder = ladder_of(1, False)
    none = Models.of(plain, C, ladder, fit.scale)
    models = [
        Models.of(_along(wide, ways, at), C, ladder, np.concatenate([fit.scale, np.full(ways.shape[1], USUAL_M)]))
        for ways in tried
    ]
    best, ways = max(zip(models, tried, strict=True), key=lambda one: one[0].evidence)
    mean = best.mean()
    covariance = ways @ best.covariance_about(mean)[10:, 10:] @ ways.T
    return MomentPlaces((ways @ mean[10:]).reshape(-1, 3), covariance, ways, best.evidence - none.evidence)


def _along(wide: Sequence[Normal], ways: Array, at: Array) -> list[Normal]:
    """Return equations in [phi, u, bias] of those in [phi, places (3 N), bias], where places are ways u from `at`.

    u, whose ways are at right angles, is held to nought by what is usual, once for all recordings.
    """
    count = ways.shape[1]
    T = np.zeros((len(wide[0].H), 16 + count))
    T[:10, :10], T[10:-6, 10:-6], T[-6:, -6:] = np.eye(10), ways, np.eye(6)
    inner, u = T[:-6, :-6], np.arange(10, 10 + count)
    out = [replace(n, H=T.T @ n.H @ T, g=T.T @ n.g, noise=inner.T @ n.noise @ inner) for n in wide]
    out[0].H[u, u] += USUAL_M**-2.0
    out[0].g[u] -= ways.T @ at.ravel() / (ways**2).sum(0) * USUAL_M**-2.0
    return out


def _equations(fit: PayloadFit, D: Array) -> tuple[list[Normal], list[Normal]]:
    """Return the normal equations of every recording without places and with those of all robots, in loud bands."""
    plain, wide = list[Normal](), list[Normal]()
    for whole, weights in zip(fit.groups, fit.weights, strict=True):
        group, W = loud(whole, weights)
        each = group.normals(D, W)
        plain += each
        force = 6 / D.shape[1] * group.wrench_noise[:, 3:].mean(1)
        wide += [_with_columns(one, part, D, W, force) for one, part in zip(each, group.parts, strict=True)]
    return plain, wide


def _levers(D: Array) -> Array:
    """Return how the block (6, 6) that sums what a grasp pushes changes by a place of its moments, per metre and axis
    (N, 3, 6, 6).
    """
    blocks = D.reshape(6, -1, 1, 6).transpose(1, 2, 0, 3)
    return np.concatenate([np.zeros((blocks.shape[0], 3, 6, 3)), blocks[..., :3] @ cross_matrix(np.eye(3))], axis=3)


def loud(group: Group, W: Array) -> tuple[Group, Array]:
    """Return the group with its weights (K, 6, 6) in the slowest band and those in which turns are no noise."""
    rows = np.sum([part.rows for part in group.parts], axis=0)
    turned = np.sum([np.einsum("kii->k", part.scatter[:, :3, :3]) for part in group.parts], axis=0)
    loud = turned >= LOUD * rows * np.einsum("kii->k", group.motion_noise[:, :3, :3])
    loud[0] = True
    parts = tuple(replace(p, scatter=p.scatter[loud], room=p.room[loud], rows=p.rows[loud]) for p in group.parts)
    return Group(parts, group.motion_noise[loud], group.wrench_noise[loud], sighted=False), W[loud]


def _with_columns(normal: Normal, part: Spectra, D: Array, W: Array, force: Array) -> Normal:
    """Return the equations of a recording with columns of all places (3 N), before the bias.

    force  (K,) [N^2] noise of a force in every band, which is in the columns and in the sum: it would explain itself
    """
    S, T, forces = part.scatter, regressors(NO_LEVERS), np.arange(D.shape[1]).reshape(-1, 6)[:, 3:]
    levers = _levers(D)[..., 3:]
    robots, count = len(levers), 3 * len(levers)
    columns = np.zeros((robots, 3, 6, D.shape[1]))
    for column, lever, own in zip(columns, levers, forces, strict=True):
        column[..., own] = -lever
    flat, weighed = columns.reshape(count, -1), -(W[:, None, None] @ levers).reshape(len(W), robots, 18, 3)
    alone = (force * part.rows)[:, None, None] * np.eye(S.shape[2])
    seen, noisy = ((weighed @ some[:, 12 + forces]).sum(0).reshape(count, 6, -1) for some in (S, alone))
    pushed, noise_pushed = (some[..., 12:-1].reshape(count, -1) for some in (seen, noisy))
    across = seen[..., SEEN].reshape(count, -1) @ T.reshape(16, -1).T
    old, u = np.r_[:10, 10 + count : 16 + count], np.arange(10, 10 + count)
    H, g, noise = np.zeros((16 + count, 16 + count)), np.zeros(16 + count), np.zeros((10 + count, 10 + count))
    H[np.ix_(old, old)], g[old], noise[:10, :10] = normal.H, normal.g, normal.noise
    H[np.ix_(u, u)], H[np.ix_(u, old)], H[np.ix_(old, u)] = pushed @ flat.T, across, across.T
    g[u], noise[10:, 10:] = (pushed - noise_pushed) @ D.ravel(), noise_pushed @ flat.T
    return replace(normal, H=H, g=g, noise=noise)
