"""Compiled passes over depth images: points out of pixels, and what each view says about a point.

All poses here are of the camera (optical axes) in one frame whose z is the height above the table.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np

FACING = 0.3  # cosine of incidence below which a view's word about a surface is not asked
UPWARD = 0.7  # least upward component of the normal of a surface that faces up
_STEEP = 3.0  # slope between neighbouring pixels that still counts as one surface (72 degrees)
MOST_VIEWS = 1024  # views that can speak of one point


@numba.njit(cache=True, nogil=True)
def sampled(depth: Any, unit: float, camera: Any, R: Any, p: Any, stride: int) -> Any:
    """Return points (N, 5) of every stride-th pixel: x, y, z in the poses' frame, depth [m] and number of the view."""
    fx, fy, cx, cy = camera
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
    depth: Any, unit: float, camera: Any, R: Any, p: Any, stride: int, low: Any, pitch: float, cap: float, rows: int,
    columns: int,
) -> Any:  # fmt: skip
    """Return sums (rows, columns, 3) over a grid on the table: pixels, their heights up to +-cap, highest height.

    low    (2,) corner of the grid [m]
    pitch  [m]
    """
    fx, fy, cx, cy = camera
    out = np.zeros((rows, columns, 3))
    for k in range(depth.shape[0]):
        for v in range(stride // 2, depth.shape[1], stride):
            b = (v - cy) / fy
            x0, y0, z0 = R[k, 0, 1] * b + R[k, 0, 2], R[k, 1, 1] * b + R[k, 1, 2], R[k, 2, 1] * b + R[k, 2, 2]
            for u in range(stride // 2, depth.shape[2], stride):
                z = depth[k, v, u] * unit
                if z <= 0:
                    continue
                a = (u - cx) / fx
                i = int(np.floor((z * (R[k, 0, 0] * a + x0) + p[k, 0] - low[0]) / pitch))
                j = int(np.floor((z * (R[k, 1, 0] * a + y0) + p[k, 1] - low[1]) / pitch))
                if 0 <= i < rows and 0 <= j < columns:
                    h = z * (R[k, 2, 0] * a + z0) + p[k, 2]
                    out[i, j, 0] += 1
                    out[i, j, 1] += min(max(h, -cap), cap)
                    out[i, j, 2] = max(out[i, j, 2], h)
    return out


@numba.njit(cache=True, nogil=True)
def surfels(
    depth: Any, unit: float, camera: Any, R: Any, p: Any, stride: int, step: int, mask: Any, low: Any, pitch: float,
    cell: float, floor: float, layers: int, noise: float,
) -> Any:  # fmt: skip
    """Return patches (N, 8) of surface: mean point, unit normal toward the cameras, pixels and views that saw it.

    step    pixels between the neighbours that give a pixel's normal
    mask    (rows, columns) bool: where on the table to look, `pitch` wide cells from the corner `low` (2,)
    cell    edge of the cube over which pixels are averaged, apart by the six main directions of their normals [m]
    floor   lowest height looked at [m], `layers` cubes up from it
    noise   standard deviation of depth at 1 m; it grows with the square
    """
    fx, fy, cx, cy = camera
    count, height, width = depth.shape
    nx, ny = int(mask.shape[0] * pitch / cell) + 1, int(mask.shape[1] * pitch / cell) + 1
    index = np.full((nx, ny, layers, 6), -1, np.int32)
    size = 4096
    sums, last = np.zeros((size, 8)), np.full(size, -1, np.int32)
    n = 0
    d, e = np.empty(3), np.empty(3)
    for k in range(count):
        for v in range(step, height - step, stride):
            b = (v - cy) / fy
            for u in range(step, width - step, stride):
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
                left, right = depth[k, v, u - step] * unit, depth[k, v, u + step] * unit
                up, down = depth[k, v - step, u] * unit, depth[k, v + step, u] * unit
                most = _STEEP * step * z / fx + 4 * noise * z * z
                if left <= 0 or right <= 0 or up <= 0 or down <= 0:
                    continue
                if max(abs(left - z), abs(right - z), abs(up - z), abs(down - z)) > most:
                    continue
                # tangents along the image's rows and columns, in the camera's axes
                s = step / fx
                d[0], d[1], d[2] = a * (right - left) + s * (right + left), b * (right - left), right - left
                s = step / fy
                e[0], e[1], e[2] = a * (down - up), b * (down - up) + s * (down + up), down - up
                cxn, cyn, czn = e[1] * d[2] - e[2] * d[1], e[2] * d[0] - e[0] * d[2], e[0] * d[1] - e[1] * d[0]
                # Not made unit: slopes then average without a pull toward the camera, whatever their noise.
                if czn >= 0:
                    continue
                cxn, cyn = -cxn / czn, -cyn / czn
                if (1 - cxn * a - cyn * b) ** 2 < 0.25 * FACING**2 * (1 + cxn * cxn + cyn * cyn) * (1 + a * a + b * b):
                    continue
                nxw = R[k, 0, 0] * cxn + R[k, 0, 1] * cyn - R[k, 0, 2]
                nyw = R[k, 1, 0] * cxn + R[k, 1, 1] * cyn - R[k, 1, 2]
                nzw = R[k, 2, 0] * cxn + R[k, 2, 1] * cyn - R[k, 2, 2]
                ax, ay, az = abs(nxw), abs(nyw), abs(nzw)
                if az >= ax and az >= ay:
                    main = 4 if nzw > 0 else 5
                elif ax >= ay:
                    main = 0 if nxw > 0 else 1
                else:
                    main = 2 if nyw > 0 else 3
                i, j = int((x - low[0]) / cell), int((y - low[1]) / cell)
                row = index[i, j, layer, main]
                if row < 0:
                    if n == size:
                        sums, last = _longer(sums, last)
                        size *= 2
                    row = index[i, j, layer, main] = n
                    n += 1
                sums[row, 0] += x
                sums[row, 1] += y
                sums[row, 2] += h
                sums[row, 3] += nxw
                sums[row, 4] += nyw
                sums[row, 5] += nzw
                sums[row, 6] += 1
                if last[row] != k:
                    sums[row, 7] += 1
                    last[row] = k
    out = sums[:n]
    for row in range(n):
        length = np.sqrt(out[row, 3] ** 2 + out[row, 4] ** 2 + out[row, 5] ** 2) + 1e-300
        for i in range(3):
            out[row, i] /= out[row, 6]
            out[row, 3 + i] /= length
    return out


@numba.njit(cache=True, nogil=True)
def _longer(sums: Any, last: Any) -> Any:
    more, views = np.zeros((2 * len(sums), sums.shape[1])), np.full(2 * len(last), -1, np.int32)
    more[: len(sums)] = sums
    views[: len(last)] = last
    return more, views


@numba.njit(cache=True, nogil=True, inline="always")
def pixel_of(camera: Any, R: Any, p: Any, k: int, x: float, y: float, h: float) -> Any:
    """Return depth [m] and the nearest pixel (u, v) of a point seen by camera k of those at (R, p)."""
    x, y, h = x - p[k, 0], y - p[k, 1], h - p[k, 2]
    z = R[k, 0, 2] * x + R[k, 1, 2] * y + R[k, 2, 2] * h
    if z <= 1e-6:
        return 0.0, -1, -1
    u = camera[2] + camera[0] * (R[k, 0, 0] * x + R[k, 1, 0] * y + R[k, 2, 0] * h) / z
    v = camera[3] + camera[1] * (R[k, 0, 1] * x + R[k, 1, 1] * y + R[k, 2, 1] * h) / z
    return z, int(np.floor(u + 0.5)), int(np.floor(v + 0.5))


@numba.njit(cache=True, nogil=True)
def looked(
    depth: Any, unit: float, camera: Any, R: Any, p: Any, x: Any, n: Any, window: float, noise: float, rows: Any
) -> int:
    """Write what the views measure near one point x (3,) with normal n (3,); return how many.

    rows (MOST_VIEWS, 6): view, pixel row, pixel column, height of the measured point over the tangent plane [m],
    cosine of incidence, whether the view saw past the point (1) or a surface within the window (0). A view that looks
    from behind or along the surface, and one whose sight is blocked, says nothing.
    window  heights looked at, in metres, beside 4 standard deviations of the depth noise
    """
    found = 0
    for k in range(min(depth.shape[0], MOST_VIEWS)):
        dx, dy, dh = x[0] - p[k, 0], x[1] - p[k, 1], x[2] - p[k, 2]
        far = np.sqrt(dx * dx + dy * dy + dh * dh)
        cosine = -(dx * n[0] + dy * n[1] + dh * n[2]) / far
        if cosine < FACING:
            continue
        z, u, v = pixel_of(camera, R, p, k, x[0], x[1], x[2])
        if u < 0 or v < 0 or u >= depth.shape[2] or v >= depth.shape[1]:
            continue
        measured = depth[k, v, u] * unit
        if measured <= 0:
            continue
        a, b = measured * (u - camera[2]) / camera[0], measured * (v - camera[3]) / camera[1]
        height = 0.0
        for i in range(3):
            q = R[k, i, 0] * a + R[k, i, 1] * b + R[k, i, 2] * measured + p[k, i]
            height += n[i] * (q - x[i])
        limit = window + 4 * noise * z * z * cosine
        if height > limit:
            continue
        rows[found, 0], rows[found, 1], rows[found, 2] = k, v, u
        rows[found, 3], rows[found, 4] = height, cosine
        rows[found, 5] = 1.0 if height < -limit else 0.0
        found += 1
    return found


@numba.njit(cache=True, nogil=True)
def settled(
    depth: Any, unit: float, camera: Any, R: Any, p: Any, xyz: Any, normal: Any, window: float, noise: float,
    rounds: int,
) -> Any:  # fmt: skip
    """Move points (N, 3) along their normals to the median of what the views measure; return support (N, 3).

    support  views that measure the surface, views that saw past it, and the rms of what is left [m]
    """
    rows = np.empty((MOST_VIEWS, 6))
    heights = np.empty(MOST_VIEWS)
    support = np.zeros((len(xyz), 3))
    for i in range(len(xyz)):
        for turn in range(rounds + 1):
            found = looked(depth, unit, camera, R, p, xyz[i], normal[i], window, noise, rows)
            on, past, square = 0, 0, 0.0
            for r in range(found):
                if rows[r, 5] > 0:
                    past += 1
                else:
                    heights[on] = rows[r, 3]
                    square += rows[r, 3] ** 2
                    on += 1
            support[i, 0], support[i, 1] = on, past
            if on == 0:
                break
            support[i, 2] = np.sqrt(square / on)
            if turn < rounds:
                # the mean of the middle half: near the median's robustness, most of the mean's precision
                order = np.sort(heights[:on])
                low, high = on // 4, on - on // 4
                step = order[low:high].mean()
                for j in range(3):
                    xyz[i, j] += step * normal[i, j]
    return support


@numba.njit(cache=True, nogil=True)
def colours(
    rgb: Any, depth: Any, unit: float, camera: Any, R: Any, p: Any, xyz: Any, normal: Any, window: float, noise: float,
    clear: float, enough: int,
) -> Any:  # fmt: skip
    """Return the median colour (N, 3) of the views that see each point, and which points `enough` of them saw (N,).

    clear  height over the table [m] below which a pixel may show the table; it counts only for a surface that faces up,
           which nothing but the table's own noise comes as near to
    """
    rows = np.empty((MOST_VIEWS, 6))
    values = np.empty((3, MOST_VIEWS))
    out, seen = np.zeros((len(xyz), 3), np.uint8), np.zeros(len(xyz), np.bool_)
    for i in range(len(xyz)):
        found = looked(depth, unit, camera, R, p, xyz[i], normal[i], window, noise, rows)
        on = 0
        for r in range(found):
            if rows[r, 5] != 0:
                continue
            k, v, u = int(rows[r, 0]), int(rows[r, 1]), int(rows[r, 2])
            z = depth[k, v, u] * unit
            height = R[k, 2, 0] * (u - camera[2]) / camera[0] + R[k, 2, 1] * (v - camera[3]) / camera[1] + R[k, 2, 2]
            if height * z + p[k, 2] < clear and normal[i, 2] < UPWARD:
                continue
            for c in range(3):
                values[c, on] = rgb[k, v, u, c]
            on += 1
        seen[i] = on >= enough
        for c in range(3):
            if on:
                out[i, c] = int(np.median(values[c, :on]) + 0.5)
    return out, seen


@numba.njit(cache=True, nogil=True)
def seen_past(
    depth: Any, unit: float, camera: Any, R: Any, p: Any, points: Any, margin: float, noise: float, enough: int
) -> Any:
    """Return how many views (N,), up to `enough`, measured something behind each point (N, 3): there it is empty.

    margin  by how much farther, beside 3 standard deviations of the depth noise [m]
    """
    out = np.zeros(len(points), np.int64)
    for i in range(len(points)):
        for k in range(depth.shape[0]):
            z, u, v = pixel_of(camera, R, p, k, points[i, 0], points[i, 1], points[i, 2])
            if u < 0 or v < 0 or u >= depth.shape[2] or v >= depth.shape[1]:
                continue
            if depth[k, v, u] * unit > z + margin + 3 * noise * z * z:
                out[i] += 1
                if out[i] >= enough:
                    break
    return out


@numba.njit(cache=True, nogil=True)
def feet(
    depth: Any, unit: float, camera: Any, R: Any, p: Any, xyz: Any, normal: Any, step: float, levels: int, noise: float
) -> Any:
    """Return how high above the table (z = 0) walls end (N,) [m]: 0 where they reach it.

    xyz     (N, 3) points of walls; normal (N, 3) level unit vectors out of them

    Down the wall, sight lines that still end on it are told from those that pass under it and end on the table, by
    least squares over all views that face it.
    """
    rows = np.empty((MOST_VIEWS, 6))
    out = np.zeros(len(xyz))
    x = np.empty(3)
    for i in range(len(xyz)):
        for level in range(1, levels + 1):
            x[0], x[1], x[2] = xyz[i, 0], xyz[i, 1], level * step
            found = looked(depth, unit, camera, R, p, x, normal[i], 2 * step, noise, rows)
            product, square, error = 0.0, 0.0, 0.0
            for r in range(found):
                k = int(rows[r, 0])
                away = x - p[k]
                # where the sight line meets the table, behind the wall
                behind = (away * normal[i]).sum() * x[2] / (p[k, 2] - x[2])
                sigma = noise * (away * away).sum() * rows[r, 4]
                if behind > 0 or rows[r, 3] < 1.5 * behind - 4 * sigma:
                    continue
                product += rows[r, 3] * behind / sigma**2
                square += behind * behind / sigma**2
                error += 1
            if error < 3 or square < 25.0:  # the two cannot be told apart yet: five standard deviations
                continue
            if product > 0.5 * square:
                out[i] = x[2]
            else:
                break
    return out
