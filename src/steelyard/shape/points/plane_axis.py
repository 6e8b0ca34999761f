"""The axis along which points spread least: the normal of the plane through them."""

from __future__ import annotations

import math

import numba


@numba.njit(cache=True, nogil=True)
def least_axis(xx: float, xy: float, xz: float, yy: float, yz: float, zz: float) -> tuple[float, float, float]:
    """Return the unit axis of the least spread of a covariance.

    Source: Smith 1961, eigenvalues of a symmetric 3 x 3 matrix.
    """
    mean = (xx + yy + zz) / 3
    size = (xx - mean) ** 2 + (yy - mean) ** 2 + (zz - mean) ** 2 + 2 * (xy * xy + xz * xz + yz * yz)
    size = math.sqrt(size / 6)
    if size == 0:
        return 0.0, 0.0, 1.0
    xx, yy, zz, xy, xz, yz = (xx - mean) / size, (yy - mean) / size, (zz - mean) / size, xy / size, xz / size, yz / size
    half = (xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)) / 2
    least = 2 * math.cos(math.acos(min(1.0, max(-1.0, half))) / 3 + 2 * math.pi / 3)
    xx, yy, zz = xx - least, yy - least, zz - least
    bx, by, bz, most = 0.0, 0.0, 1.0, 1e-24
    for k in range(3):  # the axis is across any two rows; the longest product is the surest
        if k == 0:
            ux, uy, uz = xy * yz - xz * yy, xz * xy - xx * yz, xx * yy - xy * xy
        elif k == 1:
            ux, uy, uz = xy * zz - xz * yz, xz * xz - xx * zz, xx * yz - xy * xz
        else:
            ux, uy, uz = yy * zz - yz * yz, yz * xz - xy * zz, xy * yz - yy * xz
        found = ux * ux + uy * uy + uz * uz
        if found > most:
            bx, by, bz, most = ux, uy, uz, found
    length = math.sqrt(bx * bx + by * by + bz * bz)
    return bx / length, by / length, bz / length
