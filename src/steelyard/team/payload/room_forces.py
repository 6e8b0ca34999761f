"""A force that keeps its direction in the room: a bias that a robot measures below its gimbal, a cable's steady pull.

Springs of a Delta, and sensors under a gimbal, err by a force that is constant in the robot's home, not in its grasp;
so does a controller that takes away what it believes its arm bears, and a cable pulls the payload so. Robot i errs by
beta_i ~ N(0, b^2) along the axes e_k of the room, which are c_k(t) in B and turn as the payload does:

    sum_i [p_i x c_k; c_k] beta_ik = sum_j u_jk [q_j x c_k; s_j c_k]

with [s_j; q_j] (4,) the directions that the columns [1; p_i] span, and [0; l] beside where wrists measure moments: the
weight that is taken away may lie off the grasp. So u is up to twelve numbers (four where only up is known). What points
up is weight without inertia: still poses cannot tell it from mass, motion can. The u are fitted beside the ten
parameters; how large b is, and whether there is any, is averaged by evidence.

Accelerations may be off by a share e ~ N(0, t^2), of filters and grasps that give way: phi is then 1 + e times what the
payload is, beside a force of e times its weight, and u has that much more room along the weight. Without any bias, too:
what acceleration says of the mass against the weight is believed to t and no more.
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
# Those that are asked first, the share from which the others are, and that from which such a force counts.
ASKED = SIZES[1::2]
LIKELY, COUNTS = 0.05, 0.2
# u is told in so many times its size: what is known of it beforehand is then no direction that is lost.
UNIT = 4.0
# By what share accelerations may be off.
OF_ACCELERATION = 0.02
# [m] how far off a six-axis wrist the weight lies that is taken away.
OFF = 0.2
# From this share of none at all on it is not said that there is one.
DOUBTED = 0.5
# Gains with less than this share are not tried beside such a bias.
UNLIKELY = 1e-5
# A direction that the grasps span to less than this share of the longest is rounding.
SPANNED = 1e-6


@dataclass(frozen=True, eq=False)
class _Pulled:
    """Models beside forces in the room whose variances beforehand are `variance` (U,) [N^2].

    error  how much of the first of u errors of acceleration make, beforehand
    """

    models: Models
    variance: Array
    error: float

    @property
    def chance(self) -> float:
        """Logarithm of the evidence."""
        return self.models.evidence + len(self.variance) * float(np.log(UNIT))

    def told(self) -> tuple[Array, Array]:
        """Return the ten parameters and their covariance, with errors of acceleration taken out."""
        mean = self.models.mean()
        share = self.error**2 / self.variance[0]
        along = OF_ACCELERATION * share / self.error
        taken = np.eye(10, len(mean))
        taken[:, 10] = -along * mean[:10]
        left = OF_ACCELERATION**2 * (1 - share)
        covariance = taken @ self.models.covariance_about(mean) @ taken.T + left * np.outer(mean[:10], mean[:10])
        return taken @ mean, covariance


@dataclass(frozen=True, eq=False)
class _Tried:
    """Models without such a bias and at each of `sizes` (S,) [N], with the share (1 + S,) of each by evidence."""

    models: list[_Pulled]
    share: Array
    sizes: Array

    @property
    def some(self) -> float:
        """How likely there is such a force."""
        return float(self.share[1:].sum())

    @property
    def size(self) -> float:
        """Rms size [N] of the bias, by evidence; zero where that leaves a share for none."""
        return float(np.sqrt(self.share[1:] @ self.sizes**2)) if self.share[0] < DOUBTED else 0.0

    def averaged(self, fit: PayloadFit, levers: Array) -> PayloadFit:
        """Return the fit averaged over sizes by their share; what follows from the rows is that of the likeliest."""
        # Without any, the fit as it is: errors of acceleration are for telling such a bias from weight.
        told = [(fit.parameters, fit.covariance / fit.unsure), *(one.told() for one in self.models[1:])]
        phi = self.share @ [mean for mean, _ in told]
        covariance = np.zeros((10, 10))
        for share, (mean, own) in zip(self.share, told, strict=True):
            covariance += share * (own + np.outer(mean - phi, mean - phi))
        models = [one.models for one in self.models]
        gain = self.share @ [one.gain**2 for one in models]
        anew, lasting = (
            np.tensordot(self.share, each, 1) for each in zip(*(one.gain_squares for one in models), strict=True)
        )
        fit = replace(
            fit,
            parameters=phi,
            covariance=covariance * fit.unsure,
            gain=float(np.sqrt(gain)),
            gain_squares=(anew, lasting),
            gainless=float(self.share @ [one.gainless for one in models]),
        )
        number = int(np.argmax(self.share))
        return _beside(fit, models[number], levers) if number else fit


def _beside(fit: PayloadFit, likely: Models, levers: Array) -> PayloadFit:
    """Return the fit with what follows from the rows in these models."""
    beside = likely.recordings(likely.best)
    places = row_slices([group.parts for group in fit.groups])
    return replace(
        fit,
        information=likely.information[likely.best],
        biases=beside.biases,
        blind=tuple(tuple(beside.blind[own]) for own in places),
        levers=levers,
    )


def with_room_forces(
    fit: PayloadFit, D: Array, C: Array, places: Array, six_axis: Mask, with_gain: bool = True
) -> tuple[PayloadFit, float]:
    """Return the fit with biases that keep their direction in the room allowed for, and how large they are [N].

    That is zero where there may be none.

    places  (N, 3) [m] in B of the grasps     six_axis  (N,) whose moments are measured     D, C as in `fit_payload`

    Noise and its weights are kept: such a bias hardly changes within a recording.
    """
    off = OFF * six_axis.any()
    levers, weight = _weight_first(room_levers(places, fit.groups[0].parts[0].room.shape[1] // 3, off), _weight(fit))
    each, error = zip(fit.groups, fit.weights, strict=True), OF_ACCELERATION * weight
    wide = [one for group, weights in each for one in group.normals(D, weights, levers)]
    first = np.eye(1, len(levers))[0]

    def of(size: float, ladder: Array) -> _Pulled:
        variance = size**2 + error**2 * first if size else np.full(1, error**2)
        scale = np.concatenate([fit.scale, UNIT * np.sqrt(variance)])
        return _Pulled(Models.of(_held(wide, variance), C, ladder, scale), variance, error)

    def tried(ladder: Array, sizes: Array) -> _Tried:
        models = [of(size, ladder) for size in (0.0, *sizes)]
        chance = np.array([one.chance for one in models])
        chance[0] += np.log(NONE)
        return _Tried(models, shares(chance), sizes)

    # Without gains first, at a tenth of the cost: where no such bias shows, none does with them.
    if not with_gain or tried(ladder_of(len(wide), False), ASKED).some > LIKELY:
        ladder = ladder_of(len(wide), with_gain)
        likely = (of(0.0, ladder).models.share > UNLIKELY) | ~ladder[:, 2:].any(1)
        found = tried(ladder[likely], SIZES)
        if found.some > COUNTS:
            return found.averaged(fit, levers), found.size
    return fit, 0.0


def room_levers(places: Array, axes: int, off: float = 0.0) -> Array:
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


def _weight(fit: PayloadFit) -> Array:
    """Return the wrench (6, 3 axes) at B that what stands still in the room makes as the weight of the payload."""
    parts = [part for group in fit.groups for part in group.parts]
    rows = sum(float(part.scatter[:, -1, -1].sum()) for part in parts)
    # Accelerations come to nothing on average: what is left is gravity.
    pull = -sum(part.room[:, :, 3:6].sum(0) for part in parts) / rows
    pulls = np.einsum("kii->k", pull.reshape(-1, 3, 3))
    each = np.concatenate([cross_matrix(fit.parameters[1:4]), fit.parameters[0] * np.eye(3)])
    return np.concatenate([pull * each for pull in pulls], axis=1)


def _weight_first(levers: Array, weight: Array) -> tuple[Array, float]:
    """Return levers (U, 6, Q) turned so that the first makes what is like the weight (6, Q), and how much does."""
    flat = levers.reshape(len(levers), -1)
    along = np.linalg.lstsq(flat.T, weight.ravel(), rcond=None)[0]
    turn = np.linalg.qr(np.column_stack([along, np.eye(len(along))]))[0]
    size = max(float(np.linalg.norm(along)), 1e-9)
    turn[:, 0] = along / size  # whose sign is open
    return np.asarray((turn.T @ flat).reshape(levers.shape)), size


def _held(normals: Sequence[Normal], variance: Array) -> list[Normal]:
    """Return the equations of the first of u with variances (U,) [N^2] beforehand, once for all recordings."""
    count = len(variance)
    kept = np.r_[: 10 + count, len(normals[0].H) - 6 : len(normals[0].H)]
    out = [
        replace(n, H=n.H[np.ix_(kept, kept)], g=n.g[kept], noise=n.noise[: 10 + count, : 10 + count]) for n in normals
    ]
    held = np.arange(10, 10 + count)
    out[0].H[held, held] += 1 / variance
    return out
