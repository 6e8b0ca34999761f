"""A force that keeps its direction in the room: a bias that a robot measures below its gimbal, a cable's steady pull.

Springs of a Delta, and sensors under a gimbal, err by a force that is constant in the robot's home, not in its grasp;
so does a controller that takes away what it believes its arm bears, and a cable pulls the payload so. Robot i errs by
beta_i ~ N(0, b^2) along the axes e_k of the room, which are c_k(t) in B and turn as the payload does:

    sum_i [p_i x c_k; c_k] beta_ik = sum_j u_jk [q_j x c_k; s_j c_k]

with [s_j; q_j] (4,) the directions that the columns [1; p_i] span, and [0; l] beside where wrists measure moments: the
weight that is taken away may lie off the grasp. So u is up to twelve numbers (four where only up is known). What points
up is weight without inertia: still poses cannot tell it from mass, motion can. The u are fitted beside the ten
parameters; how large b is, and whether there is any, is averaged by evidence.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array, Mask
from steelyard.spatial import cross_matrix
from steelyard.team.payload.bias_models import Models, ladder_of, shares
from steelyard.team.payload.fit import PayloadFit
from steelyard.team.payload.model import Normal
from steelyard.team.stacked import row_slices

# [N] the sizes that are tried; none at all is beforehand so many times as likely as any of them.
SIZES = np.array([0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0])
NONE = 100.0
# Those that are asked first, and the share from which such a bias counts.
ASKED = SIZES[1::2]
COUNTS = 0.01
# u is told in so many times its size: what is known of it beforehand is then no direction that is lost.
UNIT = 4.0
# [m] how far off a six-axis wrist the weight lies that is taken away.
OFF = 0.2
# From this share of none at all on it is not said that there is one.
DOUBTED = 0.5
# Gains with less than this share are not tried beside such a bias.
UNLIKELY = 1e-5
# A direction that the grasps span to less than this share of the longest is rounding.
SPANNED = 1e-6


@dataclass(frozen=True, eq=False)
class _Tried:
    """Models without such a bias and at each of `sizes` (S,) [N], with the share (1 + S,) of each by evidence."""

    models: list[Models]
    share: Array
    sizes: Array

    @property
    def counts(self) -> bool:
        """Whether such a bias is likely enough to count."""
        return bool(self.share[1:].sum() > COUNTS)

    @property
    def size(self) -> float:
        """Rms size [N] of the bias, by evidence; zero where that leaves a share for none."""
        return float(np.sqrt(self.share[1:] @ self.sizes**2)) if self.share[0] < DOUBTED else 0.0

    def averaged(self, fit: PayloadFit, levers: Array) -> PayloadFit:
        """Return the fit averaged over sizes by their share; what follows from the rows is that of the likeliest."""
        means = [one.mean() for one in self.models]
        phi = self.share @ [mean[:10] for mean in means]
        covariance = np.zeros((10, 10))
        for share, mean, one in zip(self.share, means, self.models, strict=True):
            off = mean[:10] - phi
            covariance += share * (one.covariance_about(mean)[:10, :10] + np.outer(off, off))
        number = int(np.argmax(self.share))
        likely = self.models[number]
        beside = likely.recordings(likely.best)
        places = row_slices([group.parts for group in fit.groups])
        gain = self.share @ [one.gain**2 for one in self.models]
        anew, lasting = (
            np.tensordot(self.share, each, 1) for each in zip(*(one.gain_squares for one in self.models), strict=True)
        )
        return replace(
            fit,
            parameters=phi,
            covariance=covariance * fit.unsure,
            information=likely.information[likely.best],
            gain=float(np.sqrt(gain)),
            gain_squares=(anew, lasting),
            gainless=float(self.share @ [one.gainless for one in self.models]),
            biases=beside.biases,
            blind=tuple(tuple(beside.blind[own]) for own in places),
            levers=levers if number else fit.levers,
        )


def with_home_bias(
    fit: PayloadFit, D: Array, C: Array, places: Array, six_axis: Mask, with_gain: bool = True
) -> tuple[PayloadFit, float]:
    """Return the fit with biases that keep their direction in the room allowed for, and how large they are [N].

    That is zero where there may be none.

    places  (N, 3) [m] in B of the grasps     six_axis  (N,) whose moments are measured     D, C as in `fit_payload`

    Noise and its weights are kept: such a bias hardly changes within a recording.
    """
    levers = home_levers(places, fit.groups[0].parts[0].room.shape[1] // 3, OFF * six_axis.any())
    plain, each = fit.normals, zip(fit.groups, fit.weights, strict=True)
    wide = [one for group, weights in each for one in group.normals(D, weights, levers)]

    def of(size: float, ladder: Array) -> Models:
        scale = np.concatenate([fit.scale, np.full(len(levers), UNIT * size)])
        return Models.of(_held(wide, size), C, ladder, scale)

    def tried(ladder: Array, sizes: Array) -> _Tried:
        none = Models.of(plain, C, ladder, fit.scale)
        beside = [of(size, ladder) for size in sizes]
        chance = [one.evidence + len(levers) * np.log(UNIT) for one in beside]
        return _Tried([none, *beside], shares(np.array([none.evidence + np.log(NONE), *chance])), sizes)

    # Without gains first, at a tenth of the cost: where no such bias shows, none does with them.
    if not with_gain or tried(ladder_of(len(plain), False), ASKED).counts:
        ladder = ladder_of(len(plain), with_gain)
        likely = (Models.of(plain, C, ladder, fit.scale).share > UNLIKELY) | ~ladder[:, 2:].any(1)
        found = tried(ladder[likely], SIZES)
        if found.counts:
            return found.averaged(fit, levers), found.size
    return fit, 0.0


def home_levers(places: Array, axes: int, off: float = 0.0) -> Array:
    """Return the wrench E (U, 6, 3 axes) at B that each unit of u makes of what stands still in the room.

    places  (N, 3) [m] of the grasps in B     axes  how many of the room's axes are known: 3, or 1 where only up is
    off     [m] how far off a grasp a force may act
    """
    spread = np.concatenate([np.ones((1, len(places))), places.T])
    spread = np.concatenate([spread, off * np.eye(4)[:, 1:]], axis=1) if off else spread
    spans, length, _ = np.linalg.svd(spread, full_matrices=False)
    columns = (spans * length)[:, length > SPANNED * length[0]].T
    out = np.zeros((axes, len(columns), 6, axes, 3))
    for k in range(axes):
        out[k, :, :3, k] = cross_matrix(columns[:, 1:])
        out[k, :, 3:, k] = columns[:, :1, None] * np.eye(3)
    return out.reshape(-1, 6, 3 * axes)


def _held(normals: Sequence[Normal], size: float) -> list[Normal]:
    """Return the equations with u held to zero by `size` [N], once for all recordings."""
    H = normals[0].H.copy()
    held = np.arange(10, len(H) - 6)
    H[held, held] += size**-2.0
    return [replace(normals[0], H=H), *normals[1:]]
