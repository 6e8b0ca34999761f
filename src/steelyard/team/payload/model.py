"""The wrench equation of a team with everything that is not the payload: force bias and gain of every recording.

Of recording r, at every row, D s - L(phi) x = b_r + noise: s what the robots say they push, D its sum at B, x the
motion. The bias b_r is that of every force axis, c ~ N(0, s_c^2) all session long and d_r ~ N(0, s_b^2) of the
recording, and the error of its gain ~ N(0, s_g^2), lasting or drawn anew, times the mean force on it. It is integrated
out, so that what it hides is not pretended. Constant biases sum to six numbers, since grasps do not move in the
payload. Gains are not fitted as factors of the measured force: noise would then explain itself.
Beside it what a motion and a body leave of sums over the robots' pushes, from sums of products, and which directions of
the parameters rows show, once biases and gains are integrated out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from steelyard.check import Array, Mask
from steelyard.inertia.regressor import motion_map
from steelyard.logs.recording import ROUNDED_GRAVITY
from steelyard.team.payload.gain_sight import GainSight, gain_columns, gain_sight, of_force
from steelyard.team.payload.spectra import NO_LEVERS, SEEN, Spectra, regressors

# Noise is never judged smaller than this share of what the payload weighs: no force sensor resolves it.
ROUNDING = 1e-6
# [kg] Units of a payload are those of no less than this.
LEAST_MASS = 1e-3
# What a body of this mass and size could be: a direction whose error is not below this share of it is lost.
SHOWN = 0.3
# Information below this share of the largest is rounding.
RANK = 1e-11


def weight(phi: Array) -> float:
    """Return roughly what a payload of parameters phi (P,) weighs [N], for thresholds."""
    return float(abs(phi[0]) * ROUNDED_GRAVITY)


def least_noise(phi: Array) -> float:
    """Return the variance [N^2] below which no force's noise is judged, for a payload of parameters phi (P,)."""
    return weight(ROUNDING * phi) ** 2


@dataclass(frozen=True, eq=False)
class Group:
    """Recordings of one kind with common bands, and the noise of each band in B's axes.

    motion_noise  (K, 6, 6) of angular acceleration and acceleration less gravity
    wrench_noise  (K, 6) of the summed moment and force, beyond what the motion's noise makes
    sighted       whether changes of forces are asked for gains: not where grasps are turned as nobody knows
    """

    parts: tuple[Spectra, ...]
    motion_noise: Array
    wrench_noise: Array
    sighted: bool = True

    def weights(self, phi: Array) -> Array:
        """Return the inverse (K, 6, 6) of the noise of a row of the wrench equation."""
        M = motion_map(phi)[:, :6]
        noise = M @ self.motion_noise @ M.T
        noise[:, range(6), range(6)] += self.wrench_noise
        return np.asarray(np.linalg.inv(noise))

    def normals(self, D: Array, W: Array, levers: Array = NO_LEVERS) -> list[Normal]:
        """Return the normal equations of every recording in [phi (10), u (U,), bias (6)]; D, W and levers as below."""
        return [_normal(part, D, W, self, levers) for part in self.parts]


@dataclass(frozen=True, eq=False)
class Normal:
    """Normal equations of one recording in P parameters, [phi (10), u (U,)], and its bias (6).

    H, g      of what was measured          noise  (P, P) what the motion's noise adds to H on average
    constant  the weighted square of the wrench     pulls  (6, 3 N) bias per gain of every force axis
    gains     what changes of the forces say of these gains, where that was asked
    """

    H: Array
    g: Array
    noise: Array
    constant: float
    pulls: Array
    gains: GainSight | None = None


def units_of_body(mass: float, size: float) -> Array:
    """Return units (10,) of a body's parameters: mass, mass times size, mass times size squared."""
    return np.repeat([mass, mass * size, mass * size**2], [1, 3, 6])


def unit_bias(D: Array, six_axis: Mask, size: float) -> Array:
    """Return C (6, 6): a unit bias on every force axis, and `size` [m] times that on moments of six-axis wrists."""
    _, forces = gain_columns(D)
    moment = np.repeat(six_axis, 6) & ~of_force(D.shape[1])
    moments = D[:, moment] * size
    out = forces @ forces.T + moments @ moments.T
    # Two grasps leave the moment about their line without bias; a thousandth keeps C regular.
    out[:3, :3] += 1e-6 * size**2 * np.eye(3)
    return np.asarray(out)


def _normal(part: Spectra, D: Array, W: Array, group: Group, levers: Array) -> Normal:
    """Return the normal equations of one recording from its scatter.

    D  (6, 6 N) sums the pushes at B     W  (K, 6, 6) weights     levers  (U, 6, Q) of biases that stand in the room
    """
    S, seen, T = part.scatter, part.seen(len(levers) > 0), regressors(levers)
    width, count = S.shape[2], len(T) - 6
    features = np.concatenate([seen[..., :12], seen[..., width - 1 :]], axis=2)
    WT = W[:, None] @ T
    H = (WT.reshape(len(W), -1, T.shape[2]) @ features).sum(0).reshape(len(T), -1) @ T.reshape(len(T), -1).T
    g = np.einsum("kpix,kxi->p", WT, seen[..., 12 : width - 1] @ D.T)
    constant = float(np.einsum("kij,kji->", W, D @ (S[:, 12:-1, 12:-1] @ D.T)))
    moved = WT[:, :count, :, :6].reshape(len(W), -1, 6) @ (part.rows[:, None, None] * group.motion_noise)
    noise = moved.sum(0).reshape(count, -1) @ T[:count, :, :6].reshape(count, -1).T
    force, unit = gain_columns(D)
    total = S.sum(0)
    mean = total[12 + force, -1] / max(float(total[-1, -1]), 1e-300)
    sight = gain_sight(part, D, W, group.wrench_noise, levers) if group.sighted else GainSight.none(len(force))
    return Normal(H, g, noise, constant, unit * mean, sight)


def residual_scatter(part: Spectra, D: Array, solution: Array, covariance: Array) -> Array:
    """Return the expected scatter (K, 6) of the noise given [phi, bias] (16,) with covariance: residual and doubt."""
    T = regressors(NO_LEVERS)
    K = np.zeros((6, part.judged.shape[1]))
    K[:, 12:-1] = D
    slope = np.tensordot(solution, T, axes=1)
    K[:, :12], K[:, -1] = -slope[:, :12], -slope[:, 12]
    out = np.einsum("kix,ix->ki", K @ part.judged, K)
    motion = part.judged[:, SEEN[:, None], SEEN]
    flat = T.transpose(1, 2, 0).reshape(-1, 16)
    doubt = (flat @ covariance @ flat.T).reshape(6, 13, 6, 13)
    return np.asarray(out + np.einsum("ixiy,kxy->ki", doubt, motion))


def scatter(groups: Sequence[Group]) -> Array:
    """Return the scatter of all recordings and bands."""
    return np.asarray(sum(part.scatter.sum(0) for group in groups for part in group.parts))


def centred(S: Array) -> Array:
    """Return a scatter with its constant left out."""
    return S - np.outer(S[-1], S[-1]) / max(float(S[-1, -1]), 1e-300)


def pseudoinverse(G: Array) -> Array:
    """Return the pseudoinverse of normal equations, which may not show everything."""
    values, axes = np.linalg.eigh(G)
    kept = values > 1e-9 * values[-1]
    return np.asarray((axes[:, kept] / values[kept]) @ axes[:, kept].T)


def left_of_pushes(K: Array, E: Array, S: Array) -> float:
    """Return what the motion and a constant leave of rows K (k, 6 N) of the pushes.

    E  (p, k, 12) is what parameters make of the motion, or (12, 12): any motion explains any row
    """
    S = centred(S)
    pushed = K @ S[12:-1, 12:-1] @ K.T
    seen = K @ S[12:-1, :12]
    if E.ndim == 2:
        return float(np.trace(pushed - seen @ pseudoinverse(S[:12, :12]) @ seen.T))
    G = np.einsum("pix,xy,qiy->pq", E, S[:12, :12], E, optimize=True)
    along = np.tensordot(E, seen, ([1, 2], [0, 1]))
    return float(np.trace(pushed) - along @ pseudoinverse(G) @ along)


class Shown(NamedTuple):
    """Directions (..., P, P), as columns, in units of what a body can be.

    values  (..., P) information about each, rising     told  (..., P) whether the rows show it
    """

    values: Array
    vectors: Array
    told: Mask

    @classmethod
    def of(cls, information: Array, noise: Array) -> Shown:
        """Return the directions of an information (..., P, P), less what noise in the motion adds to it (P, P).

        What noise in the motion alone would seem to say is known to no better than its own size.
        """
        values, vectors = np.linalg.eigh(information - noise)
        seeming = np.einsum("...pk,pq,...qk->...k", vectors, noise, vectors)
        told = (values > SHOWN**-2.0) & (values > RANK * values[..., -1:]) & (values > seeming)
        return cls(values, vectors, np.asarray(told))

    @property
    def inverse(self) -> Array:
        """The inverse information (..., P, P) in what is shown, zero in what is lost."""
        each = np.where(self.told, 1 / np.where(self.told, self.values, 1.0), 0.0)
        return np.asarray((self.vectors * each[..., None, :]) @ self.vectors.swapaxes(-1, -2))

    @property
    def lost(self) -> Array:
        """The directions (P, L) that are lost, of one information."""
        return self.vectors[:, ~self.told]

    @property
    def condition(self) -> float:
        """The condition number in what is shown, of one information; infinite where nothing is."""
        return float(np.sqrt(self.values[-1] / self.values[self.told][0])) if self.told.any() else np.inf
