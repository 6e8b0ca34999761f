"""A compiled pass over depth images that averages their pixels into patches of surface."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np

from steelyard.shape.scans.depth_images import Images, lent, normal_of, pixel_of


@numba.njit(cache=True, nogil=True, error_model="numpy")
def surfels(
    images: Images, stride: int, step: int, mask: Any, low: Any, pitch: float, cell: float, floor: float, layers: int,
    noise: float,
) -> Any:  # fmt: skip
    """Return patches (N, 8) of surface: mean point, unit normal toward the cameras, pixels and views that saw it.

    step    pixels between the neighbours that give a pixel's normal
    mask    (rows, columns) bool: where on the table to look, `pitch` wide cells from the corner `low` (2,)
    cell    edge of the cube over which pixels are averaged, apart by the six main directions of their normals [m]
    floor   lowest height looked at [m], `layers` cubes up from it
    noise   standard deviation of depth at 1 m; it grows with the square
    """
    images = lent(images)
    depth, unit, (fx, fy, cx, cy), R, p = images
    count, height, width = depth.shape
    box = _box_of(mask, low, pitch, floor, layers * cell)
    # Cubes are counted from the corner of the table; the index holds those over the mask, with one to spare.
    i0, j0 = max(int((box[0, 0] - low[0]) / cell) - 1, 0), max(int((box[0, 1] - low[1]) / cell) - 1, 0)
    wide, deep = int((box[1, 0] - low[0]) / cell) + 2 - i0, int((box[1, 1] - low[1]) / cell) + 2 - j0
    index = np.full((6, layers, wide, deep), -1, np.int32)  # neighbours on a level surface lie side by side
    size = 4096
    sums, last = np.zeros((size, 8)), np.full(size, -1, np.int32)
    n = 0
    for k in range(count):
        window = _window_of(box, images, k)
        for v in range(_first(window[2], step, stride), min(height - step, window[3] + 1), stride):
            b = (v - cy) / fy
            for u in range(_first(window[0], step, stride), min(width - step, window[1] + 1), stride):
                z = depth[k, v, u] * unit
                if z <= 0:
                    continue
                a = (u - cx) / fx
                x = z * (R[k, 0, 0] * a + R[k, 0, 1] * b + R[k, 0, 2]) + p[k, 0]
                y = z * (R[k, 1, 0] * a + R[k, 1, 1] * b + R[k, 1, 2]) + p[k, 1]
                i, j = int(np.floor((x - low[0]) / pitch)), int(np.floor((y - low[1]) / pitch))
                if i < 0 or j < 0 or i >= mask.shape[0] or j >= mask.shape[1] or not mask[i, j]:
                    continue
                h = z * (R[k, 2, 0] * a + R[k, 2, 1] * b + R[k, 2, 2]) + p[k, 2]
                layer = int(np.floor((h - floor) / cell))
                if layer < 0 or layer >= layers:
                    continue
                faces, nx, ny, nz = normal_of(images, k, u, v, a, b, z, step, noise)
                if not faces:
                    continue
                main = _main_direction(nx, ny, nz)
                i, j = int((x - low[0]) / cell) - i0, int((y - low[1]) / cell) - j0
                row = index[main, layer, i, j]
                if row < 0:
                    if n == size:
                        sums, last = _longer(sums, last)
                        size *= 2
                    row = index[main, layer, i, j] = n
                    n += 1
                _add(sums[row], x, y, h, nx, ny, nz)
                if last[row] != k:
                    sums[row, 7] += 1
                    last[row] = k
    return _means(sums[:n])


@numba.njit(cache=True, nogil=True, forceinline=True)
def _add(patch: Any, x: float, y: float, h: float, nx: float, ny: float, nz: float) -> None:
    """Add a pixel to the sums (8,) of its patch, but for the count of views."""
    patch[0] += x
    patch[1] += y
    patch[2] += h
    patch[3] += nx
    patch[4] += ny
    patch[5] += nz
    patch[6] += 1.0


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
