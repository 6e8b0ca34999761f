"""One compiled pass over the rows of a joint fit, and the statistic from which its information comes.

Every entry of K_i(t) = [1, -Ad(T_i^-1), V_i], how residual i moves with grasp, home and delay of its robot, is one of
25 features of the measured row (a constant, the entries of R^T and of -R^T [p]x, the twist). Their scatter is gathered
once; the information at any grasps and weights follows from it without the rows.
"""

from __future__ import annotations

import numba
import numpy as np

from steelyard.check import Array
from steelyard.logs.log import Integers, Mask

OWN, FEATURES = 13, 25


@numba.njit(cache=True)
def features(R: Array, p: Array, twist: Array, valid: Mask) -> Array:
    """Return the features (T, N * 25) of measured poses R (T, N, 3, 3), p (T, N, 3); zeros where not valid."""
    T, N = p.shape[:2]
    out = np.zeros((T, N * FEATURES))
    for t in range(T):
        for i in range(N):
            if not valid[t, i]:
                continue
            row = out[t, FEATURES * i : FEATURES * (i + 1)]
            row[0] = 1.0
            x, y, z = p[t, i]
            for a in range(3):
                u, v, w = R[t, i, 0, a], R[t, i, 1, a], R[t, i, 2, a]
                row[1 + 3 * a], row[2 + 3 * a], row[3 + 3 * a] = u, v, w
                # Row a of R^T [p]x.
                row[10 + 3 * a], row[11 + 3 * a], row[12 + 3 * a] = v * z - w * y, w * x - u * z, u * y - v * x
            row[19:25] = twist[t, i]
    return out


def _places() -> tuple[Integers, Array]:
    """Return which feature each entry of K (6, 13) is, and its sign (0 = the entry is zero)."""
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
    return which, sign


WHICH, SIGN = _places()


@numba.njit(cache=True)
def information(scatter: Array, J: Array, W: Array, valid: Mask, which: Integers, sign: Array) -> Array:
    """Return what the rows of one pattern of robots say of all parameters (13 N, 13 N), the motion eliminated.

    scatter (25 N, 25 N) of the features    J (N, 6, 6) residuals per motion of the payload    W (N, 6)    valid (N,)
    """
    N = len(W)
    A = np.zeros((6, 6))
    for i in range(N):
        if valid[i]:
            A += J[i].T @ (W[i].reshape(6, 1) * J[i])
    inverse = np.linalg.inv(A)
    out = np.zeros((OWN * N, OWN * N))
    for i in range(N):
        for j in range(i + 1):
            if not (valid[i] and valid[j]):
                continue
            P = -(W[i].reshape(6, 1) * (J[i] @ inverse @ J[j].T)) * W[j].reshape(1, 6)
            if i == j:
                for a in range(6):
                    P[a, a] += W[i, a]
            block = scatter[FEATURES * i : FEATURES * (i + 1), FEATURES * j : FEATURES * (j + 1)]
            for a in range(6):
                for m in range(OWN):
                    if sign[a, m] == 0.0:
                        continue
                    line = block[which[a, m]]
                    for n in range(OWN):
                        total = 0.0
                        for b in range(6):
                            if sign[b, n] != 0.0:
                                total += P[a, b] * sign[b, n] * line[which[b, n]]
                        out[OWN * i + m, OWN * j + n] += sign[a, m] * total
            if i != j:
                for m in range(OWN):
                    for n in range(OWN):
                        out[OWN * j + n, OWN * i + m] = out[OWN * i + m, OWN * j + n]
    return out


@numba.njit(cache=True)
def residuals(
    R: Array, p: Array, valid: Mask, RG: Array, pG: Array, RZ: Array, pZ: Array, RX: Array, pX: Array
) -> Array:
    """Return rotation vector and position (T, N, 6) from predicted to measured, in the axes of each predicted grasp."""
    T, N = p.shape[:2]
    out = np.zeros((T, N, 6))
    held, predicted, turn = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    place, left = np.empty(3), np.empty(3)
    for t in range(T):
        for i in range(N):
            if not valid[t, i]:
                continue
            _product(RX[t], RG[i], held)
            _product_t(RZ[i], held, predicted)
            _product_t(predicted, R[t, i], turn)
            for a in range(3):
                place[a] = pX[t, a] - pZ[i, a]
                for b in range(3):
                    place[a] += RX[t, a, b] * pG[i, b]
            for a in range(3):
                left[a] = p[t, i, a]
                for b in range(3):
                    left[a] -= RZ[i, b, a] * place[b]
            _log(turn, out[t, i])
            for a in range(3):
                for b in range(3):
                    out[t, i, 3 + a] += predicted[b, a] * left[b]
    return out


@numba.njit(cache=True)
def _product(A: Array, B: Array, out: Array) -> None:
    """Write A B (3, 3): at this size plain loops are much quicker than a call of BLAS."""
    for a in range(3):
        for b in range(3):
            out[a, b] = A[a, 0] * B[0, b] + A[a, 1] * B[1, b] + A[a, 2] * B[2, b]


@numba.njit(cache=True)
def _product_t(A: Array, B: Array, out: Array) -> None:
    """Write A^T B (3, 3)."""
    for a in range(3):
        for b in range(3):
            out[a, b] = A[0, a] * B[0, b] + A[1, a] * B[1, b] + A[2, a] * B[2, b]


@numba.njit(cache=True)
def _log(turn: Array, out: Array) -> None:
    """Write the rotation vector (3,) of a rotation that is not near half a turn."""
    x, y, z = turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]
    sine = 0.5 * np.sqrt(x * x + y * y + z * z)
    share = 0.5
    if sine > 1e-9:
        share = 0.5 * np.arctan2(sine, 0.5 * (turn[0, 0] + turn[1, 1] + turn[2, 2] - 1)) / sine
    out[0], out[1], out[2] = share * x, share * y, share * z


@numba.njit(cache=True)
def followed(
    residual: Array, valid: Mask, J: Array, W: Array, inverse: Array, pattern: Integers
) -> tuple[Array, Array]:
    """Return the motion (T, 6) that fits the residuals best, and W (e - J x) (T, N, 6): the weighted rest.

    inverse  (C, 6, 6) of the information about the motion, one per pattern of robots; pattern (T,)
    """
    T, N = residual.shape[:2]
    free, rest = np.zeros((T, 6)), np.zeros((T, N, 6))
    pull = np.zeros(6)
    for t in range(T):
        pull[:] = 0.0
        for i in range(N):
            for a in range(6):
                e = W[i, a] * residual[t, i, a]
                for k in range(6):
                    pull[k] += J[i, a, k] * e
        for a in range(6):
            for k in range(6):
                free[t, a] += inverse[pattern[t], a, k] * pull[k]
        for i in range(N):
            if not valid[t, i]:
                continue
            for a in range(6):
                left = residual[t, i, a]
                for k in range(6):
                    left -= J[i, a, k] * free[t, k]
                rest[t, i, a] = W[i, a] * left
    return free, rest


@numba.njit(cache=True)
def scores(rest: Array, F: Array, which: Integers, sign: Array) -> Array:
    """Return K^T W (e - J x) (T, 13 N): what every row adds to the pull on the parameters."""
    T, N = rest.shape[:2]
    out = np.zeros((T, OWN * N))
    for t in range(T):
        for i in range(N):
            for a in range(6):
                e = rest[t, i, a]
                if e == 0.0:
                    continue
                for m in range(OWN):
                    if sign[a, m] != 0.0:
                        out[t, OWN * i + m] += sign[a, m] * F[t, FEATURES * i + which[a, m]] * e
    return out


@numba.njit(cache=True)
def moved_by(step: Array, F: Array, J: Array, W: Array, inverse: Array, pattern: Integers, valid: Mask,
             which: Integers, sign: Array) -> Array:  # fmt: skip
    """Return how much less (T, 6) the motion moves when the parameters take a step (13 N,)."""
    T, N = valid.shape
    out = np.zeros((T, 6))
    moved, pull = np.zeros(6), np.zeros(6)
    for t in range(T):
        pull[:] = 0.0
        for i in range(N):
            if not valid[t, i]:
                continue
            for a in range(6):
                total = 0.0
                for m in range(OWN):
                    if sign[a, m] != 0.0:
                        total += sign[a, m] * F[t, FEATURES * i + which[a, m]] * step[OWN * i + m]
                moved[a] = W[i, a] * total
            for a in range(6):
                for k in range(6):
                    pull[k] += J[i, a, k] * moved[a]
        for a in range(6):
            for k in range(6):
                out[t, a] += inverse[pattern[t], a, k] * pull[k]
    return out
