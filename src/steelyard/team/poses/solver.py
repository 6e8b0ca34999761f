"""Steps and covariance of a joint fit from its information, in the directions that the motion shows.

Homes and delays always follow the grasps and are eliminated first; what is then left for the grasps decides which of
their directions are shown.

The information comes from a statistic of the measured poses. Every entry of K_i(t) = [1, -Ad(T_i^-1), V_i], how
residual i moves with grasp, home and delay of its robot, is one of 25 features of the measured row (a constant, the
entries of R^T and of -R^T [p]x, the twist). Their scatter is gathered once; the information at any grasps and weights
follows from it without the rows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from scipy.linalg import eigh
from scipy.linalg.lapack import dpotri, dtrtri

from steelyard.check import Array, Integers, Mask

# A direction of a grasp is shown where the motion along it is so many times the noise of a single row: from noise
# alone, poses look as if they moved that much.
SHOWN = 5.0
# A pivot of the homes and delays, scaled to a diagonal of ones, that is smaller than this may be rounding.
PIVOT = 1e-6
# Eigenvalues below this share of the largest are taken for zero: rounding.
RANK = 1e-15
OWN, FEATURES, POSED = 13, 25, 19
# Rows whose features are held at once: they stay near the processor until their scatter is taken.
AT_ONCE = 4096


@dataclass(frozen=True, eq=False)
class Shown:
    """What the motion shows of the unknown parameters.

    inverse  (K, K) their covariance for white noise, zero along what is lost
    lost     (K, L) directions of theirs that the motion does not show, unit length in units of the noise
    """

    inverse: Array
    lost: Array


@dataclass(frozen=True, eq=False)
class Solver:
    """Steps from pulls on K parameters, of which G are of grasps.

    grasp    (K,) which they are
    root     (K - G, R) of the inverse information about homes and delays, which is root root^T
    carried  (G, R) the information that grasps share with them, times that root
    inner    (G, G) covariance of the grasps for white noise, zero along what is lost
    lost     (G, L) directions of theirs that are not shown
    """

    grasp: Mask
    root: Array
    carried: Array
    inner: Array
    lost: Array

    @classmethod
    def of(cls, H: Array, unknown: Integers, noise: Array, rows: int) -> Solver:
        """Return the solver of information H (K, K) about the parameters `unknown` (K,)."""
        grasp = unknown % OWN < 6
        root = _root(H[np.ix_(~grasp, ~grasp)])
        carried = H[np.ix_(grasp, ~grasp)] @ root
        left = H[np.ix_(grasp, grasp)] - carried @ carried.T
        scale = unit(unknown[grasp], noise, rows)
        inner, lost = _shown(left * np.outer(scale, scale))
        return cls(grasp, root, carried, inner * np.outer(scale, scale), scale[:, None] * lost)

    def step(self, pull: Array) -> Array:
        """Return the step (K,) for a pull."""
        rest, out = self.root.T @ pull[~self.grasp], np.empty_like(pull)
        out[self.grasp] = self.inner @ (pull[self.grasp] - self.carried @ rest)
        out[~self.grasp] = self.root @ (rest - self.carried.T @ out[self.grasp])
        return out

    def variance(self, chosen: Mask) -> Array:
        """Return the variances of chosen (K,) homes and delays for white noise."""
        root = self.root[chosen[~self.grasp]]
        along = root @ self.carried.T
        return np.asarray((root**2).sum(1) + ((along @ self.inner) * along).sum(1))

    def all_shown(self) -> Shown:
        """Return the covariance for white noise, and what is lost."""
        size = len(self.grasp)
        inverse, lost = np.empty((size, size)), np.zeros((size, self.lost.shape[1]))
        back = -(self.inner @ self.carried) @ self.root.T
        inverse[np.ix_(self.grasp, self.grasp)] = self.inner
        inverse[np.ix_(self.grasp, ~self.grasp)] = back
        inverse[np.ix_(~self.grasp, self.grasp)] = back.T
        inverse[np.ix_(~self.grasp, ~self.grasp)] = self.root @ (self.root.T - self.carried.T @ back)
        lost[self.grasp] = self.lost
        return Shown(inverse, lost)


def unit(grasp: Integers, noise: Array, rows: int) -> Array:
    """Return steps of the parameters `grasp` (G,) that all rows together tell by their noise (N, 2) alone."""
    turn, place = noise[grasp // OWN].T
    return np.asarray(1 / np.sqrt(np.where(grasp % OWN < 3, 2.0, (turn / place) ** 2) * rows))


def _root(H: Array) -> Array:
    """Return F with F F^T the inverse of H, or the pseudo-inverse where H is singular, as without any row of a robot.

    Cholesky where its pivots leave no doubt. Raises LinAlgError where H is no information, as of steps that diverged.
    """
    if not (np.diag(H) >= 0).all():
        raise np.linalg.LinAlgError("the information is negative: the fit has diverged")
    scale = 1 / np.sqrt(np.maximum(np.diag(H), 1e-300))
    try:
        factor = np.linalg.cholesky(H * np.outer(scale, scale))
    except np.linalg.LinAlgError:
        factor = np.zeros_like(H)
    if np.diag(factor).min(initial=1.0) > PIVOT:
        return np.asarray(scale[:, None] * dtrtri(factor.T, lower=0)[0])
    values, vectors = np.linalg.eigh(H)
    there = values > RANK * values[-1]
    return np.asarray(vectors[:, there] / np.sqrt(values[there]))


def _shown(left: Array) -> tuple[Array, Array]:
    """Return the inverse (G, G) of information in units of a row's noise, zero along what is lost, and that (G, L).

    What is lost is given the information of the others while the rest is inverted, and taken out again.
    """
    try:
        np.linalg.cholesky(left - SHOWN**2 * np.eye(len(left)))
        lost = np.zeros((len(left), 0))
        filled, share = left, 1.0
    except np.linalg.LinAlgError:
        values, lost = eigh(left, subset_by_value=(-np.inf, SHOWN**2), check_finite=False)
        share = max(float(np.trace(left)) / len(left), SHOWN**2)
        filled = left + (lost * (share - values)) @ lost.T
    half = dpotri(np.linalg.cholesky(filled), lower=1)[0]
    inverse = half + half.T
    inverse[np.diag_indices_from(inverse)] *= 0.5
    return np.asarray(inverse - lost @ lost.T / share), np.asarray(lost)


@numba.njit(cache=True, error_model="numpy")
def features(R: Array, p: Array, twist: Array, valid: Mask) -> Array:
    """Return the features (T, 25 N) of measured poses R (T, N, 3, 3), p (T, N, 3); zeros where not valid.

    One feature of all robots after the other; with twist (0, N, 6) the first 19 (T, 19 N).
    """
    T, N = p.shape[:2]
    timed = len(twist) > 0
    out = np.zeros((T, FEATURES if timed else POSED, N))
    for t in range(T):
        for i in range(N):
            if not valid[t, i]:
                continue
            out[t, 0, i] = 1.0
            x, y, z = p[t, i, 0], p[t, i, 1], p[t, i, 2]
            for a in range(3):
                u, v, w = R[t, i, 0, a], R[t, i, 1, a], R[t, i, 2, a]
                out[t, 1 + 3 * a, i], out[t, 2 + 3 * a, i], out[t, 3 + 3 * a, i] = u, v, w
                # Row a of R^T [p]x.
                out[t, 10 + 3 * a, i], out[t, 11 + 3 * a, i] = v * z - w * y, w * x - u * z
                out[t, 12 + 3 * a, i] = u * y - v * x
            if timed:
                for a in range(6):
                    out[t, POSED + a, i] = twist[t, i, a]
    return out.reshape(T, -1)


def _entries() -> Integers:
    """Return the entries (E, 4) of K (6, 13) that are not zero: row, column, which feature it is, sign."""
    which, sign = np.zeros((6, OWN), np.int64), np.zeros((6, OWN))
    for a in range(6):
        sign[a, a] = 1.0
        which[a, 12], sign[a, 12] = 19 + a, 1.0
        for m in range(3):
            if a < 3:
                which[a, 6 + m], sign[a, 6 + m] = 1 + 3 * a + m, -1.0
            else:
                which[a, 6 + m], sign[a, 6 + m] = 10 + 3 * (a - 3) + m, 1.0
                which[a, 9 + m], sign[a, 9 + m] = 1 + 3 * (a - 3) + m, -1.0
    row, column = np.nonzero(sign)
    return np.column_stack([row, column, which[row, column], sign[row, column]]).astype(np.int64)


ENTRIES = _entries()


def scatter(R: Array, p: Array, twist: Array, valid: Mask, share: Array | None = None) -> Array:
    """Return the scatter (25 N, 25 N) of the features of all these rows; arguments as in `features`.

    share  (T,) how much each row counts; None where all count as one
    """
    size = FEATURES * p.shape[1]
    seen = size if len(twist) else POSED * p.shape[1]
    if seen == size and len(p) <= AT_ONCE:
        F = features(R, p, twist, valid)
        return np.asarray(F.T @ F if share is None else F.T @ (share[:, None] * F))
    out = np.zeros((size, size))
    for start in range(0, len(p), AT_ONCE):
        rows = slice(start, start + AT_ONCE)
        F = features(R[rows], p[rows], twist[rows], valid[rows])
        out[:seen, :seen] += F.T @ (F if share is None else share[rows, None] * F)
    return out


def pattern_information(scatter: Array, J: Array, W: Array) -> Array:
    """Return what the rows of one pattern of robots say of all parameters (13 N, 13 N), the motion eliminated.

    scatter (25 N, 25 N) of the features    J (N, 6, 6) residuals per motion of the payload    W (N, 6) weights, zero
    for robots that are not in the pattern
    """
    count = len(W)
    stack, weight = J.swapaxes(0, 1).reshape(-1, 6), W.T.ravel()
    pushed = stack * weight[:, None]
    # Weights of residuals less what any motion takes up.
    P = -pushed @ np.linalg.inv(pushed.T @ stack) @ pushed.T
    P[np.diag_indices_from(P)] += weight
    out = _contracted(scatter.reshape(FEATURES, count, -1), P.reshape(6, count, -1), ENTRIES)
    return out.reshape(OWN, count, OWN, count).transpose(1, 0, 3, 2).reshape(OWN * count, -1)


@numba.njit(cache=True, error_model="numpy")
def _contracted(scatter: Array, P: Array, entries: Integers) -> Array:
    """Return sum_ab K_am P_ab K_bn (13, N, 13 N) from the scatter (25, N, 25 N) of what is in K; P (6, N, 6 N)."""
    N = P.shape[1]
    out = np.zeros((OWN, N, OWN * N))
    for i in range(N):
        for r in range(len(entries)):
            for q in range(len(entries)):
                sign = float(entries[r, 3] * entries[q, 3])
                total = out[entries[r, 1], i, entries[q, 1] * N : entries[q, 1] * N + N]
                share = P[entries[r, 0], i, entries[q, 0] * N : entries[q, 0] * N + N]
                line = scatter[entries[r, 2], i, entries[q, 2] * N : entries[q, 2] * N + N]
                for j in range(N):
                    total[j] += sign * share[j] * line[j]
    return out
