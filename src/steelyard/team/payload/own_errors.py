"""One robot whose forces are too large or too small, or turned against its grasp, told from all the others'.

A gain of one robot's own, or a turn of its sensor, is a column or three beside the ten parameters and the biases: it
makes another body of the payload, but for what robots push against one another and for how loads move from robot to
robot as the payload turns. Each robot's gain, each one's turn, and a gain for every robot are weighed by evidence
against none of them. Where one counts, the wrench is taken for what it was and the payload fitted anew; how far answers
differ that are likely, too, is in the bars. So it is with two robots, either of which may be the wrong one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import null_space

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.findings import Finding, quoted, with_bar
from steelyard.spatial import Rotation, cross_matrix
from steelyard.team.misread.forces import reread
from steelyard.team.payload.bias_models import Models, ladder_of, shares
from steelyard.team.payload.doubt import moved_by
from steelyard.team.payload.fit import PayloadFit
from steelyard.team.payload.model import Group, Normal
from steelyard.team.payload.wrench_columns import along, equations, evidence_of_each

# How far gains [1], and turns [rad], are usually off where they are.
USUAL = 0.1
# That nothing errs is beforehand so many times as likely as that a gain does, or a turn.
NOTHING = 100.0
# Evidence, as a logarithm, from which errors are looked into. They count where none has less than this share.
ASKED, DOUBTED = -3.0, 0.1
# And from so much on: grasps err by as much as the smaller turns.
LEAST = (0.01, *3 * [float(np.deg2rad(2.0))])
# Errors are taken out until a step is below this share of its standard deviation, at most so many times; a way that is
# then likelier is tried in its turn, so many in all.
SETTLED, ROUNDS, TRIES = 0.2, 6, 3
COLUMNS = 4  # of a robot: gain, turn about x, y, z

Fitted = Callable[[tuple[Group, ...]], PayloadFit]


@dataclass(frozen=True, eq=False)
class OwnErrors:
    """Gain and turn (N, 4) [1, rad] that take every robot's wrench for what it was, with covariance (4 N, 4 N).

    suspects  (H,) how likely each robot's gain alone is the one that errs, then each one's turn, then all gains
    off       (10,) what all that is likely makes of the parameters on average, and `more` (10, 10) of their covariance
    """

    size: Array
    covariance: Array
    suspects: Array
    off: Array
    more: Array

    def taken_beside(self, read: Mapping[str, Array], names: Sequence[str]) -> dict[str, Array]:
        """Return by name the maps of `read`, what wrenches were taken for already, and these after them."""
        own = {names[i]: M @ read.get(names[i], np.eye(6)) for i, M in _maps(self.size).items()}
        return {**read, **own}

    def allowed(self, fit: PayloadFit) -> PayloadFit:
        """Return the fit with what errors that are likely do to it in its parameters and its bars."""
        return replace(fit, parameters=fit.parameters + self.off, covariance=fit.covariance + self.more)

    def finding(self, names: Sequence[str]) -> Finding:
        """Return what was taken out: sensor-turned, or common-gain-unseen with whose gains."""
        who = [int(i) for i in np.flatnonzero(self.size.any(1))]
        if self.size[:, 1:].any():
            name, angle = names[who[0]], np.degrees(np.linalg.norm(self.size[who[0], 1:]))
            return Finding(
                "sensor-turned",
                f"What '{name}' pushes fits the others and one body only turned by about {angle:.2g} degrees "
                "against its grasp. It was taken so.",
                f"Check mount and frame of the wrench of '{name}' against the pose that it logs.",
            )
        std = np.sqrt(np.diag(self.covariance)).reshape(-1, COLUMNS)[:, 0]
        reads = 100 / (1 + self.size[:, 0]) - 100
        sizes = ", ".join(
            f"'{names[i]}' {with_bar(abs(reads[i]), 100 * std[i])} % too {'much' if reads[i] > 0 else 'little'}"
            for i in who
        )
        others = [name for i, name in enumerate(names) if self.suspects[i] > DOUBTED and i not in who]
        doubt = f", or as if {quoted(others, ' or ')} erred instead" if others else ""
        return Finding(
            "common-gain-unseen",
            f"Forces fit one another and one body as if they told: {sizes}{doubt}. They were taken so. An error that "
            "all robots share would look like mass, and the error bars do not hold it.",
            "Check unit and calibration of these forces, and weigh a known mass once.",
        )


def with_own_errors(
    groups: tuple[Group, ...], fit: PayloadFit, fitted: Fitted, D: Array, C: Array
) -> tuple[tuple[Group, ...], PayloadFit, OwnErrors | None]:
    """Return groups and their fit with wrenches taken for what they were, and what errs; None where nothing does.

    D, C  as of `fit_payload`
    """
    nothing, ways, number = np.zeros((D.shape[1] // 6, COLUMNS)), _ways(D.shape[1] // 6), -1
    if _most(fit, D, C, ways) < ASKED:
        return groups, fit, None
    evidence, means, _ = _tried(fit, D, C, ways, nothing)
    for _ in range(TRIES):
        if number == (likeliest := int(np.argmax(evidence))):
            break
        number = likeliest
        try:
            read, better, size, covariance = _taken_out(groups, fitted, D, C, ways[number], means[number][10:])
        except CannotAnswer:
            return groups, fit, None
        # By the noise that is left: what errors leave unexplained had hidden them.
        given = tuple(replace(new, parts=old.parts) for new, old in zip(better.groups, groups, strict=True))
        evidence, means, _ = _tried(replace(better, groups=given), D, C, ways, nothing)
    share = shares(np.append(evidence, 0.0))
    if share[-1] > DOUBTED or (np.abs(size).max(0) <= LEAST).all():
        return groups, fit, None
    moved, phi = moved_by(better, _levers(D, 6)), better.parameters
    error = moved @ covariance @ moved.T
    if number == len(ways) - 1:
        # Gains that differ: what all have in common is as large as they are, over the root of their number.
        error += (size[:, 0] ** 2).sum() / (len(size) * (len(size) - 1)) * np.outer(phi, phi)
    others = np.array([*(one[:10] - means[number][:10] for one in means), fit.parameters - phi])
    off = share @ others
    more = (1 - share[-1]) * error + (share * others.T) @ others - np.outer(off, off)
    return read, better, OwnErrors(size, covariance, share[:-1], off, more)


def _taken_out(
    groups: tuple[Group, ...], fitted: Fitted, D: Array, C: Array, way: Array, step: Array
) -> tuple[tuple[Group, ...], PayloadFit, Array, Array]:
    """Return groups with errors in one way (4 N, U) taken out, of which `step` (U,) is the first, their fit, and the
    errors (N, 4) with covariance (4 N, 4 N).

    Raises CannotAnswer where nothing is left to be fitted.
    """
    u = np.zeros_like(step)
    for _ in range(ROUNDS):
        u = u + step
        size = (way @ u).reshape(-1, COLUMNS)
        read = groups
        for robot, wrench in _maps(size).items():
            read = reread(read, robot, wrench)
        better = fitted(read)
        _, (mean,), spread = _tried(better, D, C, [way], size)
        step = mean[10:]
        if (np.abs(step) <= SETTLED * np.sqrt(np.diag(spread))).all():
            break
    return read, better, size, way @ spread @ way.T


def _maps(size: Array) -> dict[int, Array]:
    """Return by robot that errs what (6, 6) takes its wrench for what it was."""
    each = (1 + size[:, :1, None]) * Rotation.exp(size[:, 1:]).matrix
    return {int(i): np.kron(np.eye(2), each[i]) for i in np.flatnonzero(size.any(1))}


def _ways(robots: int) -> list[Array]:
    """Return the ways (4 N, U) in which robots may err: each one's gain, each one's turn, gains that differ.

    What differs has no part that all share, which is mass.
    """
    own = np.eye(COLUMNS * robots).reshape(-1, robots, COLUMNS)
    gains, turns = own[..., 0], own[..., 1:]
    apart = gains @ null_space(np.ones((1, robots)))
    return [*(gains[:, i : i + 1] for i in range(robots)), *(turns[:, i] for i in range(robots)), apart]


def _most(fit: PayloadFit, D: Array, C: Array, ways: Sequence[Array]) -> float:
    """Return the largest evidence that `_tried` has of any of the ways (4 N, U), of each robot's for all at once."""
    plain, wide = equations(fit, D, _levers(D, 3))
    each = np.arange(len(ways[0])).reshape(-1, COLUMNS)
    own = [evidence_of_each(wide, C, fit.scale, chosen, USUAL).max() for chosen in (each[:, :1], each[:, 1:])]
    (last,), _ = _weighed(plain, wide, C, fit.scale, ways[-1:], np.zeros(each.shape))
    return float(max(max(own) - np.log(len(each)), last) - np.log(NOTHING))


def _tried(fit: PayloadFit, D: Array, C: Array, ways: Sequence[Array], at: Array) -> tuple[Array, list[Array], Array]:
    """Return the evidence (H,) against none of errors in ways (4 N, U), beside those `at` (N, 4) that were taken out,
    what each makes of [phi, u], and the covariance of u by the last.
    """
    plain, wide = equations(fit, D, _levers(D, 3))
    evidence, models = _weighed(plain, wide, C, fit.scale, ways, at)
    # One robot of all, or all: kinds of error are alike beforehand.
    against = np.log(NOTHING) + np.log(np.where(np.arange(len(ways)) < len(ways) - 1, len(at), 1))
    means = [one.mean() for one in models]
    return evidence - against, means, models[-1].covariance_about(means[-1])[10:, 10:]


def _weighed(
    plain: Sequence[Normal], wide: Sequence[Normal], C: Array, scale: Array, ways: Sequence[Array], at: Array
) -> tuple[Array, list[Models]]:
    """Return the evidence (H,) of each way against none, by nothing but the rows, and its answers."""
    ladder = ladder_of(1, False)
    models = [
        Models.of(along(wide, way, at, USUAL), C, ladder, np.r_[scale, np.full(way.shape[1], USUAL)]) for way in ways
    ]
    return np.array([one.evidence for one in models]) - Models.of(plain, C, ladder, scale).evidence, models


def _levers(D: Array, axes: int) -> Array:
    """Return what a gain and a turn make of the block that sums what a robot pushes (N, 4, 6, axes), 3 of its force."""
    blocks = D.reshape(6, -1, 1, 6).transpose(1, 2, 0, 3)
    maps = np.zeros((COLUMNS, 6, 6))
    maps[0] = np.eye(6)
    maps[1:, :3, :3] = maps[1:, 3:, 3:] = cross_matrix(np.eye(3))
    return np.asarray((blocks @ maps)[..., 6 - axes :])
