"""Objects that run over the edges of the images: the cloud then ends where the images do."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from steelyard.check import Array
from steelyard.findings import Finding
from steelyard.shape.scans.scene import Scene
from steelyard.spatial import unit_vectors

# A spot that fewer images hold than this may be the last that enough views see: one view in four sees a given spot, and
# three must. Of few views three fifths, of many a quarter is little for an arc around the object.
_HELD, _OF_FEW, _OF_MANY = 15.0, 0.6, 0.25
_BESIDE, _SPACINGS = 10.0, 3.0  # pixel widths, distances of points: how far beside the surface it is asked for more
_WAYS = 16  # in which that is asked
_COVERED = 0.6  # of the way: a point of the surface so near is what goes on there
_SAMPLED = 500  # points that tell how far apart they are
_ENDS, _FEWEST = 0.001, 4  # of the surface, but no fewer points: an end


def cut_off(scene: Scene, xyz: Array, normal: Array) -> Finding | None:
    """Return that the surface (N, 3) in the table's frame ends where images do; None where they show that it ends.

    normal  (N, 3)

    Where few images hold the surface it is asked all around its points whether it goes on: there is more of it, or
    views see past that spot; if not, and more of them measure something there or too few look, it may.
    """
    count = len(scene.R)
    rows = np.flatnonzero(scene.held(xyz)[:, 0] <= max(min(_HELD, _OF_FEW * count), _OF_MANY * count))
    rows = rows[_open(scene, xyz, xyz[rows], normal[rows])] if len(rows) else rows
    if len(rows) < max(_FEWEST, _ENDS * len(xyz)):
        return None
    held = float(np.median(scene.held(xyz[rows])[:, 0]))
    text = f"Ends of the object lie in only {held:.0f} of {count} images: it may go on where no image shows it."
    return Finding.of("object-cut", text)


def _open(scene: Scene, xyz: Array, ends: Array, normal: Array) -> Array:
    """Return which of points `ends` (M, 3) with normals (M, 3) the surface, all of xyz (N, 3), may go on from."""
    tree = cKDTree(xyz)
    apart = float(np.median(tree.query(xyz[:: max(1, len(xyz) // _SAMPLED)], 2)[0][:, 1]))
    way = max(_BESIDE * scene.pixel, _SPACINGS * apart)
    spots = _around(ends, normal, way)
    found = spots[..., 2] > 3 * scene.sigma
    found[found] = tree.query(spots[found])[0] > _COVERED * way
    past, on = scene.sights(spots[found]).T
    held, least = scene.held(spots[found])[:, 0], scene.enough
    found[found] = (past < least) & ((on > past) | (held < least))
    return np.asarray(found.any(1))


def _around(xyz: Array, normal: Array, way: float) -> Array:
    """Return spots (N, K, 3) all around points (N, 3), as far along the surface with normals (N, 3)."""
    aside = unit_vectors(np.cross(normal, np.eye(3)[np.abs(normal).argmin(1)]))
    angle = 2 * np.pi * np.arange(_WAYS)[:, None, None] / _WAYS
    return np.asarray((xyz + way * (np.cos(angle) * aside + np.sin(angle) * np.cross(normal, aside))).swapaxes(0, 1))
