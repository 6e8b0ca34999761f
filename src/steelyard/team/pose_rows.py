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


@numba.njit(cache=True, error_model="numpy")
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


@numba.njit(cache=True, error_model="numpy")
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


@numba.njit(cache=True, error_model="numpy")
def settled(
    R: Array, p: Array, valid: Mask, RG: Array, pG: Array, RZ: Array, pZ: Array, RX: Array, pX: Array, twist: Array,
    late: Array, W: Array, inverse: Array, pattern: Integers, sweeps: int,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Let the motion follow the grasps and homes; return it (T, 3, 3), (T, 3) and the residuals (T, N, 6).

    R (T, N, 3, 3), p (T, N, 3) measured; G, Z (N,), X (T,) where everything is; twist (T, N, 6) how poses move in
    their own axes per second that late (N,) [s] their clocks are, or (0, N, 6); W (N, 2) weights of turn and place;
    inverse (C, 6, 6) of the information about the motion per pattern of robots, pattern (T,); sweeps of Gauss-Newton.
    Residuals are rotation vector and position of grasps from predicted to measured, in the payload's axes: from X to
    Z T G^-1, where robot i sees the payload, less what the last sweep took up.
    """
    T, N = p.shape[:2]
    turns, places, residual = np.empty((T, 3, 3)), np.empty((T, 3)), np.zeros((T, N, 6))
    B, x, f, W6 = np.empty((N, 12)), np.empty(6), np.empty(6), np.repeat(W, 3).reshape(N, 6)
    shift, timed = np.zeros((N, 6)), len(twist) > 0
    X, place, step, held = np.empty((3, 3)), np.empty(3), np.empty((3, 3)), np.empty((3, 3))
    for t in range(T):
        X[:] = RX[t]
        place[:] = pX[t]
        e = residual[t]
        for i in range(N):
            if valid[t, i]:
                _seen(R, p, RG, pG, RZ, pZ, t, i, held, B)
                if timed:
                    _into_payload(RG, twist[t], i, late[i], shift)
        for _ in range(sweeps):
            f[:] = 0.0
            for i in range(N):
                if not valid[t, i]:
                    continue
                _apart(X, place, B, pG, i, e)
                if timed:
                    for a in range(6):
                        e[i, a] -= shift[i, a]
                _pushed(W6, pG, e, i, f)
            _times(inverse[pattern[t]], f, x)
            for a in range(3):
                place[a] += X[a, 0] * x[3] + X[a, 1] * x[4] + X[a, 2] * x[5]
            _turn(x, step)
            _product(X, step, held)
            X[:] = held
        for i in range(N):
            if valid[t, i]:
                _taken(x, pG, i, e)
        turns[t] = X
        places[t] = place
    return turns, places, residual


@numba.njit(cache=True, error_model="numpy")
def pulled(
    residual: Array, valid: Mask, RG: Array, pG: Array, RZ: Array, pZ: Array, RX: Array, pX: Array, twist: Array,
    W: Array, inverse: Array, pattern: Integers, each: bool,
) -> Array:  # fmt: skip
    """Return the gradient of half chi^2 by grasps, homes and delays, sign turned: what rows add (T, 13 N), or the sum.

    Arguments as in `settled`, residuals from there; with `each` false the sum (1, 13 N). What any motion takes up of a
    row is left out. With weights alike along the axes, W e is the exact gradient in each grasp's own axes, so that the
    optimum is that of the likelihood, whatever the reference and the homes.
    """
    T, N = valid.shape
    out = np.zeros((T if each else 1, N, OWN))
    x, f, W6 = np.empty(6), np.empty(6), np.repeat(W, 3).reshape(N, 6)
    rate, e, timed = np.zeros((N, 6)), np.empty((N, 6)), len(twist) > 0
    for t in range(T):
        e[:], row = residual[t], t if each else 0
        f[:] = 0.0
        for i in range(N):
            if valid[t, i]:
                _pushed(W6, pG, e, i, f)
        _times(inverse[pattern[t]], f, x)
        for i in range(N):
            if not valid[t, i]:
                continue
            _taken(x, pG, i, e)
            for a in range(6):
                f[a] = W6[i, a] * e[i, a]
                out[row, i, a] += f[a]
            if timed:
                _into_payload(RG, twist[t], i, 1.0, rate)
                for a in range(6):
                    out[row, i, 12] += rate[i, a] * f[a]
            _home_pull(RX[t], pX[t], pG[i], pZ[i], f, out[row, i])
    for row in range(len(out)):
        for i in range(N):
            _into_own(RG[i], out[row, i, :6])
            _into_own(RZ[i], out[row, i, 6:12])
    return out.reshape(len(out), OWN * N)


@numba.njit(cache=True, error_model="numpy")
def _pushed(W: Array, pG: Array, e: Array, i: int, f: Array) -> None:
    """Add what the weighted residual of grasp i pushes the payload (6,)."""
    u, v, w = W[i, 3] * e[i, 3], W[i, 4] * e[i, 4], W[i, 5] * e[i, 5]
    f[0] += W[i, 0] * e[i, 0] + pG[i, 1] * w - pG[i, 2] * v
    f[1] += W[i, 1] * e[i, 1] + pG[i, 2] * u - pG[i, 0] * w
    f[2] += W[i, 2] * e[i, 2] + pG[i, 0] * v - pG[i, 1] * u
    f[3] += u
    f[4] += v
    f[5] += w


@numba.njit(cache=True, error_model="numpy")
def _into_payload(RG: Array, twist: Array, i: int, factor: float, out: Array) -> None:
    """Write `factor` times a six-vector of grasp i in the payload's axes."""
    for k in range(0, 6, 3):
        u, v, w = factor * twist[i, k], factor * twist[i, k + 1], factor * twist[i, k + 2]
        for a in range(3):
            out[i, k + a] = RG[i, a, 0] * u + RG[i, a, 1] * v + RG[i, a, 2] * w


@numba.njit(cache=True, error_model="numpy")
def _taken(x: Array, pG: Array, i: int, e: Array) -> None:
    """Take a small motion x (6,) of the payload off the residual of grasp i."""
    for a in range(3):
        e[i, a] -= x[a]
    e[i, 3] -= x[3] + x[1] * pG[i, 2] - x[2] * pG[i, 1]
    e[i, 4] -= x[4] + x[2] * pG[i, 0] - x[0] * pG[i, 2]
    e[i, 5] -= x[5] + x[0] * pG[i, 1] - x[1] * pG[i, 0]


@numba.njit(cache=True, error_model="numpy")
def _times(A: Array, f: Array, x: Array) -> None:
    """Write A f (6,)."""
    for a in range(6):
        x[a] = 0.0
        for k in range(6):
            x[a] += A[a, k] * f[k]


@numba.njit(cache=True, error_model="numpy")
def _seen(
    R: Array, p: Array, RG: Array, pG: Array, RZ: Array, pZ: Array, t: int, i: int, held: Array, B: Array
) -> None:
    """Write Z T G^-1: rotation (9) and position (3) of the payload as robot i sees it at row t."""
    for a in range(3):
        for b in range(3):
            held[a, b] = RZ[i, a, 0] * R[t, i, 0, b] + RZ[i, a, 1] * R[t, i, 1, b] + RZ[i, a, 2] * R[t, i, 2, b]
    for a in range(3):
        place = pZ[i, a] + RZ[i, a, 0] * p[t, i, 0] + RZ[i, a, 1] * p[t, i, 1] + RZ[i, a, 2] * p[t, i, 2]
        for b in range(3):
            turn = held[a, 0] * RG[i, b, 0] + held[a, 1] * RG[i, b, 1] + held[a, 2] * RG[i, b, 2]
            B[i, 3 * a + b] = turn
            place -= turn * pG[i, b]
        B[i, 9 + a] = place


@numba.njit(cache=True, error_model="numpy")
def _apart(X: Array, place: Array, B: Array, pG: Array, i: int, e: Array) -> None:
    """Write rotation vector and position (6,) of grasp i from X G to B G, in the axes of X."""
    u, v, w = B[i, 9] - place[0], B[i, 10] - place[1], B[i, 11] - place[2]
    E00 = X[0, 0] * B[i, 0] + X[1, 0] * B[i, 3] + X[2, 0] * B[i, 6]
    E01 = X[0, 0] * B[i, 1] + X[1, 0] * B[i, 4] + X[2, 0] * B[i, 7]
    E02 = X[0, 0] * B[i, 2] + X[1, 0] * B[i, 5] + X[2, 0] * B[i, 8]
    E10 = X[0, 1] * B[i, 0] + X[1, 1] * B[i, 3] + X[2, 1] * B[i, 6]
    E11 = X[0, 1] * B[i, 1] + X[1, 1] * B[i, 4] + X[2, 1] * B[i, 7]
    E12 = X[0, 1] * B[i, 2] + X[1, 1] * B[i, 5] + X[2, 1] * B[i, 8]
    E20 = X[0, 2] * B[i, 0] + X[1, 2] * B[i, 3] + X[2, 2] * B[i, 6]
    E21 = X[0, 2] * B[i, 1] + X[1, 2] * B[i, 4] + X[2, 2] * B[i, 7]
    E22 = X[0, 2] * B[i, 2] + X[1, 2] * B[i, 5] + X[2, 2] * B[i, 8]
    g, h, k = pG[i, 0], pG[i, 1], pG[i, 2]
    e[i, 3] = X[0, 0] * u + X[1, 0] * v + X[2, 0] * w + (E00 - 1) * g + E01 * h + E02 * k
    e[i, 4] = X[0, 1] * u + X[1, 1] * v + X[2, 1] * w + E10 * g + (E11 - 1) * h + E12 * k
    e[i, 5] = X[0, 2] * u + X[1, 2] * v + X[2, 2] * w + E20 * g + E21 * h + (E22 - 1) * k
    share = _log_share(E21 - E12, E02 - E20, E10 - E01, E00 + E11 + E22)
    e[i, 0], e[i, 1], e[i, 2] = share * (E21 - E12), share * (E02 - E20), share * (E10 - E01)


@numba.njit(cache=True, error_model="numpy")
def _home_pull(X: Array, place: Array, pG: Array, pZ: Array, f: Array, out: Array) -> None:
    """Take what a push f (6,) in the axes of X at X G pulls on a home off out[6:12], in the reference home's axes."""
    x = X[0, 0] * f[3] + X[0, 1] * f[4] + X[0, 2] * f[5]
    y = X[1, 0] * f[3] + X[1, 1] * f[4] + X[1, 2] * f[5]
    z = X[2, 0] * f[3] + X[2, 1] * f[4] + X[2, 2] * f[5]
    u = place[0] - pZ[0] + X[0, 0] * pG[0] + X[0, 1] * pG[1] + X[0, 2] * pG[2]
    v = place[1] - pZ[1] + X[1, 0] * pG[0] + X[1, 1] * pG[1] + X[1, 2] * pG[2]
    w = place[2] - pZ[2] + X[2, 0] * pG[0] + X[2, 1] * pG[1] + X[2, 2] * pG[2]
    out[6] -= X[0, 0] * f[0] + X[0, 1] * f[1] + X[0, 2] * f[2] + v * z - w * y
    out[7] -= X[1, 0] * f[0] + X[1, 1] * f[1] + X[1, 2] * f[2] + w * x - u * z
    out[8] -= X[2, 0] * f[0] + X[2, 1] * f[1] + X[2, 2] * f[2] + u * y - v * x
    out[9] -= x
    out[10] -= y
    out[11] -= z


@numba.njit(cache=True, error_model="numpy")
def _into_own(R: Array, six: Array) -> None:
    """Turn both parts of a six-vector by R^T in place."""
    for k in range(0, 6, 3):
        u, v, w = six[k], six[k + 1], six[k + 2]
        for a in range(3):
            six[k + a] = R[0, a] * u + R[1, a] * v + R[2, a] * w


@numba.njit(cache=True, error_model="numpy")
def residuals(
    R: Array, p: Array, valid: Mask, RG: Array, pG: Array, RZ: Array, pZ: Array, RX: Array, pX: Array
) -> Array:
    """Return rotation vector and position (T, N, 6) from predicted to measured, in the axes of each predicted grasp."""
    T, N = p.shape[:2]
    out, held, B = np.zeros((T, N, 6)), np.empty((3, 3)), np.empty((N, 12))
    for t in range(T):
        for i in range(N):
            if valid[t, i]:
                _seen(R, p, RG, pG, RZ, pZ, t, i, held, B)
                _apart(RX[t], pX[t], B, pG, i, out[t])
                _into_own(RG[i], out[t, i])
    return out


@numba.njit(cache=True, error_model="numpy")
def _product(A: Array, B: Array, out: Array) -> None:
    """Write A B (3, 3): at this size plain loops are much quicker than a call of BLAS."""
    for a in range(3):
        for b in range(3):
            out[a, b] = A[a, 0] * B[0, b] + A[a, 1] * B[1, b] + A[a, 2] * B[2, b]


@numba.njit(cache=True, error_model="numpy")
def _turn(vector: Array, out: Array) -> None:
    """Write the rotation (3, 3) about the first three of `vector` by their length [rad] (Rodrigues)."""
    x, y, z = vector[0], vector[1], vector[2]
    square = x * x + y * y + z * z
    angle = np.sqrt(square)
    if angle < 1e-4:
        a, b = 1 - square / 6, 0.5 - square / 24
    else:
        a, b = np.sin(angle) / angle, 2 * (np.sin(0.5 * angle) / angle) ** 2
    out[0, 0], out[0, 1], out[0, 2] = 1 - b * (y * y + z * z), b * x * y - a * z, b * x * z + a * y
    out[1, 0], out[1, 1], out[1, 2] = b * x * y + a * z, 1 - b * (x * x + z * z), b * y * z - a * x
    out[2, 0], out[2, 1], out[2, 2] = b * x * z - a * y, b * y * z + a * x, 1 - b * (x * x + y * y)


@numba.njit(cache=True, error_model="numpy")
def _log_share(x: float, y: float, z: float, trace: float) -> float:
    """Return what the skew part (x, y, z), twice the sine times the axis, is to be multiplied by for its vector."""
    square = 0.25 * (x * x + y * y + z * z)
    if square < 1e-6 and trace > 1:
        return 0.5 + square / 12 + 3 * square * square / 80
    sine = np.sqrt(square) + 1e-300
    return float(0.5 * np.arctan2(sine, 0.5 * (trace - 1)) / sine)
