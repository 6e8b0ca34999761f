"""Scans without a camera: RGB-D views of a coloured mesh that lies on a table, with a depth camera's errors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numba
import numpy as np
from scipy.spatial import ConvexHull

from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.shape.eight_bits import Colours
from steelyard.shape.mesh import TriangleMesh, part_moments
from steelyard.shape.views import Depths, Intrinsics, Views
from steelyard.simulate.camera import D435, VIEWS, DepthNoise, disturbed, wrist_arc
from steelyard.spatial import Pose, Rotation, area_vectors, unit_vectors

_TABLE = (171, 152, 124)
_TABLE_REACH = 0.6  # half the edge of the square table [m]
_CLOSEST = 0.28  # the camera measures no depth nearer than this [m]
_FILL = 0.85  # distance of the camera in diagonals of the object, so that all of it fits
_LAMP = np.array([0.25, -0.35, 0.9])
_AMBIENT = 0.75
_JUMP = 0.01  # depth step, as a part of the depth, that stereo matching stumbles over


@dataclass(frozen=True, eq=False)
class Scanned:
    """A simulated scan: the views, and the truth that nobody sees.

    views  what the camera and the robot report
    exact  depth without errors at the true poses, without colour
    X_WO   true pose of the mesh's frame in W; the table is z = 0
    X_WC   true poses (V,) of the camera
    """

    views: Views
    exact: Views
    X_WO: Pose
    X_WC: Pose


def scan_mesh(
    mesh: TriangleMesh,
    seed: int = 0,
    *,
    count: int = VIEWS,
    noise: DepthNoise | None = DepthNoise(),  # noqa: B008  (a frozen value)
    pose_std: tuple[float, float] = (0.0, 0.0),
    intrinsics: Intrinsics = D435,
    depth_unit: float = 0.001,
    X_WO: Pose | None = None,
    aim: tuple[float, float, float] | None = None,
    distance: float | None = None,
) -> Scanned:
    """Return RGB-D views of `mesh` lying on the table z = 0, along a wrist's arc. Same seed, same scan.

    noise       None for an ideal camera (still in whole depth units)
    pose_std    error of the reported poses [mm, deg]
    X_WO        where the mesh lies; left out, it rests on its most stable side, turned by chance
    aim         where in W all cameras look, left out the middle of the mesh
    distance    of the cameras from there [m], left out such that all of the mesh fits into the images
    """
    rng = np.random.default_rng(seed)
    yaw = rng.uniform(0, 2 * np.pi)
    X_WO = X_WO or resting_pose(mesh, yaw)
    placed = mesh.in_frame(X_WO)
    low, high = placed.bounds
    target = np.array([*(low + high)[:2] / 2, 0.4 * high[2]] if aim is None else aim)
    distance = distance or max(_CLOSEST, _FILL * float(np.linalg.norm(high - low)))
    X_WC = wrist_arc(target, distance, count, start=rng.uniform(0, 360))
    depth, exact, rgb = _images(placed, intrinsics, X_WC, depth_unit, noise, rng)
    reported = disturbed(X_WC, *pose_std, rng) if any(pose_std) else X_WC
    return Scanned(
        Views(depth, rgb, intrinsics, reported, depth_unit),
        Views(exact, None, intrinsics, X_WC, depth_unit),
        X_WO,
        X_WC,
    )


def _images(
    placed: TriangleMesh,
    intrinsics: Intrinsics,
    X_WC: Pose,
    depth_unit: float,
    noise: DepthNoise | None,
    rng: np.random.Generator,
) -> tuple[Depths, Depths, Colours]:
    """Return the depth (V, H, W) of every view as measured and as it is, in `depth_unit`, and the colours."""
    size = (len(X_WC.position), intrinsics.height, intrinsics.width)
    depth, exact, rgb = np.zeros(size, np.uint16), np.zeros(size, np.uint16), np.zeros((*size, 3), np.uint8)
    colour = _shaded(placed)
    for k in range(size[0]):
        z, cosine, rgb[k] = render(placed, colour, intrinsics, X_WC[k])
        exact[k] = np.minimum(np.round(z / depth_unit), 65535)
        if noise is not None:
            z = _measured(z, cosine, noise, rng)
            rgb[k] = _grainy(rgb[k], noise.rgb, rng)
        depth[k] = np.minimum(np.round(z / depth_unit), 65535)
    return depth, exact, rgb


def resting_pose(mesh: TriangleMesh, yaw: float = 0.0) -> Pose:
    """Return X_WO with the mesh at rest on z = 0, on the side where its centroid is lowest, near the origin of W.

    The side is a face of the convex hull that the centroid (of even density) stands above.
    """
    hull = ConvexHull(mesh.vertices)
    moments = part_moments(mesh).sum(0)
    middle = moments[1:4] / moments[0]
    best: tuple[float, Array] | None = None
    for equation in np.unique(np.round(hull.equations, 6), axis=0):
        normal, height = equation[:3], -float(equation[:3] @ middle + equation[3])
        R = _turned_down(normal)
        side = hull.points[hull.vertices]
        foot = side[np.abs(side @ normal + equation[3]) < 1e-5] @ R.T
        if _stands_inside((R @ middle)[:2], foot[:, :2]) and (best is None or height < best[0]):
            best = (height, R)
    if best is None:
        raise BadValue("The mesh rests on no side of its convex hull; check that its parts are closed.")
    about = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    R = about @ best[1]
    turned = mesh.vertices @ R.T
    low, high = turned.min(0), turned.max(0)
    return Pose(Rotation.nearest(R), np.array([*-(low + high)[:2] / 2, -low[2]]))


def _turned_down(normal: Array) -> Array:
    """Return the rotation (3, 3) that takes a unit vector to -z."""
    x = np.cross(normal, [1.0, 0, 0] if abs(normal[0]) < 0.7 else [0, 1.0, 0])
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(-normal, x), -normal])


def _stands_inside(point: Array, foot: Array) -> bool:
    """Whether a point (2,) lies inside the convex hull of points (N, 2)."""
    if len(foot) < 3 or np.linalg.matrix_rank(foot - foot.mean(0), tol=1e-6) < 2:
        return False
    return bool((ConvexHull(foot).equations @ [*point, 1.0] < 0).all())


def _shaded(mesh: TriangleMesh) -> Colours:
    """Return the colours (F, 3) of triangles under one lamp and much ambient light."""
    normal = unit_vectors(area_vectors(mesh.corners))
    light = _AMBIENT + (1 - _AMBIENT) * np.maximum(normal @ _LAMP, 0)
    return np.asarray(np.clip(mesh.colours * light[:, None], 0, 255), np.uint8)


def render(mesh: TriangleMesh, rgb: Colours, intrinsics: Intrinsics, X_WC: Pose) -> tuple[Array, Array, Colours]:
    """Return exact depth (H, W) [m] (0 where nothing is), cosine of incidence (H, W) and colour (H, W, 3).

    mesh  in W, above the table z = 0
    rgb   (F, 3) uint8 of its triangles
    """
    X_CW = X_WC.inverse()
    shape = (intrinsics.height, intrinsics.width)
    z, cosine, colour = np.empty(shape), np.empty(shape), np.empty((*shape, 3), np.uint8)
    R = X_WC.rotation.matrix
    _draw_table(intrinsics.vector, R, X_WC.position, _TABLE_REACH, np.array(_TABLE, np.uint8), z, cosine, colour)
    _draw_triangles(X_CW.apply(mesh.vertices)[mesh.triangles], rgb, intrinsics.vector, z, cosine, colour)
    return z, cosine, colour


@numba.njit(cache=True, nogil=True)
def _draw_table(camera: Any, R: Any, p: Any, reach: float, paint: Any, z: Any, cosine: Any, colour: Any) -> None:
    """Draw the table z = 0 of W, |x|, |y| < reach."""
    fx, fy, cx, cy = camera
    for v in range(z.shape[0]):
        for u in range(z.shape[1]):
            a, b = (u - cx) / fx, (v - cy) / fy
            down = R[2, 0] * a + R[2, 1] * b + R[2, 2]
            depth = -p[2] / down if down < 0 else 0.0
            x = p[0] + depth * (R[0, 0] * a + R[0, 1] * b + R[0, 2])
            y = p[1] + depth * (R[1, 0] * a + R[1, 1] * b + R[1, 2])
            on = depth > 0 and abs(x) < reach and abs(y) < reach
            z[v, u] = depth if on else 0.0
            cosine[v, u] = -down / np.sqrt(1 + a * a + b * b) if on else 0.0
            for k in range(3):
                colour[v, u, k] = paint[k] if on else 90


@numba.njit(cache=True, nogil=True)
def _draw_triangles(corners: Any, rgb: Any, camera: Any, z: Any, cosine: Any, colour: Any) -> None:
    """Draw triangles (F, 3, 3) given in the camera's frame, nearest first at each pixel; 1/z is linear on the image."""
    fx, fy, cx, cy = camera
    height, width = z.shape
    x, y, w = np.empty(3), np.empty(3), np.empty(3)
    for f in range(len(corners)):
        t = corners[f]
        if min(t[0, 2], t[1, 2], t[2, 2]) < 0.01:
            continue
        for k in range(3):
            w[k] = 1 / t[k, 2]
            x[k], y[k] = cx + fx * t[k, 0] * w[k], cy + fy * t[k, 1] * w[k]
        area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0])
        if abs(area) < 1e-12:
            continue
        n = np.cross(t[1] - t[0], t[2] - t[0])
        size = np.sqrt((n * n).sum())
        for v in range(max(0, int(np.ceil(y.min()))), min(height - 1, int(np.floor(y.max()))) + 1):
            for u in range(max(0, int(np.ceil(x.min()))), min(width - 1, int(np.floor(x.max()))) + 1):
                b0 = ((x[1] - u) * (y[2] - v) - (x[2] - u) * (y[1] - v)) / area
                b1 = ((x[2] - u) * (y[0] - v) - (x[0] - u) * (y[2] - v)) / area
                b2 = 1 - b0 - b1
                if b0 < -1e-9 or b1 < -1e-9 or b2 < -1e-9:
                    continue
                depth = 1 / (b0 * w[0] + b1 * w[1] + b2 * w[2])
                if z[v, u] == 0 or depth < z[v, u]:
                    a, b = (u - cx) / fx, (v - cy) / fy
                    z[v, u] = depth
                    cosine[v, u] = abs(n[0] * a + n[1] * b + n[2]) / (size * np.sqrt(1 + a * a + b * b) + 1e-300)
                    for k in range(3):
                        colour[v, u, k] = rgb[f, k]


def _grainy(rgb: Colours, std: float, rng: np.random.Generator) -> Colours:
    """Return a colour image (H, W, 3) with noise of `std` levels; channels share draws, shifted by a pixel."""
    height, width = rgb.shape[:2]
    drawn = np.float32(std) * rng.standard_normal((height, width + 2), np.float32)
    grain = np.stack([drawn[:, k : k + width] for k in range(3)], axis=2)
    return np.asarray(np.clip(rgb + grain + np.float32(0.5), 0, 255), np.uint8)


def _measured(z: Array, cosine: Array, noise: DepthNoise, rng: np.random.Generator) -> Array:
    """Return what the depth camera reports of exact depth (H, W) [m]."""
    normal = rng.standard_normal(z.shape, np.float32)
    chance = rng.random((2, *z.shape), np.float32)
    out = np.empty_like(z)
    _err(z, cosine, normal, chance, noise.per_square, noise.edge, noise.grazing, noise.speckle, _CLOSEST * 0.6, out)
    return out


@numba.njit(cache=True, nogil=True)
def _bent(z: Any, u: int, v: int, jump: float) -> bool:
    """Whether depth changes at a pixel by more than a slope does."""
    height, width = z.shape
    across = abs(z[v, max(u - 1, 0)] - 2 * z[v, u] + z[v, min(u + 1, width - 1)])
    down = abs(z[max(v - 1, 0), u] - 2 * z[v, u] + z[min(v + 1, height - 1), u])
    return bool(max(across, down) > jump)


@numba.njit(cache=True, nogil=True)
def _err(
    z: Any, cosine: Any, normal: Any, chance: Any, per_square: float, edge: float, grazing: float, speckle: float,
    closest: float, out: Any,
) -> None:  # fmt: skip
    """Write measured depth: correlated disparity noise; edges and grazing surfaces lose pixels, some fly."""
    height, width = z.shape
    for v in range(height):
        for u in range(width):
            here = z[v, u]
            total, near, far = 0.0, here, here
            for dv in range(max(0, v - 1), min(height, v + 2)):
                for du in range(max(0, u - 1), min(width, u + 2)):
                    # a smoothing window of 1 2 1: its errors keep unit variance after division by 6
                    total += (2 - abs(dv - v)) * (2 - abs(du - u)) * normal[dv, du]
                    if z[dv, du] > 0:
                        near, far = min(near, z[dv, du]), max(far, z[dv, du])
            out[v, u] = 0.0
            draw = chance[0, v, u]
            if here < closest or draw < speckle:
                continue
            lost = 1 / (1 + np.exp((cosine[v, u] - grazing) * 40))
            if chance[1, v, u] < lost:
                continue
            if far - near > _JUMP * here and _bent(z, u, v, _JUMP * here):
                if draw < edge:
                    continue
                if draw < 1.5 * edge:
                    here = near + (far - near) * chance[1, v, u]
            out[v, u] = here + per_square * here * here * total / 6.0
