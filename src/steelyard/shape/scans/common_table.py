"""Poses that are clearly off: every view saw the same table, and the same things standing on it.

A table tells height and tilt of every view, three of six numbers, far better than an arm and its hand-eye calibration
do. What stands on it tells the rest, coarsely here and finely in `registration`.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from scipy import ndimage

from steelyard.check import Array
from steelyard.shape.scans.scene import Scene
from steelyard.shape.scans.table_plane import table_frame
from steelyard.shape.scans.view_planes import lowest_planes, noise_of, table_planes
from steelyard.shape.views import TablePlane
from steelyard.spatial import Rotation

_SAMPLES = (60_000, 600_000)  # pixels that tell the table, and what stands on it
_FAR = 0.1  # of the camera's distance: so far from where all views together have the table one may have it
_TRIES = 200  # planes of a view
_CLEAR = 3.0  # times the depth noise: what is further off a plane is not on it
_THIN = 0.005  # of the camera's distance: nor is this, since noise may have been taken from tables that lie askew
_ON = 1.5  # of those: points that a plane is fitted to
_ROUNDS = 2  # the second with the noise that the first found
ACROSS = 0.25  # of the camera's distance: so far from the middle a tilt is judged by what it lifts
_LEVEL = 0.25  # of the depth noise: tables that are less off are level
_STEEPEST = np.tan(np.radians(8.0))  # tilt of a view's table that no arm's error explains
_MOST = 0.75  # share of the views that must show the table
_ALIKE = 0.1  # of the distance of two tables: so far off either of them views may have theirs
_LEAST_VIEWS = 4  # that show either of two tables
_REACH = 0.5  # of the camera's distance: how far from where the cameras look things are compared
_CAP = 0.02  # of the camera's distance: heights beyond it count alike, so that walls make no ramps in oblique views
_BLURS = (0.020, 0.020, 0.014, 0.014, 0.010, 0.010, 0.007, 0.007, 0.005, 0.005, 0.005, 0.005)  # of the heights [m]
_CELLS = 2.5  # of the map of heights in a blur
_PULL = 0.02  # of what heights tell of a usual view: so much holds it where it is
_SEEN = 0.05  # pixels in a cell, blurred, from which on its height counts as known


def levelled(scene: Scene) -> float | None:
    """Turn and lift views until the table is level in each; return how far off they had it, rms [m].

    Zero, and no camera moved, where that is far less than the depth noise; None where too few views show a table. Where
    something is moved, views without a table are left out: nobody knows where they are. Depth is then found less noisy
    than the table as all views together had it seemed to say.
    """
    planes = _tables(scene)
    if not _shown(scene, planes):
        return None
    if (step := _two_tables(scene, planes)) > 0:
        scene.floor = -step / 2
        planes = _tables(scene)
    if _is_level(scene, planes):
        return 0.0
    # What all have alike is no view's error: a wide object passed for the table.
    laid(scene, np.median(planes[:, 1:4], axis=0))
    planes = _tables(scene)
    if not _shown(scene, planes):
        return None
    if _is_level(scene, planes):
        return 0.0
    off = _off(scene, planes)
    for _ in range(_ROUNDS):
        _level(scene, planes)
        scene.noise = min(scene.noise, noise_of(planes, scene.views.depth_unit, scene.distance))
        planes = _tables(scene)
    scene.keep(planes[:, 0].astype(int))
    return off


def _two_tables(scene: Scene, planes: Array) -> float:
    """Return how far under the table of most views another one lies that shows in some [m], 0 where there is none.

    Wrong poses put the table anywhere; a board on a table, at its own height or the board's.
    """
    height = planes[:, 1]
    under = height[height < -2 * _THIN * scene.distance]
    step = -float(np.median(under)) if len(under) else 0.0
    alike = max(_ALIKE * step, scene.sigma)
    at_either = [(np.abs(height - level) < alike).sum() for level in (0.0, -step)]
    return step if min(at_either) >= _LEAST_VIEWS and sum(at_either) >= _MOST * len(height) else 0.0


def _shown(scene: Scene, planes: Array) -> bool:
    """Whether enough views show a table to go by."""
    return len(planes) >= _MOST * len(scene.R)


def _is_level(scene: Scene, planes: Array) -> bool:
    """Whether there is nothing to mend."""
    return _off(scene, planes) < _LEVEL * scene.sigma


def laid(scene: Scene, plane: Array) -> None:
    """Take the plane of height a + b x + c y (3,) for the table: the cameras stay where they are in W."""
    normal = np.array([-plane[1], -plane[2], 1.0]) / np.sqrt(1 + plane[1:] @ plane[1:])
    on_it = table_frame(TablePlane(normal, float(plane[0] * normal[2])), np.zeros(3))
    back = on_it.inverse()
    scene.X_WT = scene.X_WT @ on_it
    scene.R, scene.p = np.ascontiguousarray(back.rotation.matrix @ scene.R), back.apply(scene.p)


def _off(scene: Scene, planes: Array) -> float:
    """Return by how much planes (K, 5) are off the level, `ACROSS` the middle on both sides: rms [m]."""
    return float(np.sqrt((planes[:, 1:4] ** 2 @ [1.0, *[(ACROSS * scene.distance) ** 2] * 2]).mean()))


def _level(scene: Scene, planes: Array) -> None:
    """Turn and lift the views that have the table as planes (K, 5) until it is level."""
    view, (height, *slope) = planes[:, 0].astype(int), planes[:, 1:4].T
    normal = np.stack([-slope[0], -slope[1], np.ones(len(view))], axis=1)
    long = np.linalg.norm(normal, axis=1)
    turned = np.cross(normal / long[:, None], [0.0, 0.0, 1.0])
    over = scene.p[view, 2] - height - slope[0] * scene.p[view, 0] - slope[1] * scene.p[view, 1]
    # About the camera itself: so a wrong orientation, the worst of the errors at the object, is undone whole.
    scene.R[view] = Rotation.exp(turned).matrix @ scene.R[view]
    scene.p[view, 2] = over / long


def _tables(scene: Scene) -> Array:
    """Return the table as the views have it (K, 5), see `table_planes`; views without one are left out.

    The lowest plane of each, fitted to the points on it: so an object as wide as the table in view does not lift it.
    """
    sampled = scene.sampled(_SAMPLES[0])
    sampled = sampled[sampled[:, 2] > scene.floor] if np.isfinite(scene.floor) else sampled
    clear = min(_CLEAR * scene.sigma, _THIN * scene.distance)
    drawn = np.random.default_rng(0).random((_TRIES, 3))
    lowest = lowest_planes(sampled, _FAR * scene.distance, clear, _STEEPEST, drawn)
    rough = np.tile([np.inf, 0.0, 0.0], (len(scene.R), 1))
    rough[lowest[:, 0].astype(int)] = lowest[:, 1:]
    xyz, own = sampled[:, :3].copy(), rough[sampled[:, 4].astype(int)]
    xyz[:, 2] -= own[:, 0] + (own[:, 1:] * xyz[:, :2]).sum(1)
    planes = table_planes(sampled, xyz, _ON * clear)
    planes[:, 1:4] += rough[planes[:, 0].astype(int)]
    return np.asarray(planes[np.hypot(planes[:, 2], planes[:, 3]) < _STEEPEST])


def slid(scene: Scene) -> None:
    """Slide and turn level views on the table until they have the same heights on it.

    Every view by itself, to the mean of all by Gauss and Newton, from wide blurs to narrow ones. It finds its way from
    afar and ends a millimetre or two off: a view sees what faces it, and the mean is of both sides.
    """
    sampled = scene.sampled(_SAMPLES[1])
    half, cap = _REACH * scene.distance, max(6 * scene.sigma, _CAP * scene.distance)
    sampled = sampled[(np.abs(sampled[:, :2]) < half).all(1)]
    start, view = sampled[:, :2], sampled[:, 4].astype(np.int64)
    now = np.column_stack([start, sampled[:, 2].clip(-cap, cap)])
    moved = np.zeros((len(scene.R), 3))
    for blur in _BLURS:
        pitch = blur / _CELLS
        count, total = ndimage.gaussian_filter(
            _mapped(now, half, pitch), (0, _CELLS, _CELLS), mode="constant", output=np.float64
        )
        mean = np.where(count > _SEEN, total / np.maximum(count, _SEEN), np.nan)
        H, g = _normal_equations(now, view, len(moved), mean, half, pitch, 0.25 * cap)
        pull = _PULL * np.median(H[:, 0, 0] + H[:, 1, 1]) * np.array([1.0, 1.0, half**2])
        moved -= np.linalg.solve(H + np.diag(pull + 1e-12), (g + pull * moved)[..., None])[..., 0]
        # The whole is free to slide: it stays where it is.
        moved -= moved.mean(0)
        now[:, :2] = np.einsum("nij,nj->ni", _turns(moved)[view, :2, :2], start) + moved[view, :2]
    scene.R = np.ascontiguousarray(_turns(moved) @ scene.R)
    scene.p = np.einsum("vij,vj->vi", _turns(moved), scene.p)
    scene.p[:, :2] += moved[:, :2]


def _turns(moved: Array) -> Array:
    """Return the rotations (V, 3, 3) about the vertical of steps (V, 3) x, y [m] and angle [rad]."""
    return np.asarray(Rotation.exp(moved[:, 2:] * np.array([0.0, 0.0, 1.0])).matrix)


def _mapped(points: Array, half: float, pitch: float) -> Array:
    """Return the number of points (N, 3) in every cell of the table, and the sum of their heights: (2, I, I)."""
    size = int(2 * half / pitch) + 1
    cell = ((points[:, :2] + half) / pitch).astype(int)
    within = ((cell >= 0) & (cell < size)).all(1)
    place = cell[within] @ [size, 1]
    maps = [np.bincount(place, weights, size * size) for weights in (None, points[within, 2])]
    return np.asarray(maps, float).reshape(2, size, size)


@numba.njit(cache=True, nogil=True)
def _normal_equations(
    points: Any, view: Any, views: int, mean: Any, half: float, pitch: float, huber: float
) -> tuple[Any, Any]:
    """Return Hessian (V, 3, 3) and gradient (V, 3), per view, of half the squares of the mean (I, I) less heights.

    For steps x, y [m] and angle [rad] of the view. Differences beyond `huber` [m] weigh less; nan is not known.
    """
    H, g, row = np.zeros((views, 3, 3)), np.zeros((views, 3)), np.zeros(3)
    for n in range(len(points)):
        x, y = (points[n, 0] + half) / pitch - 0.5, (points[n, 1] + half) / pitch - 0.5
        i, j = int(np.floor(x)), int(np.floor(y))
        if i < 0 or j < 0 or i + 1 >= len(mean) or j + 1 >= len(mean):
            continue
        a, b = x - i, y - j
        along, across = mean[i + 1, j] - mean[i, j], mean[i, j + 1] - mean[i, j]
        bent = mean[i + 1, j + 1] - mean[i, j] - along - across
        left = mean[i, j] + a * along + b * across + a * b * bent - points[n, 2]
        if np.isnan(left):
            continue
        row[0], row[1] = (along + b * bent) / pitch, (across + a * bent) / pitch
        row[2] = row[1] * points[n, 0] - row[0] * points[n, 1]
        weight = min(1.0, huber / (abs(left) + 1e-12))
        for r in range(3):
            g[view[n], r] += weight * row[r] * left
            for c in range(3):
                H[view[n], r, c] += weight * row[r] * row[c]
    return H, g
