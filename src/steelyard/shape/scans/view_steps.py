"""Views fitted to a surface: one by one, or all at once.

Fitted to their common surface one by one, each view goes only a small part of the way wherever most of that surface is
its own: what a camera askew at the wrist does to all views alike, an object that swells or shrinks, then takes hundreds
of rounds. Here the surface goes along. At each of its points the height on which the views agree is free, and what is
left is how far they have it apart: one system of equations for all of their steps.

Two sides of a thing that no view shows together are tied by little but its rims. What holds them is where the cameras
were reported, as far as those poses prove right where the views do tell.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numba
import numpy as np

from steelyard.check import Array
from steelyard.shape.hulls.borrowed import borrowed
from steelyard.shape.scans.depth_images import FACING, Images, lent, normal_of, pixel_of
from steelyard.shape.scans.pose_errors import PoseErrors
from steelyard.spatial import Pose, Rotation

_STEPS = 3  # of Gauss and Newton, per view
_ALIKE = 50.0  # neighbours on the surface whose errors are one: an edge that blurs does so on its whole length
_PAIRS = 90_000  # of a point and a view that are looked at, about: of many views a share of the points is enough
# Precision of a view's last pose [1/rad^2], [1/m^2].
_DAMPED = np.repeat([1 / np.radians(2.0) ** 2, 1 / 0.01**2], 3)
_SLIDES = np.array([2, 3, 4])  # of a step: what leaves the table level
_BESIDE = 2  # pixels from one whose normal is taken to its neighbours
_SAME_WAY = 0.7  # cosine of two normals of one surface
_FLOOR = 1e-4  # of the surface: it is known no better [m]


@dataclass(frozen=True, eq=False)
class Sights:
    """Views and the surface that they are fitted to.

    images  with the poses that the cameras now have
    xyz     (N, 3) points of the surface with normals (N, 3)
    window  distances from it beyond which something else was measured [m]
    noise   standard deviation of depth at 1 m
    given   reported poses (V,) of the cameras
    middle  (3,) point about which views turn
    """

    images: Images
    xyz: Array
    normal: Array
    window: float
    noise: float
    given: Pose
    middle: Array

    def off(self) -> Array:
        """Return turns and shifts (V, 6) by which the views have left their reported poses."""
        move = Pose(Rotation.nearest(self.images.R), self.images.p) @ self.given.inverse()
        return np.concatenate([move.rotation.log(), move.apply(self.middle) - self.middle], axis=1)

    def after(self, steps: Array) -> Sights:
        """Return the views after steps (V, 6), turns [rad] and shifts [m]."""
        turn = np.asarray(Rotation.exp(steps[:, :3]).matrix)
        p = self.middle + np.einsum("vij,vj->vi", turn, self.images.p - self.middle) + steps[:, 3:]
        return replace(self, images=self.images._replace(R=turn @ self.images.R, p=p))

    def each_by_itself(self) -> tuple[Array, Array]:
        """Return Hessians (V, 6, 6) and gradients (V, 6) of half the squared distances from the surface."""
        H, g = _of_views(self.images, self.xyz, self.normal, self.middle, self.window, self.noise)
        return H / _ALIKE, g / _ALIKE

    def together(self) -> tuple[Array, Array]:
        """Return the Hessian (6 V, 6 V) and gradient (6 V,) of half the squared distances of the views from their mean.

        Of many points and views a share of the points is enough.
        """
        step = max(1, -(-len(self.xyz) * len(self.images.R) // _PAIRS))
        points = self.xyz[::step], self.normal[::step]
        g, own, mean_row = _together(self.images, *points, self.middle, self.window, self.noise)
        flat = mean_row.reshape(len(mean_row), -1)
        H = -(flat.T @ flat).reshape(*g.shape, *g.shape)
        each = np.arange(len(g))
        H[each, :, each] += own
        return H.reshape(g.size, g.size) * (step / _ALIKE), g.reshape(-1) * (step / _ALIKE)


def moved(sights: Sights, errors: PoseErrors, level: bool = False) -> Sights:
    """Return views that measure the surface, each fitted to it by itself, by what is believed of their poses.

    level  whether views have the table where it is: then they slide on it only

    Point-to-plane distances of the pixels that its points fall on, Huber-weighted, three Gauss-Newton steps.
    """
    free = _SLIDES if level else np.arange(6)
    for _ in range(_STEPS):
        H, g = sights.each_by_itself()
        pull = errors.precision * (errors.mean - sights.off())
        known = (H + np.diag(errors.precision))[:, free[:, None], free]
        steps = np.zeros(g.shape)
        steps[:, free] = np.linalg.solve(known, (pull - g)[:, free, None])[..., 0]
        sights = sights.after(steps)
    return sights


def moved_together(sights: Sights, errors: PoseErrors | None) -> Sights:
    """Return views that agree best, by what is believed of their poses; None where that tells less than the views do.

    They then stay near their last poses instead, step by step.
    """
    count = len(sights.images.R)
    information = np.eye(6 * count) * np.tile(_DAMPED, count) if errors is None else errors.information()
    for _ in range(_STEPS):
        off = np.zeros((count, 6)) if errors is None else sights.off()
        sights = sights.after(steps_together(sights, information, off))
    return sights


def steps_together(sights: Sights, information: Array, off: Array) -> Array:
    """Return steps (V, 6), turns [rad] and shifts [m], after which the views agree best.

    information  (6 V, 6 V) precision of poses that they are `off` (V, 6)
    """
    H, g = sights.together()
    # All together are free to go anywhere: they stay.
    H[np.diag_indices(len(H))] += 1.0
    steps = np.linalg.solve(H + information, -g - information @ off.reshape(-1)).reshape(-1, 6)
    return np.asarray(steps - steps.mean(0))


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _of_views(images: Images, xyz: Any, normal: Any, middle: Any, window: float, noise: float) -> Any:
    """Return Hessian (V, 6, 6) and gradient (V, 6) of half the squared distances of each view, in stds of depth."""
    images, xyz, normal = lent(images), borrowed(xyz), borrowed(normal)
    H, g, row = np.zeros((len(images.R), 6, 6)), np.zeros((len(images.R), 6)), np.empty(6)
    for k in range(len(images.R)):
        for i in range(len(xyz)):
            heard, over, sigma = measured(images, k, xyz[i], normal[i], row, middle, noise)
            if not heard or abs(over) > window:
                continue
            weight = weight_of(over, sigma)
            for r in range(6):
                g[k, r] += weight * row[r] * over
                for c in range(6):
                    H[k, r, c] += weight * row[r] * row[c]
    return H, g


@numba.njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def weight_of(over: float, sigma: float) -> float:
    """Return Huber's weight [1/m^2] of a distance `over` with standard deviation sigma [m]."""
    return 1 / sigma**2 * min(1.0, 2 * sigma / (abs(over) + 1e-12))


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _together(images: Images, xyz: Any, normal: Any, middle: Any, window: float, noise: float) -> Any:
    """Return what half the squared distances of the views from their mean change with their steps.

    Gradient (V, 6), and the Hessian as its blocks (V, 6, 6) as if the mean stood still, less the square of a matrix
    (N, V, 6): how the mean goes with the steps at each point.
    """
    images, xyz, normal = lent(images), borrowed(xyz), borrowed(normal)
    views = len(images.R)
    g, own, mean_row = np.zeros((views, 6)), np.zeros((views, 6, 6)), np.zeros((len(xyz), views, 6))
    row, over, weight = np.empty((views, 6)), np.empty(views), np.empty(views)
    for i in range(len(xyz)):
        total, mean = 0.0, 0.0
        for k in range(views):
            heard, over[k], sigma = measured(images, k, xyz[i], normal[i], row[k], middle, noise)
            weight[k] = weight_of(over[k], sigma) if heard and abs(over[k]) <= window else 0.0
            total += weight[k]
            mean += weight[k] * over[k]
        for k in range(views):
            if weight[k] > 0:
                for r in range(6):
                    g[k, r] += weight[k] * row[k, r] * (over[k] - mean / total)
                    mean_row[i, k, r] = weight[k] * row[k, r] / np.sqrt(total)
                    for c in range(6):
                        own[k, r, c] += weight[k] * row[k, r] * row[k, c]
    return g, own, mean_row


@numba.njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def measured(images: Images, k: int, x: Any, n: Any, row: Any, middle: Any, noise: float) -> Any:
    """Return whether view k faces a point x (3,) with normal n (3,), how high over it it measures and how surely [m].

    row  (6,) is filled with how that height changes with the step of the view
    """
    depth, unit, (fx, fy, cx, cy), R, p = images
    dx, dy, dz = x[0] - p[k, 0], x[1] - p[k, 1], x[2] - p[k, 2]
    cosine = -(dx * n[0] + dy * n[1] + dz * n[2]) / np.sqrt(dx * dx + dy * dy + dz * dz)
    if cosine < FACING:
        return False, 0.0, 1.0
    z, u, v = pixel_of(images, k, x)
    if u < _BESIDE or v < _BESIDE or u >= depth.shape[2] - _BESIDE or v >= depth.shape[1] - _BESIDE:
        return False, 0.0, 1.0
    m = depth[k, v, u] * unit
    a, b = (u - cx) / fx, (v - cy) / fy
    if m == 0 or not _faces_alike(images, k, u, v, a, b, m, n, noise):
        return False, 0.0, 1.0
    a, b = m * a, m * b
    over = 0.0
    for c in range(3):
        at = R[k, c, 0] * a + R[k, c, 1] * b + R[k, c, 2] * m + p[k, c]
        over += n[c] * (at - x[c])
        row[3 + c] = at - middle[c]
    ax, ay, az = row[3], row[4], row[5]
    row[0], row[1], row[2] = ay * n[2] - az * n[1], az * n[0] - ax * n[2], ax * n[1] - ay * n[0]
    row[3], row[4], row[5] = n[0], n[1], n[2]
    return True, over, noise * z * z * cosine + _FLOOR


@numba.njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _faces_alike(images: Images, k: int, u: int, v: int, a: float, b: float, m: float, n: Any, noise: float) -> bool:
    """Whether the surface at pixel (u, v), of depth m [m], faces about as n (3,) does.

    What stands before a point is nearer, but may be no farther off its plane than the window.
    """
    faces, x, y, z = normal_of(images, k, u, v, a, b, m, _BESIDE, noise)
    return bool(faces and x * n[0] + y * n[1] + z * n[2] > _SAME_WAY * np.sqrt(x * x + y * y + z * z))
