"""Compiled passes over points: what each view says about a point, by the pixel that it falls on.

All poses here are of the camera (optical axes) in one frame whose z is the height above the table. The cameras are laid
out number by number, so that a point is projected into several views at once; only the pixels are fetched one by one.
"""

from __future__ import annotations

import math
from typing import Any

import numba
import numpy as np

from steelyard.shape.points.medians import middle_mean, quantile
from steelyard.shape.scans.depth_images import FACING, Images, lent, pixel_of

UPWARD = 0.7  # least upward component of the normal of a surface that faces up
_NOTHING, _SURFACE, _PAST = 0.0, 1.0, 2.0  # what a view says of a point


@numba.njit(cache=True, nogil=True)
def _laid_out(images: Images) -> Any:
    """Return the axes and places of the cameras as (12, V): R row by row, then p."""
    R, p = images.R, images.p
    out = np.empty((12, len(R)))
    for k in range(len(R)):
        for i in range(3):
            for j in range(3):
                out[3 * i + j, k] = R[k, i, j]
            out[9 + i, k] = p[k, i]
    return out


@numba.njit(cache=True, nogil=True)
def _room(views: int) -> tuple[Any, Any]:
    """Return what the passes over all views work with: numbers (8, V) and the places of the pixels (V,)."""
    return np.empty((8, views)), np.empty(views, np.int64)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _projected(images: Images, cameras: Any, x: Any, place: Any, at: Any) -> None:
    """Write depth [m], pixel column and row of a point x (3,) in every view, and where the pixel lies in them all.

    A view that the point does not fall into has depth -1 and place 0.
    """
    (fx, fy, cx, cy), (_, height, width) = images.lens, images.depth.shape
    r00, r01, r02, r10, r11, r12 = cameras[0], cameras[1], cameras[2], cameras[3], cameras[4], cameras[5]
    r20, r21, r22, px, py, pz = cameras[6], cameras[7], cameras[8], cameras[9], cameras[10], cameras[11]
    depth, column, row = place[0], place[1], place[2]
    x0, x1, x2 = x[0], x[1], x[2]
    for k in range(len(px)):
        dx, dy, dh = x0 - px[k], x1 - py[k], x2 - pz[k]
        z = r02[k] * dx + r12[k] * dy + r22[k] * dh
        u = np.floor(cx + fx * (r00[k] * dx + r10[k] * dy + r20[k] * dh) / z + 0.5)
        v = np.floor(cy + fy * (r01[k] * dx + r11[k] * dy + r21[k] * dh) / z + 0.5)
        falls = (z > 1e-6) & (u >= 0) & (v >= 0) & (u < width) & (v < height)
        depth[k], column[k], row[k] = z if falls else -1.0, u, v
        at[k] = np.int64((float(k) * height + v) * width + u if falls else 0.0)


@numba.njit(cache=True, nogil=True, forceinline=True)
def _fetched(images: Images, cameras: Any, x: Any, work: Any, at: Any) -> None:
    """Write what every view measures where it has a point x (3,): work (8, V) as in `_looked`, from row 3 on."""
    pixels, measured = images.depth.reshape(-1), work[6]
    _projected(images, cameras, x, work[3:6], at)
    for k in range(len(at)):
        measured[k] = pixels[at[k]]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _incidence(cameras: Any, x: Any, n: Any, cosine: Any) -> None:
    """Write the cosine of incidence of every view's sight line on a point (3,) with normal n (3,)."""
    px, py, pz = cameras[9], cameras[10], cameras[11]
    x0, x1, x2, n0, n1, n2 = x[0], x[1], x[2], n[0], n[1], n[2]
    for k in range(len(px)):
        dx, dy, dh = x0 - px[k], x1 - py[k], x2 - pz[k]
        cosine[k] = -(dx * n0 + dy * n1 + dh * n2) / math.sqrt(dx * dx + dy * dy + dh * dh)


@numba.njit(cache=True, nogil=True, forceinline=True)
def _looked(images: Images, cameras: Any, x: Any, n: Any, window: float, noise: float, work: Any, at: Any) -> None:
    """Write what every view measures near one point x (3,) with normal n (3,).

    work (8, V): what the view says, height of the measured point over the tangent plane [m], cosine of incidence, depth
    of the point [m], pixel column, pixel row; the last two are scratch. A view says that it measured a surface within
    the window, or that it saw past the point; one that looks from behind or along the surface, and one whose sight is
    blocked, says nothing.
    window  heights looked at, in metres, beside 4 standard deviations of the depth noise
    """
    pixels, measured = images.depth.reshape(-1), work[6]
    _incidence(cameras, x, n, work[2])
    _projected(images, cameras, x, work[3:6], at)
    for k in range(len(at)):
        measured[k] = pixels[at[k] if work[2, k] >= FACING else 0]  # others say nothing: their pixels are not fetched
    _said(images.unit, images.lens, cameras, x, n, window, noise, work)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _said(unit: float, lens: Any, cameras: Any, x: Any, n: Any, window: float, noise: float, work: Any) -> None:
    """Write what every view says and how high over the tangent plane it measures; `_looked` without the pixels."""
    fx, fy, cx, cy = lens
    r00, r01, r02, r10, r11, r12 = cameras[0], cameras[1], cameras[2], cameras[3], cameras[4], cameras[5]
    r20, r21, r22, px, py, pz = cameras[6], cameras[7], cameras[8], cameras[9], cameras[10], cameras[11]
    says, over, cosine, depth, column, row, measured = work[0], work[1], work[2], work[3], work[4], work[5], work[6]
    x0, x1, x2, n0, n1, n2 = x[0], x[1], x[2], n[0], n[1], n[2]
    for k in range(len(px)):
        m, z = measured[k] * unit, depth[k]
        a, b = m * (column[k] - cx) / fx, m * (row[k] - cy) / fy
        height = n0 * (r00[k] * a + r01[k] * b + r02[k] * m + px[k] - x0)
        height += n1 * (r10[k] * a + r11[k] * b + r12[k] * m + py[k] - x1)
        height += n2 * (r20[k] * a + r21[k] * b + r22[k] * m + pz[k] - x2)
        limit = window + 4 * noise * z * z * cosine[k]
        heard = (z > 0) & (cosine[k] >= FACING) & (m > 0) & (height <= limit)
        over[k] = height
        says[k] = (_PAST if height < -limit else _SURFACE) if heard else _NOTHING


@numba.njit(cache=True, nogil=True)
def settled(images: Images, xyz: Any, normal: Any, window: float, noise: float, rounds: int) -> Any:
    """Move points (N, 3) along their normals to the middle of what the views measure; return support (N, 3).

    support  views that measure the surface, views that saw past it, and the rms of what is left [m]; by the pixels that
             the points fell on before their last move
    """
    images = lent(images)
    cameras = _laid_out(images)
    work, at = _room(len(images.p))
    says, over, heights = work[0], work[1], work[7]
    support = np.zeros((len(xyz), 3))
    for i in range(len(xyz)):
        for turn in range(max(rounds, 1)):
            _looked(images, cameras, xyz[i], normal[i], window, noise, work, at)
            on, past, square = 0, 0, 0.0
            for k in range(len(at)):
                heights[on] = over[k]
                on += says[k] == _SURFACE
                past += says[k] == _PAST
            support[i, 0], support[i, 1] = on, past
            if on == 0:
                break
            step = middle_mean(heights, on) if turn < rounds else 0.0
            for r in range(on):
                square += (heights[r] - step) ** 2
            support[i, 2] = np.sqrt(square / on)
            for j in range(3):
                xyz[i, j] += step * normal[i, j]
    return support


@numba.njit(cache=True, nogil=True)
def said(images: Images, xyz: Any, normal: Any, window: float, noise: float) -> Any:
    """Return of how many points (N, 3) each view measures the surface, and past how many it sees: (V, 2)."""
    images = lent(images)
    cameras = _laid_out(images)
    work, at = _room(len(images.p))
    out = np.zeros((len(at), 2))
    for i in range(len(xyz)):
        _looked(images, cameras, xyz[i], normal[i], window, noise, work, at)
        for k in range(len(at)):
            out[k, 0] += work[0, k] == _SURFACE
            out[k, 1] += work[0, k] == _PAST
    return out


@numba.njit(cache=True, nogil=True)
def colours(
    rgb: Any, images: Images, xyz: Any, normal: Any, window: float, noise: float, clear: float, enough: int
) -> Any:
    """Return the median colour (N, 3) of the views that see each point, and which points `enough` of them saw (N,).

    clear  height over the table [m] below which a pixel may show the table; it counts only for a surface that faces up,
           which nothing but the table's own noise comes as near to
    """
    depth, unit, camera, R, p = images
    images = lent(images)
    cameras = _laid_out(images)
    work, at = _room(len(depth))
    values, pixels, heights = np.empty((3, len(depth))), rgb.reshape(-1, 3), depth.reshape(-1)
    out, seen = np.zeros((len(xyz), 3), np.uint8), np.zeros(len(xyz), np.bool_)
    for i in range(len(xyz)):
        _looked(images, cameras, xyz[i], normal[i], window, noise, work, at)
        on = 0
        for k in range(len(at)):
            if work[0, k] != _SURFACE:
                continue
            if normal[i, 2] < UPWARD:
                v, u = (at[k] // depth.shape[2]) % depth.shape[1], at[k] % depth.shape[2]
                a, b = (u - camera[2]) / camera[0], (v - camera[3]) / camera[1]
                up = R[k, 2, 0] * a + R[k, 2, 1] * b + R[k, 2, 2]
                if up * heights[at[k]] * unit + p[k, 2] < clear:
                    continue
            for c in range(3):
                values[c, on] = pixels[at[k], c]
            on += 1
        seen[i] = on >= enough
        for c in range(3):
            if on:
                out[i, c] = int(quantile(values[c], on, 0.5) + 0.5)
    return out, seen


@numba.njit(cache=True, nogil=True)
def seen_past(images: Images, points: Any, margin: float, noise: float, enough: int) -> Any:
    """Return how many views, up to `enough`, measured something behind each point (N, 3): there it is empty. (N, 2)

    margin  by how much farther, beside 3 standard deviations of the depth noise [m]

    Of where fewer than `enough` did, also by how many more views have the surface that they measure there, within that
    noise, behind the point than before it: one view cannot tell on which side of it a point lies, but most can.

    Views that saw past the point before are asked first: that changes how soon there are enough and nothing else.
    """
    images = lent(images)
    cameras = _laid_out(images)
    work, at = _room(len(images.p))
    last, known = np.empty(enough, np.int64), 0
    beyond, out = work[6], np.zeros((len(points), 2), np.int64)
    for i in range(len(points)):
        again = known == enough
        for m in range(enough if again else 0):
            again = _past(images, last[m], points[i], margin, noise)
            if not again:
                break
        if again:
            out[i, 0] = enough
            continue
        _fetched(images, cameras, points[i], work, at)
        known, out[i, 1] = _behind(work, images.unit, margin, noise)
        if known >= enough:
            known = 0
            for k in range(len(at)):
                if known < enough and beyond[k] > 0:
                    last[known] = k
                    known += 1
        out[i, 0] = known
    return out


@numba.njit(cache=True, nogil=True)
def sights(images: Images, points: Any, noise: float) -> Any:
    """Return how many views see past each point (N, 3), and how many measure something there: (N, 2).

    Within 3 standard deviations of the depth noise, and three pixel widths before it for a surface seen flat.
    """
    images = lent(images)
    cameras = _laid_out(images)
    work, at = _room(len(images.p))
    out = np.zeros((len(points), 2))
    for i in range(len(points)):
        _fetched(images, cameras, points[i], work, at)
        out[i] = _past_and_on(work, images.unit, images.lens[0], noise)
    return out


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _past_and_on(work: Any, unit: float, focal: float, noise: float) -> tuple[int, int]:
    """Return how many views measured something behind a point, and how many something there."""
    depth, measured, past, on = work[3], work[6], 0, 0
    for k in range(len(depth)):
        z = depth[k]
        behind, error = measured[k] * unit - z, 3 * noise * z * z
        past += (z > 0) & (behind > error)
        on += (z > 0) & (-error - 3 * z / focal <= behind) & (behind <= error)
    return past, on


@numba.njit(cache=True, nogil=True)
def _behind(work: Any, unit: float, margin: float, noise: float) -> tuple[int, int]:
    """Return how many views measured something behind a point, marked by 1, the others by 0; and, within the noise, by
    how many more something behind it than before it."""
    depth, measured, found, outer = work[3], work[6], 0, 0
    for k in range(len(depth)):
        z = depth[k]
        behind, error = measured[k] * unit - z, margin + 3 * noise * z * z
        past = (z > 0) & (behind > error)
        measured[k] = 1.0 if past else 0.0
        found += past
        outer += ((z > 0) & (behind > 0)) ^ past
        outer -= (z > 0) & (behind < 0) & (behind >= -error)
    return found, outer


@numba.njit(cache=True, nogil=True)
def _past(images: Images, k: int, x: Any, margin: float, noise: float) -> bool:
    """Return whether view k measured something behind a point x (3,)."""
    depth = images.depth
    z, u, v = pixel_of(images, k, x)
    if u < 0 or v < 0 or u >= depth.shape[2] or v >= depth.shape[1]:
        return False
    return bool(depth[k, v, u] * images.unit > z + margin + 3 * noise * z * z)


@numba.njit(cache=True, nogil=True)
def feet(images: Images, xyz: Any, normal: Any, step: float, levels: int, noise: float) -> Any:
    """Return how high above the table (z = 0) walls end (N,) [m]: 0 where they reach it.

    xyz     (N, 3) points of walls; normal (N, 3) level unit vectors out of them

    Down the wall, sight lines that still end on it are told from those that pass under it and end on the table, by
    least squares over all views that face it.
    """
    images = lent(images)
    cameras, p = _laid_out(images), images.p
    work, at = _room(len(p))
    out = np.zeros(len(xyz))
    x = np.empty(3)
    for i in range(len(xyz)):
        for level in range(1, levels + 1):
            x[0], x[1], x[2] = xyz[i, 0], xyz[i, 1], level * step
            _looked(images, cameras, x, normal[i], 2 * step, noise, work, at)
            product, square, error = 0.0, 0.0, 0.0
            for k in range(len(at)):
                if work[0, k] == _NOTHING:
                    continue
                height = work[1, k]
                dx, dy, dh = x[0] - p[k, 0], x[1] - p[k, 1], x[2] - p[k, 2]
                # where the sight line meets the table, behind the wall
                behind = (dx * normal[i, 0] + dy * normal[i, 1] + dh * normal[i, 2]) * x[2] / (p[k, 2] - x[2])
                sigma = noise * (dx * dx + dy * dy + dh * dh) * work[2, k]
                if behind > 0 or height < 1.5 * behind - 4 * sigma:
                    continue
                product += height * behind / sigma**2
                square += behind * behind / sigma**2
                error += 1
            if error < 3 or square < 25.0:  # the two cannot be told apart yet: five standard deviations
                continue
            if product > 0.5 * square:
                out[i] = x[2]
            else:
                break
    return out
