"""Colours of the points of a scan, as the views show them where they do not mix with the table."""

from __future__ import annotations

from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.shape.points.spacing import nearest
from steelyard.shape.scans import sight_lines
from steelyard.shape.scans.scene import WINDOW, Scene

_CLEAR = 3.0  # times the depth noise: what is measured higher than this above the table is not the table
_TABLE_SAMPLES, _NEARLY_ALL = 20_000, 90  # pixels that tell the table's colour, and per cent of them that have it
_ALIKE = 12.0  # levels between colours that look the same, at least


def colours_of(scene: Scene, xyz: Array, normal: Array, seen: int) -> tuple[Any, Any]:
    """Return colours (N, 3), and which of them (N,) the views show: of the first `seen` points, those that do not mix
    with the table. The rest have the colour of the nearest of those. Views without colour show the first `seen`.
    """
    if (images_rgb := scene.views.rgb) is None:
        return None, np.arange(len(xyz)) < seen
    shown, rgb = np.zeros(len(xyz), bool), np.zeros((len(xyz), 3), np.uint8)
    clear, enough = _CLEAR * scene.sigma, scene.enough
    rgb[:seen], shown[:seen] = sight_lines.colours(
        images_rgb, scene.images, xyz[:seen], normal[:seen], WINDOW, scene.noise, clear, enough
    )
    # What lies as low as the table and looks like it may be its fringe.
    shown &= (xyz[:, 2] > 2 * clear) | ~_like_table(scene, clear, rgb)
    if not shown.any():
        return rgb, None
    if not shown.all():
        rgb[~shown] = rgb[shown][nearest(xyz[shown], xyz[~shown])]
    return rgb, shown


def _like_table(scene: Scene, clear: float, rgb: Any) -> Any:
    """Return which colours (N, 3) are as near to the table's median as nearly all of the table is."""
    table = scene.sampled_rgb(_TABLE_SAMPLES)[np.abs(scene.sampled(_TABLE_SAMPLES)[:, 2]) < clear]
    if not len(table):
        return np.zeros(len(rgb), bool)
    middle = np.median(table, axis=0)
    reach = float(np.percentile(np.linalg.norm(table - middle, axis=1), _NEARLY_ALL))
    return np.linalg.norm(rgb - middle, axis=1) < max(2 * reach, _ALIKE)
