"""The winding number of a patch of a surface, by the lines around it.

At a place inside a solid it is the share of all directions in which the patch lies. It hangs on the border of the patch
alone, and on the plane of a flat border it is a half.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np

from steelyard.check import Array, Integers
from steelyard.parts.skin import Skin

# How far the numbers at both ends of an edge must lie from a half, for the patch to tell. A flush patch reaches 0, one
# that rises by 36 degrees from its border 0.1, half a ball 0.25 and more.
_TELLS = 0.1
_HALVED = 5  # times that a long edge of the surface is halved
_STEPS, _FOUND = 6, 1e-3  # of false position along an edge, and the difference at which it ends


def crossings(skin: Skin, part: Integers, longest: float) -> Array:
    """Return a place (F, 3, 3) on the edge that starts at each corner of the triangles: the middle, but of long edges
    from one part to another, over `longest` [m], where the nearest vertex is no longer of the part of the first.
    """
    from scipy.spatial import cKDTree

    ends = np.stack([skin.triangles, np.roll(skin.triangles, -1, axis=1)], axis=-1)
    first, last = skin.vertices[ends.min(-1)], skin.vertices[ends.max(-1)]  # alike for both triangles at an edge
    places = (first + last) / 2
    long = np.linalg.norm(last - first, axis=-1) > longest
    long &= part[ends[..., 0]] != part[ends[..., 1]]
    if long.any():
        first, way, mine = first[long], (last - first)[long], part[ends.min(-1)[long]]
        tree, share = cKDTree(skin.vertices, balanced_tree=False, compact_nodes=False), np.zeros(len(first))
        for step in 0.5 ** np.arange(1, _HALVED + 1):
            there = first + (share + step)[:, None] * way
            share += step * (part[tree.query(there)[1]] == mine)
        places[long] = first + (share + step / 2)[:, None] * way
    return np.asarray(places)


def lines_around(skin: Skin, places: Array, beyond: Any) -> Array:
    """Return the border of the vertices (V,) that lie beyond it.

    places  (F, 3, 3) where borders cross the edge that starts at each corner of the triangles
    lines   (6, S) both ends of each line, what lies beyond on the left seen from outside
    """
    side = beyond[skin.triangles]
    alone = (side != np.roll(side, 1, axis=1)) & (side != np.roll(side, -1, axis=1))
    after, before, inside = places[alone], np.roll(places, 1, axis=1)[alone], side[alone][:, None]
    ends = np.where(inside, after, before), np.where(inside, before, after)
    return np.ascontiguousarray(np.concatenate(ends, axis=1).T)


@numba.njit(cache=True, nogil=True)
def shares(lines: Array, vertices: Array, edges: Integers) -> Array:
    """Return how far along each edge (E, 2) to beyond the number is a half; NaN where its ends do not tell."""
    out, work = np.full(len(edges), np.nan), np.empty((2, lines.shape[1]))
    known = np.full(len(vertices), np.nan)
    for e in range(len(edges)):
        for end in edges[e]:
            if np.isnan(known[end]):
                known[end] = over_half(lines, vertices[end], work)
        begin, way = vertices[edges[e, 0]], vertices[edges[e, 1]] - vertices[edges[e, 0]]
        below, above = known[edges[e, 0]], known[edges[e, 1]]
        if below > -_TELLS or above < _TELLS:
            continue
        low, high = 0.0, 1.0
        for _ in range(_STEPS):
            t = low + (high - low) * below / (below - above)
            out[e], here = t, over_half(lines, begin + t * way, work)
            if abs(here) < _FOUND:
                break
            # What the end that stays is taken for is halved, so that both close in (the Illinois rule).
            if here < 0:
                low, below, above = t, here, above / 2
            else:
                high, below, above = t, below / 2, here
    return out


@numba.njit(cache=True, nogil=True, fastmath={"nsz", "arcp", "contract", "afn", "reassoc"}, error_model="numpy")
def over_half(lines: Any, place: Any, work: Any) -> float:
    """Return the winding number, less a half, at a place (3,) of the patch that lines (6, S) go around; -1/2 to 1/2.

    A line spans a triangle with a point infinitely far off, whose half solid angle is the angle of a complex number.
    The product of these has the sum of the angles, whole turns left out.
    Source: van Oosterom and Strackee, "The solid angle of a plane triangle", 1983.

    work  (2, S or more) is written over
    """
    count = lines.shape[1]
    real, imaginary = work[0], work[1]
    x, y, z = place[0], place[1], place[2]
    for k in range(count):
        ax, ay, az = lines[0, k] - x, lines[1, k] - y, lines[2, k] - z
        bx, by, bz = lines[3, k] - x, lines[4, k] - y, lines[5, k] - z
        a, b = np.sqrt(ax * ax + ay * ay + az * az), np.sqrt(bx * bx + by * by + bz * bz)
        even, odd = a * b + ax * bx + ay * by + az * bz + bz * a + az * b, ax * by - ay * bx
        one = 1 / np.sqrt(even * even + odd * odd + 1e-300)
        real[k], imaginary[k] = even * one, odd * one
    while count > 1:
        half = count // 2
        kept = count - half
        for k in range(half):
            a, b, c, d = real[k], imaginary[k], real[kept + k], imaginary[kept + k]
            real[k], imaginary[k] = a * c - b * d, a * d + b * c
        count = kept
    return float(np.arctan2(-imaginary[0], -real[0]) / (2 * np.pi))
