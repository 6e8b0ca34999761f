"""Covariance of the grasps that holds for correlated noise.

Encoders and structures err slowly: neighbouring rows err alike, and information that counts every row as new is several
times too large. How much is measured on the scores themselves: the variance of their sums over windows much longer than
the correlation (overlapping batch means), against what white noise would give, pooled over parameters of one kind.
Source: sandwich H^-1 V H^-1 with V = F^1/2 H F^1/2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array
from steelyard.logs.autocorrelation import correlation_time
from steelyard.spatial import Pose, cross, cross_matrix
from steelyard.team.poses.fit import PoseFit
from steelyard.team.poses.recurring import recurring
from steelyard.team.poses.solver import OWN

# Which of rotation and position of grasp and home, and delay, each parameter of a robot is.
KIND = np.repeat(np.arange(5), [3, 3, 3, 3, 1])
# Windows are so many times the correlation length, and no longer than this share of the rows.
WINDOW, LONGEST = 8.0, 0.1
# Parts of a window.
WIDTH = 8


@dataclass(frozen=True, eq=False)
class Spread:
    """Covariance of all grasps and delays in each grasp's own axes.

    full      (6 N, 6 N) [rad, m]; zero for the reference
    blind     (6 N, L) directions that the motion does not show
    late      (N,) standard deviations of the delays [s], None where they were not estimated
    grasps    (N,) in R
    level     (N, 3) direction of gravity in each grasp's own axes over how well [rad] its base and the reference's
              agree on it, zero where they do not tell: it holds turns that the motion does not show
    recurring (2,) [rad, m] rms errors of poses that come back with the pose, None where none show
    """

    full: Array
    blind: Array
    late: Array | None
    grasps: Pose
    level: Array | None = None
    recurring: Array | None = None

    def with_lost(self, size: float) -> Spread:
        """Return the spread with directions that are not shown as unsure as a team of this size [m] can be."""
        if not self.blind.size:
            return self
        lost = self.unseen(size)
        return replace(self, full=self.full + lost @ lost.T)

    def unseen(self, size: float) -> Array:
        """Return the directions (6 N, L) that are not shown, as long as they may be in a team of this size [m]."""
        turn = np.arange(len(self.blind)) % 6 < 3
        largest = np.maximum(np.abs(self.blind[turn]).max(0), np.abs(self.blind[~turn]).max(0) / size)
        lost = np.asarray(self.blind / np.maximum(largest, 1e-300))
        if self.level is None:
            return lost
        turns = lost.reshape(len(self.level), 6, -1)[:, :3].swapaxes(1, 2)
        tips = cross(turns, np.broadcast_to(self.level[:, None], turns.shape)).swapaxes(1, 2).reshape(-1, lost.shape[1])
        return np.asarray(lost @ np.linalg.cholesky(np.linalg.inv(np.eye(len(tips.T)) + tips.T @ tips)))

    def turn(self, size: float) -> float:
        """Return the largest standard deviation [rad] of a grasp's rotation, for a team of this size [m]."""
        full = self.with_lost(size).full.reshape(-1, 6, len(self.full) // 6, 6)
        own = np.einsum("iaib->iab", full)[:, :3, :3]
        return float(np.sqrt(max(np.linalg.eigvalsh(own).max(), 0.0)))

    def of(self, robot: int) -> Array:
        """Return the covariance (6, 6) of one grasp, rotation and position in R's axes."""
        part, turn = slice(6 * robot, 6 * robot + 6), self._turn(robot)
        return np.asarray(turn @ self.full[part, part] @ turn.T)

    def lost(self, robot: int) -> Array:
        """Return directions (k, 6) of one grasp, in R's axes, that the motion does not show."""
        part = self.blind[6 * robot : 6 * robot + 6]
        if not part.size:
            return np.zeros((0, 6))
        u, s, _ = np.linalg.svd(self._turn(robot) @ part, full_matrices=False)
        return np.asarray(u[:, s > 1e-3 * max(s.max(), 1e-300)].T)

    def _turn(self, robot: int) -> Array:
        """Return what turns (6, 6) a grasp's own axes into those of R."""
        out = np.zeros((6, 6))
        out[:3, :3] = out[3:, 3:] = self.grasps.rotation.matrix[robot]
        return out

    def delays(self, names: Sequence[str]) -> dict[str, float]:
        """Return the standard deviation of each robot's delay [s]."""
        return {} if self.late is None else dict(zip(names, map(float, self.late), strict=True))


def grasp_covariance(fit: PoseFit) -> Spread:
    """Return the covariance of grasps and delays."""
    count, unknown = len(fit.team.delays), fit.unknown
    central = _central(fit)
    H = _turned(_turned(fit.known.information, central).T, central)
    factor = np.sqrt(_inflation(fit, np.diag(H), central))[KIND[unknown % OWN]]
    V = H[np.ix_(unknown, unknown)] * np.outer(factor, factor)
    again = recurring(fit)
    if again is not None:
        pulls = _turned(again.scores, central)[:, unknown]
        V = V + pulls.T @ pulls
    # Grasps and delays are the same whatever homes turn about.
    asked = np.flatnonzero((unknown % OWN < 6) | (unknown % OWN == OWN - 1))
    inverse = np.zeros((len(asked), OWN * count))
    inverse[:, unknown] = fit.solved.inverse[asked]
    for i in range(count):
        inverse[:, OWN * i + 9 : OWN * i + 12] -= inverse[:, OWN * i + 6 : OWN * i + 9] @ central[i].T
    inverse = inverse[:, unknown]
    covariance = inverse @ V @ inverse.T
    full, blind, late = np.zeros((6 * count, 6 * count)), np.zeros((6 * count, fit.solved.lost.shape[1])), None
    grasp, delay = (np.flatnonzero(which) for which in (unknown[asked] % OWN < 6, unknown[asked] % OWN == OWN - 1))
    place = 6 * (unknown[asked[grasp]] // OWN) + unknown[asked[grasp]] % OWN
    full[np.ix_(place, place)] = covariance[np.ix_(grasp, grasp)]
    blind[place] = fit.solved.lost[asked[grasp]]
    if len(delay):
        late = np.sqrt(np.maximum(variances_against(covariance[np.ix_(delay, delay)], fit.reference), 0))
    return Spread(full, blind, late, fit.grasps, recurring=None if again is None else again.size)


def variances_against(covariance: Array, reference: int) -> Array:
    """Return the variances (N,) of differences from one of them."""
    variance = np.diag(covariance)
    return np.asarray(variance + variance[reference] - 2 * covariance[reference])


def _central(fit: PoseFit) -> Array:
    """Return [c]x (N, 3, 3) of the middle of each grasp's places: homes that turn about it do not move grasps much."""
    seen = fit.rows.data.valid
    total = np.einsum("tn,tna->na", seen.astype(float), fit.rows.data.poses.position)
    return cross_matrix(total / np.maximum(seen.sum(0), 1)[:, None])


def _turned(rows: Array, central: Array) -> Array:
    """Return rows (..., 13 N) by parameters as rows by those with homes that turn about their grasp's middle."""
    out = np.array(rows, order="C")
    each = out.reshape(*rows.shape[:-1], -1, OWN)
    for a, b in ((a, b) for a in range(3) for b in range(3) if a != b):
        each[..., 6 + b] += each[..., 9 + a] * central[:, a, b]
    return out


def _inflation(fit: PoseFit, information: Array, central: Array) -> Array:
    """Return how many times larger than for white noise the variance of the scores is, per kind of parameter (5,)."""
    rows = len(fit.rows.apart)
    window = np.clip(WINDOW * correlation_time(fit.rows.apart, rows / 4), 10, max(int(LONGEST * rows), 2))
    part = max(1, int(window) // WIDTH)
    variance = sum_variance(_turned(fit.rows.pulls(fit.noise, part)[: rows // part], central))
    # Traces, which no turn of anybody's axes changes.
    seen, white = (
        np.array([x.reshape(-1, OWN)[:, k == KIND].sum() for k in range(5)]) for x in (variance, information)
    )
    return np.asarray(np.maximum(seen / np.maximum(white, 1e-300), 1.0))


def sum_variance(parts: Array) -> Array:
    """Return the variance (P,) of the sum of a correlated series, of which `parts` (B, P) are the sums in turn.

    By windows of WIDTH parts, which move by one.
    """
    sums = np.cumsum(np.concatenate([np.zeros((1, parts.shape[1])), parts - parts.mean(0)]), axis=0)
    width = min(WIDTH, max(1, len(sums) // 4))
    batches, share = sums[width:] - sums[:-width], width / len(parts)
    # Batches of a series whose mean was taken away scatter less than the series does.
    return np.asarray((batches**2).mean(0) / share / (1 - share))
