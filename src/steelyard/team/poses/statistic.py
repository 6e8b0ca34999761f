"""The statistic of measured poses from which the information of a joint fit comes.

Every entry of K_i(t) = [1, -Ad(T_i^-1), V_i], how residual i moves with grasp, home and delay of its robot, is one of
25 features of the measured row (a constant, the entries of R^T and of -R^T [p]x, the twist). Their scatter is gathered
once; the information at any grasps and weights follows from it without the rows.
"""

from __future__ import annotations

import numba
import numpy as np

from steelyard.check import Array
from steelyard.logs.log import Integers, Mask

OWN, FEATURES, POSED = 13, 25, 19
# Rows whose features are held at once: they stay near the processor until their scatter is taken.
AT_ONCE = 4096


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


def information(scatter: Array, J: Array, W: Array) -> Array:
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
