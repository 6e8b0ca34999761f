"""The underside of a thing that seems to rest on nothing, as thin round things do: as round below as it is above.

Nearer to the table than a few times the depth noise no sight line shows how the side of a rod curls under, and the
underside goes on flat from where it was last seen: a rod of 12 mm lost a fifth of its volume, and touched the table
nowhere. What rises from its rim is then taken to fall as far below, but never into space that was seen to be empty; a
flat top leaves its underside as it is. What is filled so may be air, as under a dome on low feet: the volume's bar
holds it. What comes down to the table somewhere may well hang elsewhere, and is left alone.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import ndimage

from steelyard.check import Array
from steelyard.shape.scans.underside import Underside, median_along, rim_of

_TOUCHES, _RESTS = 0.5, 0.1  # times the depth noise, share of the underside that is so low where something rests
_NEAR = 6.0  # times the depth noise: a side that was last seen nearer to the table hides how it goes on
_LEAST = 0.05  # of the volume: less may be dents in what is flat, rods lose more
_BLUR = 1.0  # cells over which what falls is averaged


def round_below(bottom: Underside, xyz: Array, sigma: float) -> Underside:
    """Return the underside of what rests on nothing, what rises from its rim falling as far below.

    xyz    (N, 3) the seen surface, in the table's frame
    sigma  depth noise [m]
    """
    under = bottom.under
    top = np.full(under.shape, -np.inf)
    np.maximum.at(top, bottom.grid.cells_under(xyz)[0], xyz[:, 2])
    rim = rim_of(under) & np.isfinite(top)
    if not rim.any() or (bottom.height[under] < _TOUCHES * sigma).mean() > _RESTS:
        return bottom
    height = np.where(under, bottom.height, 0.0)
    top = np.where(np.isfinite(top), top, np.where(under, bottom.top, 0.0))
    nearest = tuple(ndimage.distance_transform_edt(~rim, return_distances=False, return_indices=True))
    both = median_along(height + np.where(rim, top, 0.0), rim)[nearest]
    near = under & ~bottom.seen & (height[nearest] < _NEAR * sigma)
    fall = np.where(near, np.clip(height - np.maximum(both - top, bottom.empty), 0.0, height), 0.0)
    weight = ndimage.gaussian_filter(under.astype(float), _BLUR)
    fall = np.where(near, ndimage.gaussian_filter(fall, _BLUR) / np.maximum(weight, 1e-9), 0.0)
    if fall.sum() < _LEAST * (bottom.top - height)[under].sum():
        return bottom
    height = np.maximum(height - fall, 0.0)
    return replace(bottom, height=np.where(under, height, np.inf), filled=float(fall.sum()) * bottom.grid.pitch**2)
