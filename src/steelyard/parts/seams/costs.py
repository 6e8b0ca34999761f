"""What joining two clusters costs: how hollow they are together, how much of a seam lies between, what is painted."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np

STRAIGHT, CREASED = 0.07, 0.25  # mean turn [rad] across a border that is no seam, and that is one
NECK, FLANK = 1.0, 2.0  # contact area over (volume of the smaller)^(2/3): a cube cut in half has 1.6
POINT = 0.02  # the same where two clusters only touch in a point or along an edge
PAINT = 10.0  # cost of painting over all of the surface: a hundredth of it is worth a part
FAR = 3.0  # bits of one colour that do not touch: three hundredths of the surface are worth a part of their own
_SIZE = 0.02  # small clusters first
_STAGE = 100.0  # first what touches in one colour, then all of one colour, then colours
# Columns of the table of contacts between two clusters.
AREA, VECTOR, LENGTH, TURN, BEHIND = 0, 1, 4, 10, 16  # scalar, 3 and three times 6 numbers
WIDTH = 22


@numba.njit(cache=True, nogil=True)
def support_of(row: Any, smaller: float) -> float:
    """Return how much of a seam, 0..1, the contact `row` (22,) is: creased around, a neck of the smaller cluster."""
    area, length = row[AREA], row[LENGTH] + row[LENGTH + 1] + row[LENGTH + 2]
    if area <= POINT * smaller ** (2 / 3):
        return 1.0 / FAR
    if length <= 0:
        return 0.0
    neck = (FLANK - area / smaller ** (2 / 3)) / (FLANK - NECK)
    if neck <= 0:
        return 0.0
    x, y, z = row[VECTOR] / area, row[VECTOR + 1] / area, row[VECTOR + 2] / area
    straight = x * x + y * y + z * z  # 1 where the contact is plane, 0 where it goes all around
    # Along the normal of a plane contact; any way across the border where there is no such normal.
    plane = min(max((np.sqrt(straight) - 0.2) / 0.3, 0.0), 1.0)
    if straight > 0:
        x, y, z = x / np.sqrt(straight), y / np.sqrt(straight), z / np.sqrt(straight)
    # What a wall turns up inside and down outside is a bend.
    turn = _along(row, TURN, x, y, z, plane) + min(_along(row, BEHIND, x, y, z, plane), 0.0)
    over = max(_along(row, LENGTH, x, y, z, plane), 1e-3 * length)
    crease = (turn / over - STRAIGHT) / (CREASED - STRAIGHT)
    return float(min(max(crease, 0.0), 1.0) * min(neck, 1.0))


@numba.njit(cache=True, nogil=True, forceinline=True)
def _along(row: Any, first: int, x: float, y: float, z: float, plane: float) -> float:
    """Return the sum over a border, along a direction where its contact is plane (1), of all ways across where not."""
    along = (
        x * x * row[first] + y * y * row[first + 1] + z * z * row[first + 2]
        + 2 * (x * y * row[first + 3] + x * z * row[first + 4] + y * z * row[first + 5])
    )  # fmt: skip
    return float(plane * along + (1 - plane) * (row[first] + row[first + 1] + row[first + 2]))


@numba.njit(cache=True, nogil=True)
def price_of(hull: float, support: float, va: float, vb: float, paint: float, stage: int) -> tuple[float, float]:
    """Return what orders a merge, and its seam: what a part that holds both sides costs.

    stage  0 one colour and touching, 1 one colour and apart, 2 two colours
    """
    if stage == 1:
        return _STAGE + paint / FAR, paint / FAR
    hollow = max(0.0, hull - va - vb)
    seam = min(hollow, paint) * support
    price = hollow * (0.1 + support) + _SIZE * (va + vb)
    return (price, seam) if stage == 0 else (2 * _STAGE + price + paint, seam + paint)
