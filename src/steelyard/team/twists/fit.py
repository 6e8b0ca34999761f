"""Joint maximum likelihood over all grasps from the scatter of twists, for bases that move.

    y_i(t) = Ad(G_i^-1) V(t) + n_i,   n_i ~ N(0, W_i^-1),
V the payload's twist in the reference grasp. With J the stack of Ad(G_i^-1), V is eliminated: the likelihood is
tr(P S), P = W - W J (J^T W J)^-1 J^T W. A step d_i of grasp i in its own axes moves its predicted twist by ad(y_i) d_i,
linear in y, so that gradient and information of a Gauss-Newton step come from S exactly.
Source: own; Lynch and Park for ad.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numba
import numpy as np

from steelyard.check import Array, Integers, Mask
from steelyard.spatial import Pose
from steelyard.team.adjoint import BRACKETS, adjoint_inverse, exp
from steelyard.team.poses.covariance import Spread
from steelyard.team.poses.fit import EXACT
from steelyard.team.poses.noise import noise_of_scatter
from steelyard.team.poses.solver import SHOWN
from steelyard.team.twists.statistic import TwistScatter, first_grasps

STEPS = 25


# ad(y)[c, a] = AD[c, a, k] y_k.
AD = np.ascontiguousarray(np.moveaxis(BRACKETS, 0, 2))
# Where its entries are that are not zero, and what they are.
PLACES, SIGNS = np.argwhere(AD != 0).astype(np.int64), AD[AD != 0]


@dataclass(frozen=True, eq=False)
class TwistFit:
    """The optimum: grasps (N,), noise (N, 2) [rad/s, m/s], spread, and delays (N,) [s] with covariance (N, N) [s^2].

    Delays are against the reference's clock.
    left  how long the last step was, in standard deviations: next to nothing unless STEPS were too few
    """

    grasps: Pose
    noise: Array
    spread: Spread
    delays: Array
    delay_covariance: Array
    left: float

    def punctual(self, least: float, stds: float) -> bool:
        """Return whether all clocks are within `least` [s] or `stds` standard deviations of their mean.

        Of the mean, since of the reference the answer would depend on who that is.
        """
        centred = np.eye(len(self.delays)) - 1 / len(self.delays)
        std = np.sqrt(np.maximum(np.diag(centred @ self.delay_covariance @ centred), 0))
        return bool((np.abs(centred @ self.delays) < np.maximum(least, stds * std)).all())


def fit_twists(data: TwistScatter, reference: int, names: tuple[str, ...], level: Array | None = None) -> TwistFit:
    """Return the joint optimum. Raises CannotAnswer where two robots never spoke together.

    level  (N, 3, 3) sums of the direction of gravity in the reference grasp times that in each, zero where not told:
           it decides where to start about axes that no turn shows
    """
    merged = data.merged()
    grasps = first_grasps(merged, reference, names, level)
    unknown = np.concatenate([6 * i + np.arange(6) for i in range(data.count) if i != reference])
    noise = noise_of_scatter(*_full(merged), adjoint_inverse(grasps), np.full((data.count, 2), 1e-2))
    for _ in range(STEPS):
        new = noise_of_scatter(*_full(merged), adjoint_inverse(grasps), noise)
        quiet = np.abs(np.log(new / noise)).max() < EXACT.noise
        noise = new
        H, g, floor = _normal(merged, grasps, noise)
        inverse, lost = _shown(H, floor, unknown)
        step = inverse @ g[unknown]
        gained = max(float(step @ g[unknown]), 0.0)
        if quiet and gained < EXACT.chi2:
            break
        full = np.zeros(6 * data.count)
        full[unknown] = step
        grasps = grasps @ exp(full.reshape(-1, 6))
    factor = np.sqrt(_inflation(data, grasps, noise, H + floor, unknown))
    size = factor[(unknown % 6) // 3]
    covariance = inverse @ ((H + floor)[np.ix_(unknown, unknown)] * np.outer(size, size)) @ inverse
    spread = np.zeros((6 * data.count, 6 * data.count))
    spread[np.ix_(unknown, unknown)] = covariance
    blind = np.zeros((6 * data.count, lost.shape[1]))
    blind[unknown] = lost
    delays, doubt, white = _delays(merged, grasps, noise, reference)
    late = np.sqrt(np.maximum(np.diag(doubt), 0) * _late_inflation(data, grasps, noise, white))
    return TwistFit(grasps, noise, Spread(spread, blind, late, grasps), delays, doubt, float(np.sqrt(gained)))


def fused_twist(twist: Array, seen: Mask, grasps: Pose, noise: Array) -> tuple[Array, Array]:
    """Return the payload's twist (T, 6) in R from those of all grasps (T, N, 6), and its covariance for a full row."""
    J, W = adjoint_inverse(grasps), np.repeat(noise**-2.0, 3, axis=1)
    each = np.einsum("nka,nk,nkb->nab", J, W, J)
    info = np.einsum("tn,nab->tab", seen.astype(float), each) if not seen.all() else np.array([each.sum(0)])
    pull = np.einsum("nka,nk,tnk->ta", J, W, twist * seen[..., None])
    some: Mask = np.asarray(seen.any(1)) if len(info) > 1 else np.ones(1, np.bool_)
    inverse = np.linalg.inv(np.where(some[:, None, None], info, np.eye(6)))
    return np.einsum("tab,tb->ta", np.broadcast_to(inverse, (len(twist), 6, 6)), pull), np.linalg.inv(each.sum(0))


def _full(merged: TwistScatter) -> tuple[Array, float]:
    """Return the scatter of rows in which all spoke, or of the pattern with most rows, and how many those are."""
    best = int(np.argmax(merged.rows * merged.spoke.all(1)))
    size = 6 * merged.count
    return merged.scatter[best][:size, :size], float(merged.rows[best] if merged.spoke[best].all() else 0.0)


@dataclass(frozen=True, eq=False)
class _Split:
    """What of measured twists y (6 N) is the payload's, J c with c = A^-1 (W J)^T y, and what is left, W y - W J c.

    W  (6 N,) weights, zero for robots that did not speak     J, WJ  (6 N, 6)     inner  A^-1 (6, 6)
    """

    W: Array
    J: Array
    WJ: Array
    inner: Array

    @classmethod
    def of(cls, spoke: Array, grasps: Pose, noise: Array) -> _Split:
        W = (np.repeat(noise**-2.0, 3, axis=1) * spoke[:, None]).ravel()
        J = adjoint_inverse(grasps).reshape(-1, 6) * np.repeat(spoke, 6)[:, None]
        WJ = J * W[:, None]
        return cls(W, J, WJ, np.asarray(np.linalg.inv(WJ.T @ J), dtype=np.float64))

    @property
    def P(self) -> Array:
        """The weight (6 N, 6 N) of twists with the payload's eliminated."""
        return np.diag(self.W) - self.WJ @ self.inner @ self.WJ.T

    def scores(self, y: Array) -> Array:
        """Return sum ad(y_i)^T (P y)_i (6 N,) of twists with scatter y (6 N, 6 N)."""
        c = self.inner @ (self.WJ.T @ y)
        left, count = self.W[:, None] * y - self.WJ @ c, len(self.W) // 6
        # (P y) (J c)^T with c = A^-1 (W J)^T y: only the blocks of a grasp with itself.
        mixed = (left @ self.WJ @ self.inner).reshape(count, 6, 6) @ self.J.reshape(count, 6, 6).swapaxes(1, 2)
        return np.asarray(np.einsum("cak,nck->na", AD, mixed).ravel())


def _normal(merged: TwistScatter, grasps: Pose, noise: Array) -> tuple[Array, Array, Array]:
    """Return information, gradient of all steps (6 N), and what noise alone would add to the information."""
    size = 6 * merged.count
    H, g, floor = np.zeros((size, size)), np.zeros(size), np.zeros((size, size))
    for S, rows, spoke in zip(merged.scatter, merged.rows, merged.spoke, strict=True):
        split, y = _Split.of(spoke, grasps, noise), S[:size, :size]
        P, fitted = split.P, split.J @ split.inner
        payload = split.WJ.T @ y @ split.WJ
        H += contracted(P, fitted @ payload @ fitted.T, PLACES, SIGNS)
        floor += contracted(P, rows * (fitted @ split.J.T), PLACES, SIGNS)
        g += split.scores(y)
    return H - floor, g, floor


@numba.njit(cache=True)
def contracted(P: Array, S: Array, places: Integers, signs: Array) -> Array:
    """Return sum_t ad(y_i)^T P_ij ad(y_j) for y with scatter S (6 N, 6 N), from the entries of ad that are not zero."""
    count = len(P) // 6
    out = np.zeros_like(P)
    for i in range(count):
        for j in range(count):
            for m in range(len(signs)):
                c, a, k = places[m]
                for n in range(len(signs)):
                    d, b, e = places[n]
                    entry = P[6 * i + c, 6 * j + d] * S[6 * i + k, 6 * j + e]
                    out[6 * i + a, 6 * j + b] += signs[m] * signs[n] * entry
    return out


def _shown(H: Array, floor: Array, unknown: Array) -> tuple[Array, Array]:
    """Return the inverse and the lost directions of the unknown steps.

    A direction is lost where its information is less than SHOWN^2 times what noise alone seems to say of it.
    """
    H, floor = H[np.ix_(unknown, unknown)], floor[np.ix_(unknown, unknown)]
    try:
        np.linalg.cholesky(H - SHOWN**2 * floor)
        return np.asarray(np.linalg.inv(H)), np.zeros((len(unknown), 0))
    except np.linalg.LinAlgError:
        root = np.linalg.cholesky(floor + 1e-12 * np.diag(np.diag(floor) + 1e-300))
    back = np.linalg.inv(root)
    values, vectors = np.linalg.eigh(back @ H @ back.T)
    basis = back.T @ vectors
    shown = values > SHOWN**2
    return (basis[:, shown] / values[shown]) @ basis[:, shown].T, basis[:, ~shown]


def _inflation(data: TwistScatter, grasps: Pose, noise: Array, H: Array, unknown: Array) -> Array:
    """Return how much larger than for white noise the scores of whole windows scatter, for rotation and position."""
    size = 6 * data.count
    windows = _by_window(data, grasps, noise, lambda split, S: split.scores(S[:size, :size]))
    if len(windows) < 4:
        return np.ones(2)
    ratio = (windows**2).sum(0)[unknown] / np.maximum(np.diag(H)[unknown], 1e-300)
    kind = (unknown % 6) // 3
    return np.array([max(float(ratio[kind == k].mean()), 1.0) for k in range(2)])


def _by_window(data: TwistScatter, grasps: Pose, noise: Array, scores: Callable[[_Split, Array], Array]) -> Array:
    """Return the sums of scores over every window (B, P)."""
    each = [scores(_Split.of(s, grasps, noise), S) for S, s in zip(data.scatter, data.spoke, strict=True)]
    windows = np.zeros((int(data.window.max()) + 1, len(each[0])))
    np.add.at(windows, data.window, each)
    return windows


def _delays(merged: TwistScatter, grasps: Pose, noise: Array, reference: int) -> tuple[Array, Array, float]:
    """Return how late every clock is against the reference's (N,) [s], its covariance, and all clocks' information."""
    count = merged.count
    size = 6 * count
    H, g = np.zeros((count, count)), np.zeros(count)
    for S, spoke in zip(merged.scatter, merged.spoke, strict=True):
        split = _Split.of(spoke, grasps, noise)
        P, fitted = split.P, split.J @ split.inner
        rate = fitted @ (split.WJ.T @ S[size:, size:] @ split.WJ) @ fitted.T
        H += (P * rate).reshape(count, 6, count, 6).sum((1, 3))
        g += _late_scores(split, S)
    others = np.arange(count) != reference
    delays, covariance = np.zeros(count), np.zeros((count, count))
    inverse = np.linalg.pinv(H[np.ix_(others, others)], hermitian=True)
    delays[others], covariance[np.ix_(others, others)] = inverse @ g[others], inverse
    return delays, covariance, float(H.trace())


def _late_scores(split: _Split, S: Array) -> Array:
    """Return how much each clock (N,) wants to be later, from a scatter (12 N, 12 N) of twists and their slopes."""
    size = len(split.W)
    mixed = split.P @ (S[:size, size:] @ split.WJ)
    return np.asarray(-np.einsum("ak,ak->a", mixed, split.J @ split.inner).reshape(-1, 6).sum(1))


def _late_inflation(data: TwistScatter, grasps: Pose, noise: Array, white: float) -> float:
    """Return how much larger than for `white` noise the scores of the clocks scatter over windows."""
    windows = _by_window(data, grasps, noise, _late_scores)
    return max(float((windows**2).sum()) / max(white, 1e-300), 1.0) if len(windows) >= 4 else 1.0
