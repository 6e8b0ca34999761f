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
    """Return the features (T, N * 25) of measured poses R (T, N, 3, 3), p (T, N, 3); zeros where not valid.

    With twist (0, N, 6) the first 19 of them (T, N * 19).
    """
    T, N = p.shape[:2]
    width = FEATURES if len(twist) else POSED
    out = np.zeros((T, N * width))
    for t in range(T):
        for i in range(N):
            if not valid[t, i]:
                continue
            row = out[t, width * i : width * (i + 1)]
            row[0] = 1.0
            x, y, z = p[t, i]
            for a in range(3):
                u, v, w = R[t, i, 0, a], R[t, i, 1, a], R[t, i, 2, a]
                row[1 + 3 * a], row[2 + 3 * a], row[3 + 3 * a] = u, v, w
                # Row a of R^T [p]x.
                row[10 + 3 * a], row[11 + 3 * a], row[12 + 3 * a] = v * z - w * y, w * x - u * z, u * y - v * x
            for a in range(width - POSED):
                row[POSED + a] = twist[t, i, a]
    return out


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


def scatter(R: Array, p: Array, twist: Array, valid: Mask) -> Array:
    """Return the scatter (25 N, 25 N) of the features of all these rows; arguments as in `features`."""
    count = p.shape[1]
    width = FEATURES if len(twist) else POSED
    total = np.zeros((width * count, width * count))
    for start in range(0, len(p), AT_ONCE):
        rows = slice(start, start + AT_ONCE)
        F = features(R[rows], p[rows], twist[rows], valid[rows])
        total += F.T @ F
    if width == FEATURES:
        return total
    out = np.zeros((count, FEATURES, count, FEATURES))
    out[:, :POSED, :, :POSED] = total.reshape(count, POSED, count, POSED)
    return out.reshape(count * FEATURES, -1)


@numba.njit(cache=True, error_model="numpy")
def information(scatter: Array, P: Array, entries: Integers) -> Array:
    """Return what the rows of one pattern of robots say of all parameters (13 N, 13 N), the motion eliminated.

    scatter (25 N, 25 N) of the features    P (6 N, 6 N) weights of residuals less what any motion takes up, zero for
    robots that are not in the pattern    entries (E, 4) of K
    """
    N, E = len(P) // 6, len(entries)
    out, half, block = np.zeros((OWN * N, OWN * N)), np.empty((6, OWN, FEATURES)), np.empty((FEATURES, FEATURES))
    for i in range(N):
        for j in range(i + 1):
            for g in range(FEATURES):
                for f in range(FEATURES):
                    block[g, f] = scatter[FEATURES * j + g, FEATURES * i + f]
            half[:] = 0.0
            for q in range(E):
                b, n, line = entries[q, 0], entries[q, 1], block[entries[q, 2]]
                for a in range(6):
                    share = P[6 * i + a, 6 * j + b] * entries[q, 3]
                    for f in range(FEATURES):
                        half[a, n, f] += share * line[f]
            for r in range(E):
                a, m, f = entries[r, 0], OWN * i + entries[r, 1], entries[r, 2]
                for n in range(OWN):
                    out[m, OWN * j + n] += entries[r, 3] * half[a, n, f]
            if i != j:
                for m in range(OWN):
                    for n in range(OWN):
                        out[OWN * j + n, OWN * i + m] = out[OWN * i + m, OWN * j + n]
    return out
