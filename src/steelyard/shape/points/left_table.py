"""A table that was left in a cloud: one flat sheet of points, bare for the most part, with all else on one side."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array, Mask
from steelyard.findings import Finding
from steelyard.spatial import area_vectors, unit_vectors

_DRAWS, _VOTERS = 200, 500  # planes through three points that are tried, and points that vote
_THICK = 0.75  # spacings from the plane to either side that still are the table
_SHARE = 0.2  # of the points, at least, lie on a table
_OTHERS, _ASTRAY = 20, 0.03  # points that stand on it, at least; share of them that may lie below it
_CELL = 3.0  # spacings: side of the squares that a table is covered with
_BARE = 0.4  # of the squares, at least, have nothing above or below them
_NEXT = 6  # neighbour whose distance tells how dense points are
_EVEN = 0.01  # spacings: heights nearer than this are one
_TWO_HEIGHTS = 2.3  # mean fourth power of heights over the squared mean square: 3 for noise, 1 for two heights
_DENSE = 0.85  # of that distance on the object, at least, on a table; seen from above, a plate of two sheets has 0.71


def left_table(xyz: Array, spacing: float) -> Finding | None:
    """Return the finding `table-in-cloud` where points (N, 3) [m], `spacing` [m] apart, show a table under an object.

    No closed surface looks so: over every place of its underside there is an upper side. Where that is nearer than
    points are apart, as of a thin plate, there are twice as many points.
    """
    on = _largest_plane(xyz, spacing)
    share = float(on.mean())
    if share < _SHARE or (~on).sum() < _OTHERS:
        return None
    flat = _about_plane(xyz, xyz[on])
    above = float((flat[~on, 2] > 0).mean())
    if _ASTRAY < above < 1 - _ASTRAY:
        return None
    squares = np.floor(flat[:, :2] / (_CELL * spacing)).astype(np.int64)
    squares, square = np.unique(squares, axis=0, return_inverse=True)
    taken = np.bincount(square.ravel()[~on], minlength=len(squares)) > 0
    held = np.bincount(square.ravel()[on], minlength=len(squares)) > 0
    bare = float((~taken[held]).mean())
    alone = on & ~taken[square.ravel()]
    if bare < _BARE or _two_sheets(flat[alone], _reach(xyz[~on]), spacing):
        return None
    text = (
        f"{100 * share:.0f} % of the points lie in one plane, {100 * bare:.0f} % of it bare, with all others on one "
        "side: they look like a table under an object, and are taken for a part of it."
    )
    return Finding.of("table-in-cloud", text)


def _about_plane(points: Array, on: Array) -> Array:
    """Return points (N, 3) about the plane through those `on` it (P, 3): along, across, height."""
    middle = on.mean(0)
    return np.asarray((points - middle) @ np.linalg.svd(on - middle, full_matrices=False)[2].T)


def _two_sheets(flat: Array, elsewhere: float, spacing: float) -> bool:
    """Return whether points near a plane (P, 3) lie on two sheets: dense, or of two heights."""
    flat = _about_plane(flat, flat)
    square = float((flat[:, 2] ** 2).mean())
    two_heights = square > (_EVEN * spacing) ** 2 and float((flat[:, 2] ** 4).mean()) < _TWO_HEIGHTS * square**2
    return two_heights or _reach(flat[:, :2]) < _DENSE * elsewhere


def _reach(points: Array) -> float:
    """Return how far off a neighbour some ranks away is, in the middle of points (N, 2 or 3)."""
    from scipy.spatial import cKDTree

    return float(np.median(cKDTree(points).query(points, [min(_NEXT + 1, len(points))])[0]))


def _largest_plane(xyz: Array, spacing: float) -> Mask:
    """Return which points lie on the plane that holds the most of them, of those through three points drawn."""
    rng = np.random.default_rng(0)
    corners = xyz[rng.integers(len(xyz), size=(_DRAWS, 3))]
    normals = unit_vectors(area_vectors(corners))
    offset = np.einsum("di,di->d", normals, corners[:, 0])
    voters = xyz[rng.permutation(len(xyz))[:_VOTERS]]
    votes = (np.abs(voters @ normals.T - offset) < _THICK * spacing).sum(0)
    best = int(np.argmax(votes))
    on = np.abs(xyz @ normals[best] - offset[best]) < 2 * _THICK * spacing
    return np.asarray(np.abs(_about_plane(xyz, xyz[on])[:, 2]) < _THICK * spacing)
