"""Tetrahedra of a Delaunay complex, made by inserting its points one by one.

The cells whose circumspheres hold a new point give way to cells that join their outer faces to it. Outside the hull,
cells reach to one point at infinity. A sign that rounding leaves in doubt is not guessed: there is no answer then.
Sources: Bowyer 1981; Watson 1981; Amenta, Choi, Rote 2003, the order of insertion; Devillers, Pion, Teillaud 2002, the
walk; Melquiond, Pion 2007, what rounding leaves in doubt.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numba
import numpy as np

from steelyard.check import Array, Integers
from steelyard.shape.hulls.borrowed import borrowed, integer

Table = Any  # uint32

_CELLS = 16  # per point, at most
# Rounding of the determinants below, over the product of the sizes of their columns.
_SIDE_DOUBT, _SPHERE_DOUBT = 5.2e-15, 1.25e-13
_UNSURE = 2  # a sign in doubt
NONE = np.uint32(2**32 - 1)


class Room(NamedTuple):
    """Room for the cells of a complex and for what is known of them; unsigned, or numba asks each number for its sign.

    cells   (C, 4) corners of every cell; that of those that reach to infinity is the number of points, or NONE of all
            that are no more
    beside  (C, 4) the cell across from every corner
    asked   (C,) the last point that a cell was asked for, and held: the last that its sphere held
    gone    (C,) cells whose sphere holds the new point
    faces   (4 C, 2) their outer faces: cell and corner across
    made    (C, 4) the new cell on an outer face
    free    (C,) cells that are no more
    """

    cells: Table
    beside: Table
    asked: Table
    held: Table
    gone: Table
    faces: Table
    made: Table
    free: Table

    @classmethod
    def of(cls, points: int) -> Room:
        """Return room for the complex of so many points."""
        count = _CELLS * points + 256
        cells, beside, made = (np.empty((count, 4), np.uint32) for _ in range(3))
        asked, held = (np.full(count, NONE) for _ in range(2))
        gone, faces, free = np.empty(count, np.uint32), np.empty((4 * count, 2), np.uint32), np.empty(count, np.uint32)
        return cls(cells, beside, asked, held, gone, faces, made, free)


def thinly(order: Integers) -> Integers:
    """Return an order (N,) in rounds, each twice as dense as all before it and along the given one."""
    rounds = []
    step = 1 << max(len(order) - 1, 1).bit_length()
    rounds.append(order[::step])
    while step > 1:
        rounds.append(order[step // 2 :: step])
        step //= 2
    return np.concatenate(rounds)


def tetrahedra(xyz: Array, order: Integers) -> tuple[Integers, Integers] | None:
    """Return the cells (S, 4) of points (N, 3), of positive volume, and their neighbours (S, 4), -1 without one.

    None where a sign is in doubt: of points on one plane or sphere, or nearly.
    """
    room = Room.of(len(xyz))
    used = _inserted(xyz, order.astype(np.uint32), room)
    return _finite(room.cells[:used], room.beside, len(xyz)) if used else None


@numba.njit(cache=True, nogil=True)
def _side(xyz: Array, a: int, b: int, c: int, d: int) -> int:
    """Return 1 where d lies on the side of the plane a, b, c from which they turn clockwise, -1 on the other."""
    x, y, z = xyz[d, 0], xyz[d, 1], xyz[d, 2]
    ax, ay, az = xyz[a, 0] - x, xyz[a, 1] - y, xyz[a, 2] - z
    bx, by, bz = xyz[b, 0] - x, xyz[b, 1] - y, xyz[b, 2] - z
    cx, cy, cz = xyz[c, 0] - x, xyz[c, 1] - y, xyz[c, 2] - z
    found = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    size = max(abs(ax), abs(bx), abs(cx)) * max(abs(ay), abs(by), abs(cy)) * max(abs(az), abs(bz), abs(cz))
    if abs(found) <= _SIDE_DOUBT * size:
        return _UNSURE
    return -1 if found > 0 else 1


@numba.njit(cache=True, nogil=True)
def _in_sphere(xyz: Array, a: int, b: int, c: int, d: int, p: int) -> int:
    """Return 1 where p lies in the sphere through the corners of a cell of positive volume, -1 outside."""
    x, y, z = xyz[p, 0], xyz[p, 1], xyz[p, 2]
    ax, ay, az = xyz[a, 0] - x, xyz[a, 1] - y, xyz[a, 2] - z
    bx, by, bz = xyz[b, 0] - x, xyz[b, 1] - y, xyz[b, 2] - z
    cx, cy, cz = xyz[c, 0] - x, xyz[c, 1] - y, xyz[c, 2] - z
    dx, dy, dz = xyz[d, 0] - x, xyz[d, 1] - y, xyz[d, 2] - z
    ab, bc, cd = ax * by - bx * ay, bx * cy - cx * by, cx * dy - dx * cy
    da, ac, bd = dx * ay - ax * dy, ax * cy - cx * ay, bx * dy - dx * by
    found = (dx * dx + dy * dy + dz * dz) * (az * bc - bz * ac + cz * ab)
    found -= (cx * cx + cy * cy + cz * cz) * (dz * ab + az * bd + bz * da)
    found += (bx * bx + by * by + bz * bz) * (cz * da + dz * ac + az * cd)
    found -= (ax * ax + ay * ay + az * az) * (bz * cd - cz * bd + dz * bc)
    wide, deep = max(abs(ax), abs(bx), abs(cx), abs(dx)), max(abs(ay), abs(by), abs(cy), abs(dy))
    high = max(abs(az), abs(bz), abs(cz), abs(dz))
    most = max(wide, deep, high)
    if abs(found) <= _SPHERE_DOUBT * wide * deep * high * most * most:
        return _UNSURE
    return -1 if found > 0 else 1


@numba.njit(cache=True, nogil=True)
def _slot(table: Table, t: int, value: int) -> int:
    """Return where row t, of four, has a value."""
    return 0 if table[t, 0] == value else 1 if table[t, 1] == value else 2 if table[t, 2] == value else 3


@numba.njit(cache=True, nogil=True)
def _side_of(xyz: Array, cells: Table, t: int, k: int, p: int) -> int:
    """Return the side of the face across from corner k of cell t that p lies on: 1 where the corner is."""
    a, b, c, d = cells[t, 0], cells[t, 1], cells[t, 2], cells[t, 3]
    return _side(xyz, p if k == 0 else a, p if k == 1 else b, p if k == 2 else c, p if k == 3 else d)


@numba.njit(cache=True, nogil=True)
def _conflict(xyz: Array, cells: Table, t: int, p: int) -> int:
    """Return 1 where p lies in the sphere of cell t, or beyond its facet where it reaches to infinity; -1 where not."""
    k = _slot(cells, t, len(xyz))
    if cells[t, k] == len(xyz):
        return _side_of(xyz, cells, t, k, p)
    return _in_sphere(xyz, cells[t, 0], cells[t, 1], cells[t, 2], cells[t, 3], p)


@numba.njit(cache=True, nogil=True)
def _started(xyz: Array, first: Table, cells: Table, beside: Table) -> bool:
    """Write the cell of four points and the four outside it; return whether the points are surely not in a plane."""
    side = _side(xyz, first[0], first[1], first[2], first[3])
    if side == _UNSURE:
        return False
    cells[0] = first
    if side < 0:
        cells[0, 2], cells[0, 3] = first[3], first[2]
    for k in range(4):
        out, i, j = cells[k + 1], (k + 1) % 4, (k + 2) % 4
        out[:] = cells[0]
        out[k], out[i], out[j] = len(xyz), cells[0, j], cells[0, i]
        beside[0, k] = k + 1
        for m in range(4):
            beside[k + 1, m] = m + 1
        beside[k + 1, k], beside[k + 1, i], beside[k + 1, j] = 0, j + 1, i + 1
    return True


@numba.njit(cache=True, nogil=True)
def _found(xyz: Array, cells: Table, beside: Table, t: int, p: int) -> int:
    """Return a cell whose sphere holds p, by a walk from cell t; -1 where a sign is in doubt."""
    k = _slot(cells, t, len(xyz))
    t, before = (beside[t, k] if cells[t, k] == len(xyz) else t), -1
    while cells[t, _slot(cells, t, len(xyz))] != len(xyz):
        for k in range(4):
            if beside[t, k] == before:
                continue
            side = _side_of(xyz, cells, t, k, p)
            if side == _UNSURE:
                return -1
            if side < 0:
                before, t = t, beside[t, k]
                break
        else:
            break
    return int(t)


@numba.njit(cache=True, nogil=True)
def _cavity(
    xyz: Array, cells: Table, beside: Table, asked: Table, held: Table, gone: Table, faces: Table, p: int, first: int
) -> tuple[int, int]:
    """Write the cells whose spheres hold p into `gone` and their outer faces into `faces`; return how many of both.

    The second is -1 where a sign is in doubt.
    """
    gone[0], asked[first], held[first] = first, p, p
    dying, outer, m = 1, 0, 0
    while m < dying:
        t = gone[m]
        m += 1
        for k in range(4):
            n = beside[t, k]
            if asked[n] != p:
                asked[n] = p
                answer = _conflict(xyz, cells, n, p)
                if answer == _UNSURE:
                    return dying, -1
                if answer > 0:
                    held[n], gone[dying] = p, n
                    dying += 1
            if held[n] != p:
                faces[outer, 0], faces[outer, 1] = t, k
                outer += 1
    return dying, outer


@numba.njit(cache=True, nogil=True)
def _join(
    cells: Table, beside: Table, held: Table, made: Table, p: int, t: int, k: int, j: int
) -> None:  # fmt: skip
    """Join the new cell on outer face k of cell t to the one across its face j, found by a turn about their edge."""
    new, kept = made[t, k], cells[t, k]
    across = j
    while held[beside[t, across]] == p:
        n = beside[t, across]
        across, kept, t = _slot(cells, n, kept), cells[n, _slot(beside, n, t)], n
    other = made[t, across]
    beside[new, j], beside[other, _slot(cells, t, kept)] = other, new


@numba.njit(cache=True, nogil=True)
def _inserted(points: Array, order: Table, room: Room) -> int:
    """Return how many rows of the room the complex takes; 0 where a sign was in doubt, or the room too small."""
    xyz, cells, beside, made = borrowed(points), borrowed(room.cells), borrowed(room.beside), borrowed(room.made)
    asked, held, gone, faces = borrowed(room.asked), borrowed(room.held), borrowed(room.gone), borrowed(room.faces)
    free = borrowed(room.free)
    if not _started(xyz, order[:4], cells, beside):
        return 0
    used, spare, last = integer(5), integer(0), integer(0)
    for p in order[4:]:
        last = integer(_found(xyz, cells, beside, last, p))
        if last < 0:
            return 0
        dying, outer = _cavity(xyz, cells, beside, asked, held, gone, faces, p, last)
        if outer < 0 or used + outer - spare > len(cells):
            return 0
        for m in range(outer):
            t, k = faces[m, 0], faces[m, 1]
            if spare > 0:
                spare -= 1
                last = free[spare]
            else:
                last = used
                used += 1
            made[t, k], n = last, beside[t, k]
            for j in range(4):
                cells[last, j], beside[last, j] = cells[t, j], NONE
            cells[last, k], beside[last, k], beside[n, _slot(beside, n, t)] = p, n, last
        for m in range(outer):
            t, k = faces[m, 0], faces[m, 1]
            for j in range(4):
                if beside[made[t, k], j] == NONE:
                    _join(cells, beside, held, made, p, t, k, j)
        for m in range(dying):
            free[spare], cells[gone[m], 0], spare = gone[m], NONE, spare + 1
    return int(used)


@numba.njit(cache=True, nogil=True)
def _finite(cells: Table, beside: Table, points: int) -> tuple[Integers, Integers]:
    """Return the cells in use that do not reach to infinity, and their neighbours."""
    number, count = np.full(len(cells), -1), 0
    for t in range(len(cells)):
        if cells[t, 0] != NONE and max(cells[t, 0], cells[t, 1], cells[t, 2], cells[t, 3]) < points:
            number[t] = count
            count += 1
    simplices, neighbours = np.empty((count, 4), np.int64), np.empty((count, 4), np.int64)
    for t in range(len(cells)):
        if number[t] >= 0:
            for k in range(4):
                simplices[number[t], k], neighbours[number[t], k] = cells[t, k], number[beside[t, k]]
    return simplices, neighbours
