"""Objects that run over the edges of the images: the cloud then ends where the images do."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding
from steelyard.shape.scene import Scene

_LOOKED_AT = 1000  # points of the surface
_ENDS = 1.0  # per cent of them: those that the fewest images hold
# A spot that fewer images hold than this may be the last that enough views see: one view in four sees a given spot, and
# three must. Of few views three fifths, of many a fifth is little for an arc around the object.
_HELD, _OF_FEW, _OF_MANY = 12.0, 0.6, 0.2


def cut_off(scene: Scene, xyz: Array) -> Finding | None:
    """Return that the surface (N, 3) in the table's frame ends where images do; None where they hold all of it."""
    count = len(scene.R)
    held = float(np.percentile(_images_that_hold(scene, xyz[:: max(1, len(xyz) // _LOOKED_AT)]), _ENDS))
    if held > max(min(_HELD, _OF_FEW * count), _OF_MANY * count):
        return None
    text = f"Ends of the object lie in only {held:.0f} of {count} images: it may go on where no image shows it."
    return Finding.of("object-cut", text)


def _images_that_hold(scene: Scene, xyz: Array) -> Array:
    """Return how many images (N,) each point (N, 3) falls into."""
    lens = scene.views.intrinsics
    x, y, z = np.moveaxis(np.einsum("vij,nvi->nvj", scene.R, xyz[:, None] - scene.p), -1, 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        column, row = lens.cx + lens.fx * x / z, lens.cy + lens.fy * y / z
    inside = (np.abs(column + 0.5 - lens.width / 2) < lens.width / 2) & (
        np.abs(row + 0.5 - lens.height / 2) < lens.height / 2
    )
    return np.asarray((inside & (z > 0)).sum(1))
