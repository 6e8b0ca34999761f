"""Compiled passes over depth images: points, heights and normals out of pixels.

All poses here are of the camera (optical axes) in one frame whose z is the height above the table.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numba
import numpy as np

from steelyard.shape.hulls.borrowed import borrowed

FACING = 0.3  # cosine of incidence below which a view's word about a surface is not asked
_STEEP = 3.0  # slope between neighbouring pixels that still counts as one surface (72 degrees)


class Images(NamedTuple):
    """What every pass needs.

    depth  (V, H, W) in steps of `unit` [m], 0 where nothing was measured
    lens   fx, fy, cx, cy [pixels]
    R, p   axes (V, 3, 3) and places (V, 3) [m] of the cameras
    """

    depth: Any
    unit: float
    lens: Any
    R: Any
    p: Any


@numba.njit(cache=True, nogil=True, inline="always")
def lent(images: Images) -> Images:
    """Return the images for calls pixel by pixel: nobody counts who holds them."""
    depth, unit, lens, R, p = images
    return Images(borrowed(depth), unit, borrowed(lens), borrowed(R), borrowed(p))


def stride_of(depth: Any, pixels: int) -> int:
    """Return the stride with which about so many pixels of images (V, H, W) are looked at."""
    return max(1, int(np.sqrt(depth.size / pixels)))


@numba.njit(cache=True, nogil=True)
def sampled(images: Images, stride: int) -> Any:
    """Return points (N, 5) of every stride-th pixel: x, y, z in the poses' frame, depth [m] and number of the view."""
    depth, unit, (fx, fy, cx, cy), R, p = images
    count, height, width = depth.shape
    out = np.empty((count * (height // stride + 1) * (width // stride + 1), 5))
    n = 0
    for k in range(count):
        for v in range(stride // 2, height, stride):
            for u in range(stride // 2, width, stride):
                z = depth[k, v, u] * unit
                if z > 0:
                    a, b = (u - cx) / fx * z, (v - cy) / fy * z
                    for i in range(3):
                        out[n, i] = R[k, i, 0] * a + R[k, i, 1] * b + R[k, i, 2] * z + p[k, i]
                    out[n, 3], out[n, 4] = z, k
                    n += 1
    return out[:n]


@numba.njit(cache=True, nogil=True)
def height_map(
    images: Images, stride: int, low: Any, pitch: float, floor: float, cap: float, rows: int, columns: int
) -> Any:
    """Return sums (rows, columns, 3) over a grid on the table: pixels, their heights, highest height.

    low    (2,) corner of the grid [m]
    pitch  [m]
    floor  what lies lower is not of the table, as its sides are not [m]
    cap    heights above it count alike [m]
    """
    depth = images.depth
    out = np.zeros((rows, columns, 3))
    first, count = stride // 2, (depth.shape[2] - stride // 2 + stride - 1) // stride
    line = np.empty((3, count))
    for k in range(depth.shape[0]):
        for v in range(first, depth.shape[1], stride):
            for m in range(count):
                line[0, m] = depth[k, v, first + m * stride]
            line_of_points(images, k, first, v, stride, low, pitch, line)
            for m in range(count):
                i, j, h = line[0, m], line[1, m], line[2, m]
                if 0 <= i < rows and 0 <= j < columns and h >= floor:
                    cell = out[np.uint32(i), np.uint32(j)]
                    cell[0] += 1
                    cell[1] += min(h, cap)
                    cell[2] = max(cell[2], h)
    return out


@numba.njit(cache=True, nogil=True, error_model="numpy")
def line_of_points(images: Images, k: int, first: int, v: int, stride: int, low: Any, pitch: float, line: Any) -> None:
    """Turn the depths in line (3, M) of the pixels of one row into their cell of the grid and height [m].

    A pixel without depth has cell -1.
    """
    unit, (fx, fy, cx, cy), R, p = images.unit, images.lens, images.R[k], images.p[k]
    b = (v - cy) / fy
    r00, r10, r20 = R[0, 0], R[1, 0], R[2, 0]
    x0, y0, z0 = R[0, 1] * b + R[0, 2], R[1, 1] * b + R[1, 2], R[2, 1] * b + R[2, 2]
    px, py, pz, left, near = p[0], p[1], p[2], low[0], low[1]
    row, column, height = line[0], line[1], line[2]
    for m in range(len(row)):
        z = row[m] * unit
        a = (first + m * stride - cx) / fx
        i = np.floor((z * (r00 * a + x0) + px - left) / pitch)
        row[m] = i if z > 0 else -1.0
        column[m] = np.floor((z * (r10 * a + y0) + py - near) / pitch)
        height[m] = z * (r20 * a + z0) + pz


@numba.njit(cache=True, nogil=True)
def held(images: Images, points: Any) -> Any:
    """Return how many images hold each point (N, 3), and how densely their pixels lie on a level surface there: (N, 2).

    The density is of all those images together [1/m^2], as if nothing stood before the point.
    """
    out = np.zeros((len(points), 2))
    _, height, width = images.depth.shape
    for i in range(len(points)):
        for k in range(len(images.p)):
            z, u, v = pixel_of(images, k, points[i])
            if 0 <= u < width and 0 <= v < height:
                out[i, 0] += 1
                out[i, 1] += images.lens[0] * images.lens[1] * abs(images.p[k, 2] - points[i, 2]) / z**3
    return out


@numba.njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def normal_of(
    images: Images, k: int, u: int, v: int, a: float, b: float, z: float, step: int, noise: float
) -> tuple[bool, float, float, float]:
    """Return whether the surface at pixel (u, v) of view k faces the camera enough to be asked, and its normal.

    a, b  slopes of the pixel's ray
    z     its depth [m]

    The normal is 1 long along the optical axis, not unit: slopes then average without a pull toward the camera,
    whatever their noise.
    """
    image, unit, (fx, fy, _, _), R = images.depth[k], images.unit, images.lens, images.R[k]
    most = _STEEP * step * z / fx + 4 * noise * z * z
    left, west = _beside(image[v, u - step] * unit, z, most, -step / fx)
    right, east = _beside(image[v, u + step] * unit, z, most, step / fx)
    up, north = _beside(image[v - step, u] * unit, z, most, -step / fy)
    down, south = _beside(image[v + step, u] * unit, z, most, step / fy)
    if west == east or north == south:
        return False, 0.0, 0.0, 0.0
    # tangents along the image's rows and columns
    dx, dy, dz = a * (right - left) + east * right - west * left, b * (right - left), right - left
    ex, ey, ez = a * (down - up), b * (down - up) + south * down - north * up, down - up
    x, y, away = ey * dz - ez * dy, ez * dx - ex * dz, ex * dy - ey * dx
    if away >= 0:
        return False, 0.0, 0.0, 0.0
    x, y = -x / away, -y / away
    faces = (1 - x * a - y * b) ** 2 >= 0.25 * FACING**2 * (1 + x * x + y * y) * (1 + a * a + b * b)
    return (
        faces,
        R[0, 0] * x + R[0, 1] * y - R[0, 2],
        R[1, 0] * x + R[1, 1] * y - R[1, 2],
        R[2, 0] * x + R[2, 1] * y - R[2, 2],
    )


@numba.njit(cache=True, nogil=True, forceinline=True)
def _beside(near: float, z: float, most: float, away: float) -> tuple[float, float]:
    """Return depth and place of a neighbour, those of the pixel itself where that was lost or is of another surface.

    near  depth of the neighbour [m], 0 where nothing was measured; z that of the pixel
    most  how far the two may lie apart on one surface [m]
    away  how far its ray is from the pixel's, in slope
    """
    return (near, away) if near > 0 and abs(near - z) <= most else (z, 0.0)


@numba.njit(cache=True, nogil=True, inline="always")
def pixel_of(images: Images, k: int, point: Any) -> Any:
    """Return depth [m] and the nearest pixel (u, v) of a point (3,) seen by camera k."""
    camera, R, p = images.lens, images.R, images.p
    x, y, h = point[0] - p[k, 0], point[1] - p[k, 1], point[2] - p[k, 2]
    z = R[k, 0, 2] * x + R[k, 1, 2] * y + R[k, 2, 2] * h
    if z <= 1e-6:
        return 0.0, -1, -1
    u = camera[2] + camera[0] * (R[k, 0, 0] * x + R[k, 1, 0] * y + R[k, 2, 0] * h) / z
    v = camera[3] + camera[1] * (R[k, 0, 1] * x + R[k, 1, 1] * y + R[k, 2, 1] * h) / z
    return z, int(np.floor(u + 0.5)), int(np.floor(v + 0.5))
