"""What passes over the rows of a joint fit do with single poses and six-vectors: numbers, not arrays.

Writes to arrays would make the compiler read every other one anew.
"""

from __future__ import annotations

import numba
import numpy as np

from steelyard.check import Array

# Products may be fused with the sums they go into: a rounding less, and a tenth of the time.
passes = numba.njit(cache=True, error_model="numpy", fastmath={"contract"})

NOTHING = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
Six = tuple[float, float, float, float, float, float]
Three = tuple[float, float, float]
Nine = tuple[float, float, float, float, float, float, float, float, float]


@passes
def matrix_at(R: Array, t: int) -> Nine:
    """Return the entries of one matrix of (T, 3, 3), row after row."""
    return R[t, 0, 0], R[t, 0, 1], R[t, 0, 2], R[t, 1, 0], R[t, 1, 1], R[t, 1, 2], R[t, 2, 0], R[t, 2, 1], R[t, 2, 2]


@passes
def turn_at(R: Array, t: int, i: int) -> Nine:
    """Return the entries of one matrix of (T, N, 3, 3), row after row."""
    return (
        R[t, i, 0, 0], R[t, i, 0, 1], R[t, i, 0, 2], R[t, i, 1, 0], R[t, i, 1, 1], R[t, i, 1, 2], R[t, i, 2, 0],
        R[t, i, 2, 1], R[t, i, 2, 2],
    )  # fmt: skip


@passes
def three_at(p: Array, t: int) -> Three:
    """Return one vector of (T, 3)."""
    return p[t, 0], p[t, 1], p[t, 2]


@passes
def six_at(e: Array, t: int, i: int) -> Six:
    """Return one vector of (T, N, 6)."""
    return e[t, i, 0], e[t, i, 1], e[t, i, 2], e[t, i, 3], e[t, i, 4], e[t, i, 5]


@passes
def write_six(out: Array, t: int, i: int, e: Six) -> None:
    """Set one vector of (T, N, 6)."""
    out[t, i, 0], out[t, i, 1], out[t, i, 2], out[t, i, 3], out[t, i, 4], out[t, i, 5] = e


@passes
def less(e: Six, x: Six) -> Six:
    """Return e - x."""
    return e[0] - x[0], e[1] - x[1], e[2] - x[2], e[3] - x[3], e[4] - x[4], e[5] - x[5]


@passes
def moved_grasp(x: Six, g: Three) -> Six:
    """Return what a small motion x of the payload does to a grasp at g."""
    return (
        x[0], x[1], x[2],
        x[3] + x[1] * g[2] - x[2] * g[1], x[4] + x[2] * g[0] - x[0] * g[2], x[5] + x[0] * g[1] - x[1] * g[0],
    )  # fmt: skip


@passes
def pushed(f: Six, turn: float, place: float, g: Three, e: Six) -> Six:
    """Return f and what the residual e of a grasp at g, with weights `turn` and `place`, pushes the payload."""
    u, v, w = place * e[3], place * e[4], place * e[5]
    return (
        f[0] + (turn * e[0] + g[1] * w - g[2] * v), f[1] + (turn * e[1] + g[2] * u - g[0] * w),
        f[2] + (turn * e[2] + g[0] * v - g[1] * u), f[3] + u, f[4] + v, f[5] + w,
    )  # fmt: skip


@passes
def in_payload(RG: Array, twist: Array, t: int, i: int, factor: float) -> Six:
    """Return `factor` times the twist of grasp i at row t in the payload's axes."""
    G, s = matrix_at(RG, i), six_at(twist, t, i)
    return (
        factor * (G[0] * s[0] + G[1] * s[1] + G[2] * s[2]), factor * (G[3] * s[0] + G[4] * s[1] + G[5] * s[2]),
        factor * (G[6] * s[0] + G[7] * s[1] + G[8] * s[2]), factor * (G[0] * s[3] + G[1] * s[4] + G[2] * s[5]),
        factor * (G[3] * s[3] + G[4] * s[4] + G[5] * s[5]), factor * (G[6] * s[3] + G[7] * s[4] + G[8] * s[5]),
    )  # fmt: skip


@passes
def _row(A: Array, k: int, a: int, f: Six) -> float:
    """Return A[k, a] f for A (C, 6, 6)."""
    front = A[k, a, 0] * f[0] + A[k, a, 1] * f[1] + A[k, a, 2] * f[2]
    return float(front + A[k, a, 3] * f[3] + A[k, a, 4] * f[4] + A[k, a, 5] * f[5])


@passes
def times(A: Array, k: int, f: Six) -> Six:
    """Return A[k] f for A (C, 6, 6)."""
    return _row(A, k, 0, f), _row(A, k, 1, f), _row(A, k, 2, f), _row(A, k, 3, f), _row(A, k, 4, f), _row(A, k, 5, f)


@passes
def product(A: Nine, B: Nine) -> Nine:
    """Return A B of two matrices."""
    return (
        A[0] * B[0] + A[1] * B[3] + A[2] * B[6], A[0] * B[1] + A[1] * B[4] + A[2] * B[7],
        A[0] * B[2] + A[1] * B[5] + A[2] * B[8], A[3] * B[0] + A[4] * B[3] + A[5] * B[6],
        A[3] * B[1] + A[4] * B[4] + A[5] * B[7], A[3] * B[2] + A[4] * B[5] + A[5] * B[8],
        A[6] * B[0] + A[7] * B[3] + A[8] * B[6], A[6] * B[1] + A[7] * B[4] + A[8] * B[7],
        A[6] * B[2] + A[7] * B[5] + A[8] * B[8],
    )  # fmt: skip


@passes
def across(A: Nine) -> Nine:
    """Return the transpose."""
    return A[0], A[3], A[6], A[1], A[4], A[7], A[2], A[5], A[8]


@passes
def apart(X: Nine, place: Three, R: Array, p: Array, RG: Array, pG: Array, RZ: Array, pZ: Array, t: int, i: int) -> Six:
    """Return rotation vector and position of grasp i at row t from X G to Z T, in the axes of X.

    The rotation is that of E = X^T Z R G^T; the position X^T (Z p - X g) needs it not.
    """
    M = product(across(X), matrix_at(RZ, i))
    u, v, w = pZ[i, 0] - place[0], pZ[i, 1] - place[1], pZ[i, 2] - place[2]
    x, y, z = p[t, i, 0], p[t, i, 1], p[t, i, 2]
    E = product(product(M, turn_at(R, t, i)), across(matrix_at(RG, i)))
    a, b, c = E[7] - E[5], E[2] - E[6], E[3] - E[1]
    share = _log_share(a, b, c, E[0] + E[4] + E[8])
    return (
        share * a, share * b, share * c,
        X[0] * u + X[3] * v + X[6] * w + M[0] * x + M[1] * y + M[2] * z - pG[i, 0],
        X[1] * u + X[4] * v + X[7] * w + M[3] * x + M[4] * y + M[5] * z - pG[i, 1],
        X[2] * u + X[5] * v + X[8] * w + M[6] * x + M[7] * y + M[8] * z - pG[i, 2],
    )  # fmt: skip


@passes
def home_pull(X: Nine, place: Three, g: Three, home: Three, f: Six) -> Six:
    """Return what a push f in the axes of X at the grasp g pulls on a home, in the reference home's axes."""
    x, y, z = (
        X[0] * f[3] + X[1] * f[4] + X[2] * f[5],
        X[3] * f[3] + X[4] * f[4] + X[5] * f[5],
        X[6] * f[3] + X[7] * f[4] + X[8] * f[5],
    )
    u = place[0] - home[0] + X[0] * g[0] + X[1] * g[1] + X[2] * g[2]
    v = place[1] - home[1] + X[3] * g[0] + X[4] * g[1] + X[5] * g[2]
    w = place[2] - home[2] + X[6] * g[0] + X[7] * g[1] + X[8] * g[2]
    return (
        X[0] * f[0] + X[1] * f[1] + X[2] * f[2] + v * z - w * y,
        X[3] * f[0] + X[4] * f[1] + X[5] * f[2] + w * x - u * z,
        X[6] * f[0] + X[7] * f[1] + X[8] * f[2] + u * y - v * x,
        x, y, z,
    )  # fmt: skip


@passes
def into_own(R: Array, out: Array, t: int, i: int, first: int) -> None:
    """Turn three numbers of out[t, i] from `first` on by the transpose of R[i]."""
    u, v, w = out[t, i, first], out[t, i, first + 1], out[t, i, first + 2]
    for a in range(3):
        out[t, i, first + a] = R[i, 0, a] * u + R[i, 1, a] * v + R[i, 2, a] * w


@passes
def turn_by(x: float, y: float, z: float) -> Nine:
    """Return the rotation about (x, y, z) by its length [rad] (Rodrigues)."""
    square = x * x + y * y + z * z
    if square < 1e-8:
        a, b = 1 - square / 6, 0.5 - square / 24
    else:
        angle = np.sqrt(square)
        a, b = np.sin(angle) / angle, 2 * (np.sin(0.5 * angle) / angle) ** 2
    return (
        1 - b * (y * y + z * z), b * x * y - a * z, b * x * z + a * y,
        b * x * y + a * z, 1 - b * (x * x + z * z), b * y * z - a * x,
        b * x * z - a * y, b * y * z + a * x, 1 - b * (x * x + y * y),
    )  # fmt: skip


@passes
def _log_share(x: float, y: float, z: float, trace: float) -> float:
    """Return what the skew part (x, y, z), twice the sine times the axis, is to be multiplied by for its vector."""
    s = 0.25 * (x * x + y * y + z * z)
    if s < 1e-2 and trace > 1:
        # asin(sine) / sine: what is left out is below 1e-17 of it.
        high = 63 / 2816 + s * (231 / 13312 + s * 143 / 10240)
        return 0.5 + 0.5 * s * (1 / 6 + s * (3 / 40 + s * (5 / 112 + s * (35 / 1152 + s * high))))
    sine = np.sqrt(s) + 1e-300
    return float(0.5 * np.arctan2(sine, 0.5 * (trace - 1)) / sine)
