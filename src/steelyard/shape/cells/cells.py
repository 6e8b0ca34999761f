"""The cells of a Delaunay complex that are more than flat leftovers, and what the normals of their corners say."""

from __future__ import annotations

import math

import numba
import numpy as np

from steelyard.check import Array, Integers

_FLAT = 1e-4  # volume of a cell, over that of a box of its edges, below which it is a flat leftover


@numba.njit(cache=True, nogil=True)
def cells(xyz: Array, simplices: Integers, beside: Integers) -> tuple[Integers, Integers, Array, Array]:
    """Return the cells (T, 4) worth keeping, turned to positive volume, neighbours, volumes and centroids.

    xyz        (N, 3) points
    simplices  (S, 4) cells of their Delaunay complex
    beside     (S, 4) the cell opposite each corner, -1 without one
    """
    count = 0
    number = np.full(len(simplices) + 1, -1)  # the last stands for none
    tets, volumes = np.empty((len(simplices), 4), np.int64), np.empty(len(simplices))
    centres = np.empty((len(simplices), 3))
    for s in range(len(simplices)):
        a, b, c, d = simplices[s, 0], simplices[s, 1], simplices[s, 2], simplices[s, 3]
        ax, ay, az = xyz[a, 0], xyz[a, 1], xyz[a, 2]
        ux, uy, uz = xyz[b, 0] - ax, xyz[b, 1] - ay, xyz[b, 2] - az
        vx, vy, vz = xyz[c, 0] - ax, xyz[c, 1] - ay, xyz[c, 2] - az
        wx, wy, wz = xyz[d, 0] - ax, xyz[d, 1] - ay, xyz[d, 2] - az
        six = (uy * vz - uz * vy) * wx + (uz * vx - ux * vz) * wy + (ux * vy - uy * vx) * wz
        box = (ux * ux + uy * uy + uz * uz) * (vx * vx + vy * vy + vz * vz) * (wx * wx + wy * wy + wz * wz)
        if abs(six) <= _FLAT * math.sqrt(box):
            continue
        number[s] = count
        tets[count, 0], tets[count, 1] = a, b
        tets[count, 2], tets[count, 3] = (c, d) if six > 0 else (d, c)
        volumes[count] = abs(six) / 6
        centres[count, 0] = ax + (ux + vx + wx) / 4
        centres[count, 1] = ay + (uy + vy + wy) / 4
        centres[count, 2] = az + (uz + vz + wz) / 4
        count += 1
    neighbours = np.empty((count, 4), np.int64)
    for s in range(len(simplices)):
        if number[s] >= 0:
            t = number[s]
            turned = tets[t, 2] != simplices[s, 2]
            for k in range(4):
                neighbours[t, k] = number[beside[s, k if k < 2 or not turned else 5 - k]]
    return tets[:count].copy(), neighbours, volumes[:count].copy(), centres[:count].copy()


@numba.njit(cache=True, nogil=True)
def votes_of(xyz: Array, normals: Array, tets: Integers, centres: Array) -> Array:
    """Return how squarely each cell (T, 4) lies behind its corners, on the mean: 1 inside, -1 outside.

    xyz, normals  (N, 3) points and the outward normals there
    centres       (T, 3) centroids of the cells
    """
    votes = np.zeros(len(tets))
    for t in range(len(tets)):
        for k in range(4):
            i = tets[t, k]
            dx, dy, dz = centres[t, 0] - xyz[i, 0], centres[t, 1] - xyz[i, 1], centres[t, 2] - xyz[i, 2]
            along = dx * normals[i, 0] + dy * normals[i, 1] + dz * normals[i, 2]
            votes[t] -= along / math.sqrt(dx * dx + dy * dy + dz * dz) / 4
    return votes
