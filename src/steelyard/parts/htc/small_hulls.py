"""Hulls of four and of five points, in closed form: most of those that tetrahedra are joined by first."""

from __future__ import annotations

from typing import Any

import numba

from steelyard.check import Array
from steelyard.parts.hulls import Hulls


@numba.njit(cache=True, nogil=True)
def six_volumes(xyz: Array, a: int, b: int, c: int, d: int) -> float:
    """Return six times the volume of a tet of rows of xyz (V, 3), positive where d lies above a, b, c."""
    ax, ay, az = xyz[a, 0], xyz[a, 1], xyz[a, 2]
    ux, uy, uz = xyz[b, 0] - ax, xyz[b, 1] - ay, xyz[b, 2] - az
    vx, vy, vz = xyz[c, 0] - ax, xyz[c, 1] - ay, xyz[c, 2] - az
    wx, wy, wz = xyz[d, 0] - ax, xyz[d, 1] - ay, xyz[d, 2] - az
    return float(wx * (uy * vz - uz * vy) + wy * (uz * vx - ux * vz) + wz * (ux * vy - uy * vx))


@numba.njit(cache=True, nogil=True)
def four_faces(xyz: Array, hulls: Hulls, c: int) -> None:
    """Keep the faces of cluster c, which has four of the points xyz (V, 3)."""
    vertex, at = hulls.vertex, hulls.offset[c]
    turned = six_volumes(xyz, vertex[at], vertex[at + 1], vertex[at + 2], vertex[at + 3]) < 0
    for k in range(4):
        i, j, h = (k + 1) % 4, (k + 2) % 4, (k + 3) % 4
        if (k % 2 == 1) != turned:
            i, j = j, i
        hulls.face[6 * at + 3 * k], hulls.face[6 * at + 3 * k + 1], hulls.face[6 * at + 3 * k + 2] = i, j, h


@numba.njit(cache=True, nogil=True)
def five_volume(xyz: Array, rows: Any) -> float:
    """Return the volume of the hull of five points: the positive of the tets that leave one out fill it, and so do the
    negative, half the sum of all.
    """
    total, last = 0.0, 0.0
    for k in range(4):
        i, j, h = rows[0 if k != 0 else 3], rows[1 if k != 1 else 3], rows[2 if k != 2 else 3]
        d = six_volumes(xyz, rows[4], j, h, i)
        total += abs(d)
        last += d if k == 3 else -d
    return (total + abs(last)) / 12


@numba.njit(cache=True, nogil=True)
def five_faces(xyz: Array, rows: Any, point: Any, corner: Any) -> None:
    """Write vertices and faces of the points rows (5,) of xyz (N, 3) as `hull_volume` would, -1 if one lies inside.

    Weights of sum zero exist with which the points cancel: the volumes of the tets of the others, signed in turn. Two
    points lie on one side of the plane of the other three, a face, where the weights of the two differ in sign.
    """
    signs = 0  # a bit for each point whose weight is not negative
    for m in range(5):
        i, j, k, h = 0 if m > 0 else 1, 1 if m > 1 else 2, 2 if m > 2 else 3, 3 if m > 3 else 4
        if (six_volumes(xyz, rows[i], rows[j], rows[k], rows[h]) >= 0) == (m % 2 == 0):
            signs |= 1 << m
        point[m, 2] = rows[m]
    for f in range(6):
        corner[f, 0] = -1
    faces = 0
    for one in range(5):
        for other in range(one + 1, 5):
            if (signs >> one) & 1 != (signs >> other) & 1:
                # `one` comes last in the tet without `other`: it passes those of the three that follow it.
                above = ((signs >> other) & 1) == 1
                if other % 2 == 1:
                    above = not above
                t = 0
                for k in range(5):
                    if k != one and k != other:
                        corner[faces, t] = k
                        t += 1
                        if k > one:
                            above = not above
                if above:
                    corner[faces, 1], corner[faces, 2] = corner[faces, 2], corner[faces, 1]
                faces += 1
