"""The determinant of four points with its true sign: on which side of a plane a point lies, without doubt.

Source: Shewchuk 1997, "Adaptive precision floating-point arithmetic and fast robust geometric predicates": exact sums
and products of two numbers, and sums kept in parts that do not overlap.
"""

from __future__ import annotations

import numba
import numpy as np

from steelyard.check import Array
from steelyard.shape.hulls.borrowed import integer

_SPLIT = 134217729.0  # 2^27 + 1, halves the digits of a double


@numba.njit(cache=True, nogil=True)
def _product(a: float, b: float) -> tuple[float, float]:
    """Return a b as a sum of two numbers, exactly."""
    p = a * b
    t = _SPLIT * a
    a1 = t - (t - a)
    a2 = a - a1
    t = _SPLIT * b
    b1 = t - (t - b)
    b2 = b - b1
    return p, a2 * b2 - (((p - a1 * b1) - a2 * b1) - a1 * b2)


@numba.njit(cache=True, nogil=True)
def _difference(a: float, b: float) -> tuple[float, float]:
    """Return a - b as a sum of two numbers, exactly."""
    s = a - b
    t = s - a
    return s, (a - (s - t)) - (b + t)


@numba.njit(cache=True, nogil=True)
def determinant(xyz: Array, a: int, b: int, c: int, p: int) -> float:
    """Return (b - a) x (c - a) . (p - a) of four rows, whose differences are exact, with its true sign."""
    parts = np.empty(24)  # of the sum so far, by rising size, none overlapping: 6 products of 4 parts at most
    used = integer(0)
    for turn in range(6):
        i = turn % 3
        j, k = ((i + 1) % 3, (i + 2) % 3) if turn < 3 else ((i + 2) % 3, (i + 1) % 3)
        u, v, w = xyz[b, i] - xyz[a, i], xyz[c, j] - xyz[a, j], xyz[p, k] - xyz[a, k]
        for factor in _product(u if turn < 3 else -u, v):
            for number in _product(factor, w):
                used = _add_exactly(parts, used, number)
    return float(parts[used - 1]) if used > 0 else 0.0


@numba.njit(cache=True, nogil=True)
def _add_exactly(parts: Array, used: int, number: float) -> int:
    """Add a number to a sum kept in parts that do not overlap; return how many there are now, none of them zero."""
    kept = 0
    for k in range(used):
        number, rest = _difference(number, -parts[k])
        if rest != 0.0:
            parts[kept] = rest
            kept += 1
    if number != 0.0:
        parts[kept] = number
        kept += 1
    return kept
