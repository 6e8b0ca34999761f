"""Small motions of poses: the adjoint, steps and differences as six-vectors, angular first, and how fast grasps turn.

Passes over long paths are compiled.
"""

from __future__ import annotations

import numba
import numpy as np

from steelyard import check
from steelyard.check import Array, Integers
from steelyard.logs.middles import mean
from steelyard.logs.team_track import Track
from steelyard.spatial import Pose, Rotation, cross_matrix


def adjoint(X_AB: Pose) -> Array:
    """Return Ad (..., 6, 6): it turns twists of a body seen in B into A (Lynch and Park)."""
    R = X_AB.rotation.matrix
    out = np.zeros((*R.shape[:-2], 6, 6))
    out[..., :3, :3] = out[..., 3:, 3:] = R
    out[..., 3:, :3] = cross_matrix(X_AB.position) @ R
    return out


def adjoint_inverse(X_AB: Pose) -> Array:
    """Return Ad of the inverse pose (..., 6, 6)."""
    R = np.swapaxes(X_AB.rotation.matrix, -1, -2)
    out = np.zeros((*R.shape[:-2], 6, 6))
    out[..., :3, :3] = out[..., 3:, 3:] = R
    out[..., 3:, :3] = -R @ cross_matrix(X_AB.position)
    return out


def _brackets() -> Array:
    """Return C (6, 6, 6), so that ad_V = sum_a V_a C_a: [ad_V U] is the Lie bracket of twists, angular part first."""
    out = np.zeros((6, 6, 6))
    for a in range(3):
        out[a, :3, :3] = out[a, 3:, 3:] = out[3 + a, 3:, :3] = cross_matrix(np.eye(3)[a])
    return out


BRACKETS = _brackets()


def exp(step: Array) -> Pose:
    """Return the pose of a small step (..., 6): rotation vector [rad] and position [m].

    It agrees with the exponential of SE(3) to first order, which is all that a settled Gauss-Newton needs.
    """
    return Pose(Rotation.exp(step[..., :3]), step[..., 3:])


def log(poses: Pose) -> Array:
    """Return rotation vector and position (..., 6), the inverse of `exp`."""
    return np.concatenate([poses.rotation.log(), poses.position], axis=-1)


def turns_between(first: Rotation, second: Rotation) -> Array:
    """Return the rotation vectors (..., 3) [rad], at most pi long, of first^-1 second; `first` is alike or single."""
    turns = _turns(first.matrix.reshape(-1, 3, 3), second.matrix.reshape(-1, 3, 3))
    return turns.reshape(second.matrix.shape[:-1])


def turned_by(first: Rotation, turns: Array) -> Rotation:
    """Return the rotations (T, 1) that a single one comes to by rotation vectors (T, 3) [rad] in its own axes."""
    return Rotation.trusted(_turned_by(first.matrix[None], turns)[:, None])


def moved(poses: Pose, steps: Array) -> Pose:
    """Return poses (N,) after small steps (N, 6) in their own axes: rotation vector [rad] and position [m]."""
    steps, turn = check.vectors("step", steps, 6), poses.rotation
    turned = Rotation.trusted(_turned_by(turn.matrix, steps[:, :3]))
    return Pose.trusted(turned, turn.turned(steps[:, 3:]) + poses.position)


def twists_between(first: Pose, second: Pose) -> Array:
    """Return the body twists (T, 6) [rad, m] that lead from poses (T,) to others in unit time; angles below pi."""
    turn = turns_between(first.rotation, second.rotation)
    return _twists(turn, first.rotation.matrix, second.position - first.position)


def extent(path: Pose) -> Array:
    """Return how far poses (T,) turn and lie from their middle (2,), rms along an axis [rad, m]."""
    turns = turns_between(Rotation.nearest(mean(path.rotation.matrix)), path.rotation)
    places = path.position - mean(path.position)
    return np.sqrt([(turns**2).mean(), (places**2).mean()])


def turning_speed(track: Track, time: Array, over_s: float) -> Array:
    """Return how fast (T,) [rad/s] a grasp turns from `time` (T,) to `over_s` later; NaN where it was not measured.

    It is the same for every grasp of a rigid payload, in whatever frames it is told.
    """
    name = "rotation" if track.has("rotation") else "angular_velocity"
    good = track.mask(name)
    if good.sum() < 2:
        return np.full(len(time), np.nan)
    known, values = (track.time, track.channels[name]) if good.all() else (track.time[good], track.channels[name][good])
    first, last = _spans(known, time, over_s)
    speed = _speeds(known, values, first, last) if name == "rotation" else np.linalg.norm(values[first], axis=1)
    return np.where(last > 0, speed, np.nan)


@numba.njit(cache=True, error_model="numpy")
def _spans(known: Array, time: Array, over_s: float) -> tuple[Integers, Integers]:
    """Return the samples from each rising `time` (T,) to `over_s` later, first and last; zeros where none are apart."""
    first, last, a, b = np.zeros(len(time), np.int64), np.zeros(len(time), np.int64), 0, 0
    for t in range(len(time)):
        while a < len(known) and known[a] < time[t]:
            a += 1
        while b < len(known) and known[b] < time[t] + over_s:
            b += 1
        # Across a gap the turn may have gone forth and back.
        if time[t] >= known[0] and a < b < len(known) and known[b] - known[a] < 2 * over_s:
            first[t], last[t] = a, b
    return first, last


@numba.njit(cache=True, error_model="numpy")
def _speeds(known: Array, R: Array, first: Integers, last: Integers) -> Array:
    """Return how fast (T,) [rad/s] rotations R (K, 3, 3) turn between samples, NaN where these are one."""
    out, E, v = np.empty(len(first)), np.empty((3, 3)), np.empty(3)
    for t in range(len(first)):
        _turn(R, first[t], R, last[t], E, v)
        out[t] = np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) / (known[last[t]] - known[first[t]])
    return out


@numba.njit(cache=True, error_model="numpy")
def _turns(A: Array, B: Array) -> Array:
    """Return the logarithms (T, 3) of A^T B; A (T, 3, 3) or (1, 3, 3)."""
    out, E, v = np.empty((len(B), 3)), np.empty((3, 3)), np.empty(3)
    for t in range(len(B)):
        _turn(A, t if len(A) > 1 else 0, B, t, E, v)
        out[t, 0], out[t, 1], out[t, 2] = v[0], v[1], v[2]
    return out


@numba.njit(cache=True, error_model="numpy")
def _turn(A: Array, s: int, B: Array, t: int, E: Array, v: Array) -> None:
    """Write the logarithm v (3,) of E = A[s]^T B[t] (3, 3)."""
    for i in range(3):
        for j in range(3):
            E[i, j] = A[s, 0, i] * B[t, 0, j] + A[s, 1, i] * B[t, 1, j] + A[s, 2, i] * B[t, 2, j]
    # The quaternion, four times its largest entry: no entry is then a difference of like numbers.
    trace = E[0, 0] + E[1, 1] + E[2, 2]
    big = 0
    for i in range(1, 3):
        if E[i, i] > E[big, big]:
            big = i
    if trace >= E[big, big]:
        w, v[0], v[1], v[2] = 1 + trace, E[2, 1] - E[1, 2], E[0, 2] - E[2, 0], E[1, 0] - E[0, 1]
    else:
        i, j = (big + 1) % 3, (big + 2) % 3
        w = E[j, i] - E[i, j]
        v[big], v[i], v[j] = 1 + E[big, big] - E[i, i] - E[j, j], E[big, i] + E[i, big], E[big, j] + E[j, big]
    size = np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    way = -1.0 if w < 0 else 1.0
    share = 2 * way / np.sqrt(w * w + size * size)
    if size > 1e-9 * abs(w):
        share = 2 * way * np.arctan2(size, way * w) / size
    for i in range(3):
        v[i] *= share


@numba.njit(cache=True, error_model="numpy")
def _turned_by(A: Array, turns: Array) -> Array:
    """Return A exp(v) (T, 3, 3) for vectors v (T, 3) (Rodrigues; the half angle keeps digits near zero).

    A (T, 3, 3) or (1, 3, 3).
    """
    out = np.empty((len(turns), 3, 3))
    for t in range(len(turns)):
        s = t if len(A) > 1 else 0
        x, y, z = turns[t, 0], turns[t, 1], turns[t, 2]
        square = x * x + y * y + z * z
        a, b = 1 - square / 6, 0.5 - square / 24
        if square > 1e-8:
            angle = np.sqrt(square)
            a, b = np.sin(angle) / angle, 2 * (np.sin(0.5 * angle) / angle) ** 2
        for i in range(3):
            u, v, w = A[s, i, 0], A[s, i, 1], A[s, i, 2]
            out[t, i, 0] = u * (1 - b * (y * y + z * z)) + v * (b * x * y + a * z) + w * (b * x * z - a * y)
            out[t, i, 1] = u * (b * x * y - a * z) + v * (1 - b * (x * x + z * z)) + w * (b * y * z + a * x)
            out[t, i, 2] = u * (b * x * z + a * y) + v * (b * y * z - a * x) + w * (1 - b * (x * x + y * y))
    return out


@numba.njit(cache=True, error_model="numpy")
def _twists(turn: Array, R: Array, off: Array) -> Array:
    """Return twists (T, 6) from their rotations (T, 3) and displacements (T, 3) in the axes before R (T, 3, 3)."""
    out = np.empty((len(turn), 6))
    for t in range(len(turn)):
        x, y, z = turn[t, 0], turn[t, 1], turn[t, 2]
        u = R[t, 0, 0] * off[t, 0] + R[t, 1, 0] * off[t, 1] + R[t, 2, 0] * off[t, 2]
        v = R[t, 0, 1] * off[t, 0] + R[t, 1, 1] * off[t, 1] + R[t, 2, 1] * off[t, 2]
        w = R[t, 0, 2] * off[t, 0] + R[t, 1, 2] * off[t, 1] + R[t, 2, 2] * off[t, 2]
        square = x * x + y * y + z * z
        if square < 1e-4:
            factor = 1 / 12 + square / 720 + square * square / 30240
        else:
            half = 0.5 * np.sqrt(square)
            factor = (1 - half / np.tan(half)) / square
        a, b, c = y * w - z * v, z * u - x * w, x * v - y * u
        out[t, 0], out[t, 1], out[t, 2] = x, y, z
        out[t, 3] = u - 0.5 * a + factor * (y * c - z * b)
        out[t, 4] = v - 0.5 * b + factor * (z * a - x * c)
        out[t, 5] = w - 0.5 * c + factor * (x * b - y * a)
    return out
