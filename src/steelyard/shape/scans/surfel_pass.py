"""A compiled pass over depth images that averages their pixels into patches of surface."""

from __future__ import annotations

from typing import Any, NamedTuple

import numba
import numpy as np

from steelyard.shape.scans.depth_images import Images, lent, line_of_points, normal_of, pixel_of


class _Cubes(NamedTuple):
    """The cubes over which pixels are averaged.

    low     (2,) corner of the table [m]; edge of a cube [m]; floor: lowest height looked at [m]
    number  (I, J) columns of cubes, -1 where nothing is looked at; there are `columns` of them, `layers` cubes high
    """

    low: Any
    edge: float
    floor: float
    layers: int
    number: Any
    columns: int


@numba.njit(cache=True, nogil=True)
def surfels(
    images: Images, stride: int, step: int, mask: Any, low: Any, cell: float, floor: float, layers: int, noise: float
) -> Any:
    """Return patches (N, 8) of surface: mean point, unit normal toward the cameras, pixels and views that saw it.

    step    pixels between the neighbours that give a pixel's normal
    mask    (I, J) bool: where on the table to look, cells from the corner `low` (2,)
    cell    their width, and the edge of the cubes over which pixels are averaged, apart by the six main directions of
            their normals [m]
    floor   lowest height looked at [m], `layers` cubes up from it
    noise   standard deviation of depth at 1 m; it grows with the square
    """
    images, width = lent(images), images.depth.shape[2]
    box, (number, columns) = _box_of(mask, low, cell, floor, layers * cell), _numbered(mask)
    cubes = _Cubes(low, cell, floor, layers, number, columns)
    index = np.full(6 * layers * columns, -1, np.int32)  # neighbours on a level surface lie side by side
    size, n = max(4096, width), 0
    sums, last = np.zeros((size, 8)), np.full(size, -1, np.int32)
    line, found, at = np.empty((3, width)), np.empty((6, width)), np.empty(width, np.int64)
    for k in range(len(images.depth)):
        left, right, upper, lower = _window_of(box, images, k)
        first = _first(left, step, stride)
        wide = max(0, (min(width - step, right + 1) - first + stride - 1) // stride)
        for v in range(_first(upper, step, stride), min(images.depth.shape[1] - step, lower + 1), stride):
            on = _line_found(images, k, v, first, stride, step, noise, cubes, line[:, :wide], found, at)
            if n + on > len(sums):
                sums, last = _longer(sums, last)
            n = _added(found, at, on, k, index, sums, last, n)
    return _means(sums[:n])


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _line_found(
    images: Images, k: int, v: int, first: int, stride: int, step: int, noise: float,
    cubes: _Cubes, line: Any, found: Any, at: Any,
) -> int:  # fmt: skip
    """Write points and normals of the pixels of row v of view k into found (6, M), the numbers of their cubes into at
    (M,); return how many."""
    depth, unit, (fx, fy, cx, cy), R, p = images
    rows, columns = cubes.number.shape
    for m in range(line.shape[1]):
        line[0, m] = depth[k, v, first + m * stride]
    line_of_points(images, k, first, v, stride, cubes.low, cubes.edge, line)
    b, on = (v - cy) / fy, 0
    for m in range(line.shape[1]):
        i, j, h = line[0, m], line[1, m], line[2, m]
        if not (0 <= i < rows and 0 <= j < columns):
            continue
        place = cubes.number[np.uint32(i), np.uint32(j)]
        layer = int(np.floor((h - cubes.floor) / cubes.edge))
        if place < 0 or layer < 0 or layer >= cubes.layers:
            continue
        u = first + m * stride
        a, z = (u - cx) / fx, depth[k, v, u] * unit
        faces, x, y, up = normal_of(images, k, u, v, a, b, z, step, noise)
        if not faces:
            continue
        at[on] = (_main_direction(x, y, up) * cubes.layers + layer) * cubes.columns + place
        found[0, on] = z * (R[k, 0, 0] * a + R[k, 0, 1] * b + R[k, 0, 2]) + p[k, 0]
        found[1, on] = z * (R[k, 1, 0] * a + R[k, 1, 1] * b + R[k, 1, 2]) + p[k, 1]
        found[2, on], found[3, on], found[4, on], found[5, on] = h, x, y, up
        on += 1
    return on


@numba.njit(cache=True, nogil=True)
def _added(found: Any, at: Any, on: int, k: int, index: Any, sums: Any, last: Any, n: int) -> int:
    """Add the first `on` pixels found in view k to the sums (S, 8) of their cubes, of which n are in use; return n.

    Apart from what finds them, so that a processor fetches many of these scattered rows at once.

    index  row of the sums of each cube, -1 where it has none yet
    last   (S,) view that was added last
    """
    for m in range(on):
        row = index[at[m]]
        if row < 0:
            row = index[at[m]] = n
            n += 1
        for c in range(6):
            sums[row, c] += found[c, m]
        sums[row, 6] += 1
        if last[row] != k:
            sums[row, 7] += 1
            last[row] = k
    return n


@numba.njit(cache=True, nogil=True)
def _numbered(mask: Any) -> tuple[Any, int]:
    """Return the cells (I, J) of a mask numbered row by row, others -1, and how many there are."""
    number, n = np.full(mask.shape, -1, np.int32), 0
    for i in range(mask.shape[0]):
        for j in range(mask.shape[1]):
            if mask[i, j]:
                number[i, j] = n
                n += 1
    return number, n


@numba.njit(cache=True, nogil=True, forceinline=True)
def _main_direction(x: float, y: float, z: float) -> int:
    """Return which of +x, -x, +y, -y, +z, -z (0..5) a vector is nearest to."""
    ax, ay, az = abs(x), abs(y), abs(z)
    if az >= ax and az >= ay:
        return 4 if z > 0 else 5
    if ax >= ay:
        return 0 if x > 0 else 1
    return 2 if y > 0 else 3


@numba.njit(cache=True, nogil=True)
def _means(sums: Any) -> Any:
    """Turn sums (N, 8) over the pixels of patches into mean points and unit normals, in place."""
    for row in range(len(sums)):
        length = np.sqrt(sums[row, 3] ** 2 + sums[row, 4] ** 2 + sums[row, 5] ** 2) + 1e-300
        for i in range(3):
            sums[row, i] /= sums[row, 6]
            sums[row, 3 + i] /= length
    return sums


@numba.njit(cache=True, nogil=True)
def _box_of(mask: Any, low: Any, pitch: float, floor: float, tall: float) -> Any:
    """Return the lower and upper corner (2, 3) of the space over the cells of a mask, `tall` from `floor` up [m]."""
    box = np.array([[np.inf, np.inf, floor], [-np.inf, -np.inf, floor + tall]])
    for i in range(mask.shape[0]):
        for j in range(mask.shape[1]):
            if mask[i, j]:
                for axis, n in ((0, i), (1, j)):
                    box[0, axis] = min(box[0, axis], low[axis] + n * pitch)
                    box[1, axis] = max(box[1, axis], low[axis] + (n + 1) * pitch)
    return box


@numba.njit(cache=True, nogil=True)
def _window_of(box: Any, images: Images, k: int) -> tuple[int, int, int, int]:
    """Return the first and last column and row of the pixels that may fall into a box (2, 3) seen by camera k.

    A box's picture lies within those of its corners, where all of them are before the camera.
    """
    _, height, width = images.depth.shape
    left, right, upper, lower = width, -1, height, -1
    for corner in range(8):
        z, u, v = pixel_of(images, k, (box[corner & 1, 0], box[(corner >> 1) & 1, 1], box[corner >> 2, 2]))
        if z <= 0:
            return 0, width - 1, 0, height - 1
        left, right = min(left, u - 1), max(right, u + 1)
        upper, lower = min(upper, v - 1), max(lower, v + 1)
    return left, right, upper, lower


@numba.njit(cache=True, nogil=True, inline="always")
def _first(least: int, step: int, stride: int) -> int:
    """Return the first of `step`, `step + stride`, ... from `least` on, or one before it."""
    return step + stride * (max(least - step, 0) // stride)


@numba.njit(cache=True, nogil=True)
def _longer(sums: Any, last: Any) -> Any:
    more, views = np.zeros((2 * len(sums), sums.shape[1])), np.full(2 * len(last), -1, np.int32)
    more[: len(sums)] = sums
    views[: len(last)] = last
    return more, views
