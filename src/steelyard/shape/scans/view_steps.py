"""Views fitted to a surface: one by one, or all at once.

Fitted to their common surface one by one, each view goes only a small part of the way wherever most of that surface is
its own: what a camera askew at the wrist does to all views alike, an object that swells or shrinks, then takes hundreds
of rounds. Here the surface goes along. At each of its points the height on which the views agree is free, and what is
left is how far they have it apart: one system of equations for all of their steps.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np

from steelyard.check import Array
from steelyard.shape.scans.depth_images import FACING, pixel_of

_STEPS = 3  # of Gauss and Newton, per view
_ALIKE = 50.0  # neighbours on the surface whose errors are one: an edge that blurs does so on its whole length
_PAIRS = 90_000  # of a point and a view that are looked at, about: of many views a share of the points is enough
_FLOOR = 1e-4  # of the surface: it is known no better [m]


def moved(
    depth: Any, unit: float, camera: Array, R: Array, p: Array, xyz: Array, normal: Array, window: float, noise: float,
    loose: tuple[float, float],
) -> tuple[Array, Array]:  # fmt: skip
    """Return poses (V, 3, 3), (V, 3) from which the views measure the surface of patches (N, 3) with normals (N, 3).

    Point-to-plane distances of the pixels that patches fall on, Huber-weighted, three Gauss-Newton steps per view.
    window  distances beyond it are another surface [m]
    loose   standard deviations of the reported poses, [m] and [rad]: how freely a view may leave its pose
    """
    R, p = R.copy(), p.copy()
    middle = xyz.mean(0)
    for k in range(len(R)):
        for _ in range(_STEPS):
            H, g = _of_view(depth, unit, camera, R, p, k, xyz, normal, middle, window, noise)
            H[np.arange(6), np.arange(6)] += 1 / np.array([loose[1]] * 3 + [loose[0]] * 3) ** 2
            step = np.linalg.solve(H, -g)
            turn = _rotation(step[:3])
            R[k] = turn @ R[k]
            p[k] = middle + turn @ (p[k] - middle) + step[3:]
    return R, p


@numba.njit(cache=True, nogil=True)
def _rotation(w: Any) -> Any:
    """Return the rotation (3, 3) by a vector w (3,) [rad]."""
    angle = np.sqrt((w * w).sum())
    if angle < 1e-12:
        return np.eye(3)
    a = w / angle
    K = np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * (K @ K)


@numba.njit(cache=True, nogil=True)
def _of_view(
    depth: Any, unit: float, camera: Any, R: Any, p: Any, k: int, xyz: Any, normal: Any, middle: Any, window: float,
    noise: float,
) -> Any:  # fmt: skip
    """Return the Hessian (6, 6) and gradient (6,) of half the squared distances, in standard deviations of depth."""
    H, g, row = np.zeros((6, 6)), np.zeros(6), np.empty(6)
    for i in range(len(xyz)):
        heard, over, sigma = _measured(depth, unit, camera, R, p, k, xyz[i], normal[i], row, middle, noise)
        if not heard or abs(over) > window:
            continue
        weight = _weight(over, sigma)
        for r in range(6):
            g[r] += weight * row[r] * over
            for c in range(6):
                H[r, c] += weight * row[r] * row[c]
    return H, g


@numba.njit(cache=True, nogil=True)
def _weight(over: float, sigma: float) -> float:
    """Return Huber's weight [1/m^2] of a distance `over` with standard deviation sigma [m]."""
    return 1 / sigma**2 * min(1.0, 2 * sigma / (abs(over) + 1e-12))


def steps_together(
    depth: Any, unit: float, camera: Array, R: Array, p: Array, xyz: Array, normal: Array, window: float, noise: float,
    loose: tuple[float, float],
) -> Array:  # fmt: skip
    """Return steps (V, 6), turns [rad] about the middle of the points and shifts [m], after which the views agree best.

    xyz     (N, 3) points of the surface with normals (N, 3)
    window  distances from it beyond which something else was measured [m]
    noise   standard deviation of depth at 1 m
    loose   standard deviations of the poses, [m] and [rad]: how freely a view may leave its pose
    """
    step = -(-len(xyz) * len(R) // _PAIRS)
    H, g = _together(depth, unit, camera, R, p, xyz[::step], normal[::step], xyz.mean(0), window, noise)
    H, g = H * (step / _ALIKE), g * (step / _ALIKE)
    H[np.diag_indices(len(H))] += np.tile(1 / np.array([loose[1]] * 3 + [loose[0]] * 3) ** 2, len(R))
    steps = np.linalg.solve(H, -g).reshape(-1, 6)
    # All together are free to go anywhere: they stay.
    return np.asarray(steps - steps.mean(0))


@numba.njit(cache=True, nogil=True)
def _together(
    depth: Any, unit: float, camera: Any, R: Any, p: Any, xyz: Any, normal: Any, middle: Any, window: float,
    noise: float,
) -> Any:  # fmt: skip
    """Return the Hessian (6 V, 6 V) and gradient (6 V,) of half the squared distances of the views from their mean."""
    H, g = np.zeros((6 * len(R), 6 * len(R))), np.zeros(6 * len(R))
    view, row, height, weight = np.empty(len(R), np.int64), np.empty((len(R), 6)), np.empty(len(R)), np.empty(len(R))
    for i in range(len(xyz)):
        n, total, mean = 0, 0.0, 0.0
        for k in range(len(R)):
            heard, over, sigma = _measured(depth, unit, camera, R, p, k, xyz[i], normal[i], row[n], middle, noise)
            if not heard or abs(over) > window:
                continue
            view[n], height[n] = k, over
            weight[n] = _weight(over, sigma)
            total += weight[n]
            mean += weight[n] * over
            n += 1
        if n > 1:
            _add(H, g, view[:n], row[:n], height[:n] - mean / total, weight[:n], total)
    return H, g


@numba.njit(cache=True, nogil=True)
def _measured(
    depth: Any, unit: float, camera: Any, R: Any, p: Any, k: int, x: Any, n: Any, row: Any, middle: Any, noise: float
) -> Any:
    """Return whether view k faces a point x (3,) with normal n (3,), how high over it it measures and how surely [m].

    row  (6,) is filled with how that height changes with the step of the view
    """
    dx, dy, dz = x[0] - p[k, 0], x[1] - p[k, 1], x[2] - p[k, 2]
    cosine = -(dx * n[0] + dy * n[1] + dz * n[2]) / np.sqrt(dx * dx + dy * dy + dz * dz)
    z, u, v = pixel_of(camera, R, p, k, x[0], x[1], x[2])
    if cosine < FACING or u < 0 or v < 0 or u >= depth.shape[2] or v >= depth.shape[1] or depth[k, v, u] == 0:
        return False, 0.0, 1.0
    m = depth[k, v, u] * unit
    a, b = m * (u - camera[2]) / camera[0], m * (v - camera[3]) / camera[1]
    over = 0.0
    for c in range(3):
        at = R[k, c, 0] * a + R[k, c, 1] * b + R[k, c, 2] * m + p[k, c]
        over += n[c] * (at - x[c])
        row[3 + c] = at - middle[c]
    ax, ay, az = row[3], row[4], row[5]
    row[0], row[1], row[2] = ay * n[2] - az * n[1], az * n[0] - ax * n[2], ax * n[1] - ay * n[0]
    row[3], row[4], row[5] = n[0], n[1], n[2]
    return True, over, noise * z * z * cosine + _FLOOR


@numba.njit(cache=True, nogil=True)
def _add(H: Any, g: Any, view: Any, row: Any, apart: Any, weight: Any, total: float) -> None:
    """Add what one point, `apart` [m] from the mean of the views that measure it, asks of their steps."""
    for m in range(len(view)):
        for r in range(6):
            g[6 * view[m] + r] += weight[m] * row[m, r] * apart[m]
        for n in range(len(view)):
            share = weight[m] * ((m == n) - weight[n] / total)
            for r in range(6):
                for c in range(6):
                    H[6 * view[m] + r, 6 * view[n] + c] += share * row[m, r] * row[n, c]
