"""Compiled passes over the rows of a joint fit: the motion that fits, the residuals, the gradient."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array, Integers, Mask
from steelyard.team.poses.row_numbers import (
    NOTHING,
    across,
    apart,
    home_pull,
    in_payload,
    into_own,
    less,
    matrix_at,
    moved_grasp,
    passes,
    product,
    pushed,
    six_at,
    three_at,
    times,
    turn_at,
    turn_by,
    write_six,
)
from steelyard.team.poses.solver import OWN


@passes
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
    timed = len(twist) > 0
    for t in range(T):
        X, place, x = matrix_at(RX, t), three_at(pX, t), NOTHING
        for _ in range(sweeps):
            f = NOTHING
            for i in range(N):
                if not valid[t, i]:
                    continue
                e = apart(X, place, R, p, RG, pG, RZ, pZ, t, i)
                if timed:
                    e = less(e, in_payload(RG, twist, t, i, late[i]))
                write_six(residual, t, i, e)
                f = pushed(f, W[i, 0], W[i, 1], three_at(pG, i), e)
            x = times(inverse, pattern[t], f)
            place = (
                place[0] + X[0] * x[3] + X[1] * x[4] + X[2] * x[5],
                place[1] + X[3] * x[3] + X[4] * x[4] + X[5] * x[5],
                place[2] + X[6] * x[3] + X[7] * x[4] + X[8] * x[5],
            )
            X = product(X, turn_by(x[0], x[1], x[2]))
        for i in range(N):
            if valid[t, i]:
                write_six(residual, t, i, less(six_at(residual, t, i), moved_grasp(x, three_at(pG, i))))
        for a in range(3):
            turns[t, a, 0], turns[t, a, 1], turns[t, a, 2] = X[3 * a], X[3 * a + 1], X[3 * a + 2]
            places[t, a] = place[a]
    return turns, places, residual


@passes
def first_seen(R: Array, p: Array, valid: Mask, RG: Array, pG: Array, RZ: Array, pZ: Array) -> tuple[Array, Array]:
    """Return where the first robot that is valid sees the payload, Z T G^-1 (T, 3, 3) and (T, 3)."""
    T, N = p.shape[:2]
    turns, places = np.empty((T, 3, 3)), np.empty((T, 3))
    for t in range(T):
        i = 0
        while i < N - 1 and not valid[t, i]:
            i += 1
        if not valid[t, i]:
            i = 0
        Z, x, y, z, g = matrix_at(RZ, i), p[t, i, 0], p[t, i, 1], p[t, i, 2], three_at(pG, i)
        X = product(product(Z, turn_at(R, t, i)), across(matrix_at(RG, i)))
        for a in range(3):
            turns[t, a, 0], turns[t, a, 1], turns[t, a, 2] = X[3 * a], X[3 * a + 1], X[3 * a + 2]
            places[t, a] = (
                pZ[i, a] + Z[3 * a] * x + Z[3 * a + 1] * y + Z[3 * a + 2] * z
                - X[3 * a] * g[0] - X[3 * a + 1] * g[1] - X[3 * a + 2] * g[2]
            )  # fmt: skip
    return turns, places


@passes
def pulled(
    residual: Array, valid: Mask, RG: Array, pG: Array, RZ: Array, pZ: Array, RX: Array, pX: Array, twist: Array,
    W: Array, inverse: Array, pattern: Integers, share: Array, rows: int,
) -> Array:  # fmt: skip
    """Return the gradient of half chi^2 by grasps, homes and delays, sign turned, in sums over so many `rows`.

    Arguments as in `settled`, residuals from there; share (T,) how much each row counts; the last of the sums
    (T / rows, 13 N) may be of fewer rows. What any motion takes up of a row is left out. With weights alike along the
    axes, W e is the exact gradient in each grasp's own axes, so that the optimum is that of the likelihood, whatever
    the reference and the homes.
    """
    T, N = valid.shape
    out = np.zeros((-(-T // rows), N, OWN))
    timed = len(twist) > 0
    for t in range(T):
        row, f = t // rows, NOTHING
        for i in range(N):
            if valid[t, i]:
                f = pushed(f, W[i, 0], W[i, 1], three_at(pG, i), six_at(residual, t, i))
        x, X, place = times(inverse, pattern[t], f), matrix_at(RX, t), three_at(pX, t)
        for i in range(N):
            if not valid[t, i]:
                continue
            u, v = W[i, 0] * share[t], W[i, 1] * share[t]
            e = less(six_at(residual, t, i), moved_grasp(x, three_at(pG, i)))
            push = (u * e[0], u * e[1], u * e[2], v * e[3], v * e[4], v * e[5])
            pull = home_pull(X, place, three_at(pG, i), three_at(pZ, i), push)
            for a in range(6):
                out[row, i, a] += push[a]
                out[row, i, 6 + a] -= pull[a]
            if timed:
                rate = in_payload(RG, twist, t, i, 1.0)
                out[row, i, 12] += (
                    rate[0] * push[0] + rate[1] * push[1] + rate[2] * push[2]
                    + rate[3] * push[3] + rate[4] * push[4] + rate[5] * push[5]
                )  # fmt: skip
    for row in range(len(out)):
        for i in range(N):
            for first in range(0, 12, 3):
                into_own(RG if first < 6 else RZ, out, row, i, first)
    return out.reshape(len(out), OWN * N)


@passes
def residuals(
    R: Array, p: Array, valid: Mask, RG: Array, pG: Array, RZ: Array, pZ: Array, RX: Array, pX: Array
) -> Array:
    """Return rotation vector and position (T, N, 6) from predicted to measured, in the axes of each predicted grasp."""
    T, N = p.shape[:2]
    out = np.zeros((T, N, 6))
    for t in range(T):
        X, place = matrix_at(RX, t), three_at(pX, t)
        for i in range(N):
            if valid[t, i]:
                write_six(out, t, i, apart(X, place, R, p, RG, pG, RZ, pZ, t, i))
                into_own(RG, out, t, i, 0)
                into_own(RG, out, t, i, 3)
    return out


@passes
def held(pG: Array, W: Array, found: Mask) -> Array:
    """Return what a row says of the payload's motion (C, 6, 6), in its axes, for every set of robots found (C, N).

    With weights W (N, 2) alike along the axes, only the places pG (N, 3) of the grasps count. Rows that nobody saw say
    nothing: any motion will do.
    """
    out = np.zeros((len(found), 6, 6))
    for c in range(len(found)):
        A = out[c]
        if not found[c].any():
            for a in range(6):
                A[a, a] = 1.0
        for i in range(len(pG)):
            if not found[c, i]:
                continue
            x, y, z, turn, w = pG[i, 0], pG[i, 1], pG[i, 2], W[i, 0], W[i, 1]
            square = x * x + y * y + z * z
            for a in range(3):
                A[a, a] += turn + w * square
                A[3 + a, 3 + a] += w
                for b in range(3):
                    A[a, b] -= w * pG[i, a] * pG[i, b]
            A[0, 4] -= w * z
            A[0, 5] += w * y
            A[1, 3] += w * z
            A[1, 5] -= w * x
            A[2, 3] -= w * y
            A[2, 4] += w * x
        A[3:, :3] = A[:3, 3:].T
    return out


@passes
def in_own(residual: Array, RG: Array) -> Array:
    """Return residuals (T, N, 6) in the payload's axes in those of each grasp."""
    out = residual.copy()
    for t in range(out.shape[0]):
        for i in range(out.shape[1]):
            into_own(RG, out, t, i, 0)
            into_own(RG, out, t, i, 3)
    return out
