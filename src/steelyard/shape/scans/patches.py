"""Patches of surface that the views measure, and points of it settled among them."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.shape.points.medians import middle_half_std
from steelyard.shape.points.thinning import in_cubes, spread_to
from steelyard.shape.scans import sight_lines, surfel_pass
from steelyard.shape.scans.region import REACHES, STRIDE, Region, heights
from steelyard.shape.scans.scene import WINDOW, Scene

_NORMAL_STEP = 2  # pixels from one whose normal is taken to its neighbours
_SEEDS = 4  # points that are settled, for each that stays
_CUBE = 8  # pixel widths: points of one cube are looked up in the images one after the other
_NEARLY = 0.9  # of an object's height: the mean over the cell of its top, its sides included


def surfels(scene: Scene, region: Region) -> Array:
    """Return patches (N, 8) of the object and of the table around it."""
    cell = region.grid.pitch
    floor = -4 * scene.sigma - 2 * cell
    layers = int((_top(scene, region) - floor) / cell) + 2
    # Where few images hold an end of it, all of their pixels are needed.
    stride = 1 if region.cut else STRIDE
    where = region.mask, region.grid.low, cell
    found = surfel_pass.surfels(scene.images, stride, _NORMAL_STEP, *where, floor, layers, scene.noise)
    found = np.asarray(found[found[:, 7] >= scene.enough])
    if not len(found):
        raise no_surface()
    return found


def _top(scene: Scene, region: Region) -> float:
    """Return how high patches are looked for [m]: as usual things reach, or most of the pixels of a cell.

    Pixels that fly past edges are measured anywhere up to the cameras.
    """
    usual = REACHES[0] * scene.distance
    if region.highest <= usual:
        return region.highest
    grid, high = heights(scene)
    tall = high > usual * _NEARLY
    tallest = high[tall][region.holds(grid.spots(tall))].max(initial=0.0)
    return min(region.highest, max(usual, float(tallest) / _NEARLY))


def no_surface() -> CannotAnswer:
    """Return the error of views that agree on nothing."""
    return CannotAnswer("no object was found on the table: the views agree on no surface there.")


def settled(scene: Scene, xyz: Array, normal: Array, window: float, rounds: int) -> Array:
    """Move points (N, 3) along their normals to what the views measure; return support (N, 3) as there."""
    order = in_cubes(xyz, _CUBE * scene.pixel)
    moved, support = xyz[order], np.empty((len(xyz), 3))
    support[order] = sight_lines.settled(scene.images, moved, normal[order], window, scene.noise, rounds)
    xyz[order] = moved
    return support


def well_spread(patches: Array, points: int, apart: float) -> Array:
    """Return about so many of patches (N, 8), those of most pixels first, `apart` [m]."""
    order = np.argsort(-patches[:, 6], kind="stable")
    return np.asarray(patches[spread_to(patches[:, :3], patches[:, 3:6], order, points, apart)[0]])


def settled_patches(scene: Scene, patches: Array, window: float, rounds: int) -> tuple[Array, Array, Array]:
    """Return points, normals and support (N, 3) of patches (N, 8) moved to what the views measure."""
    xyz, normal = patches[:, :3].copy(), patches[:, 3:6].copy()
    return xyz, normal, settled(scene, xyz, normal, window, rounds)


def surface_of(scene: Scene, patches: Array, region: Region, points: int) -> tuple[Array, Array]:
    """Return points (N, 3) of the object's surface and normals, settled among the views, the table around it level 0.

    CannotAnswer where nothing stands out of that.
    """
    mask = region.mask
    xyz, normal, support = settled_patches(scene, well_spread(patches, _SEEDS * points, scene.pixel), WINDOW, 2)
    good = (support[:, 0] >= scene.enough) & (support[:, 1] <= 0.5 * support[:, 0])
    table = good & (normal[:, 2] > 0.9) & (np.abs(xyz[:, 2]) < 4 * scene.sigma)
    level, rough = 0.0, 0.1 * scene.sigma
    object_cells = ndimage.binary_erosion(mask, np.ones((3, 3)), iterations=3)
    around = table & ~object_cells[region.grid.cells_under(xyz)[0]]
    if around.sum() >= 20:
        level = float(np.median(xyz[around, 2]))
        rough = middle_half_std(xyz[around, 2])
    xyz[:, 2] -= level
    scene.p[:, 2] -= level
    keep = good & (xyz[:, 2] > 5 * rough)
    if keep.sum() < 20:
        raise CannotAnswer("no object was found on the table: nothing stands out of it once the views are fused.")
    return xyz[keep], normal[keep]
