"""From posed RGB-D views to one coloured, oriented cloud of the object on the table."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.findings import Finding
from steelyard.shape import depth_images as images
from steelyard.shape.cloud import Cloud
from steelyard.shape.registration import moved
from steelyard.shape.table_plane import find_table, table_frame
from steelyard.shape.thinning import spread, spread_to
from steelyard.shape.underside import Underside, underside
from steelyard.shape.views import TablePlane, Views
from steelyard.spatial import Pose, Rotation

POINTS = 3000  # of the cloud, about
_SAMPLES = 60_000  # points that find the table
_MAP_STRIDE, _SURFEL_STRIDE = 2, 2
_NORMAL_STEP = 2
_REACH = 0.6  # of the camera's distance: how far from where the cameras look the object may lie
_CELL = 2.0  # edge of the cubes that pixels are averaged over, in pixel widths at the object
_LEAST_VIEWS = 3
_POSE_STD = (0.005, np.radians(1.0))  # how far reported poses may be off
_WINDOW = 0.002
_DISAGREE = 1.3
_WALL = 0.5  # a normal less upright than this belongs to a wall
_FOOT, _HIGHEST_FOOT = 0.0005, 0.008
_CELLS = 8000  # of the grid under the object, about


@dataclass(frozen=True, eq=False)
class Scan:
    """What views say of an object on a table.

    cloud      points of its surface in W with colours and normals, underside closed
    spacing    least distance of two points [m]
    table      plane that it lies on, in W
    seen       points of the cloud that cameras saw; the rest close the underside
    views      how many were fused
    noise_std  depth noise at the object's distance, found on the table [m]
    disagree   spread of the views about the surface, in depth noise: 1 where they agree
    moved_m    rms shift of the cameras by registration, None where the poses were good enough
    findings   what you must know
    stages     CPU time of each step [s]
    empty      whether points (N, 3) of W are known to be outside the object
    """

    cloud: Cloud
    spacing: float
    table: TablePlane
    seen: int
    views: int
    noise_std: float
    disagree: float
    moved_m: float | None
    findings: tuple[Finding, ...]
    stages: dict[str, float]
    empty: Callable[[Array], Any] = field(repr=False)


@dataclass(eq=False)
class _Scene:
    """The images with their poses in the table's frame."""

    views: Views
    X_WT: Pose
    R: Array
    p: Array
    distance: float
    noise: float

    @property
    def pixel(self) -> float:
        """Width of a pixel at the object [m]."""
        return self.distance / self.views.intrinsics.fx

    @property
    def sigma(self) -> float:
        """Standard deviation of depth at the object [m]."""
        return self.noise * self.distance**2

    def images(self) -> tuple[Any, float, Array, Array, Array]:
        return self.views.depth, self.views.depth_unit, self.views.intrinsics.vector, self.R, self.p


def fuse(views: Views, points: int = POINTS) -> Scan:
    """Return the object that lies on the table as one cloud of about `points` points.

    Raises CannotAnswer where no table or no object on it is found.
    """
    clock = _Clock()
    scene, table = _scene(views)
    clock.lap("table")
    mask, low, pitch, others = _object_on_table(scene)
    clock.lap("object")
    patches = _surfels(scene, mask, low, pitch)
    clock.lap("surfels")
    patches, disagree, shift = _agreed(scene, patches, mask, low, pitch)
    clock.lap("registration")
    xyz, normal, level = _surface(scene, patches, mask, low, pitch, points)
    clock.lap("surface")
    xyz, normal, seen, spacing, bottom = _closed(scene, xyz, normal, points)
    clock.lap("underside")
    rgb = _colours(scene, xyz, normal, seen)
    clock.lap("colour")
    cloud = Cloud(xyz, rgb, None, normal).in_frame(scene.X_WT)
    findings = _findings(scene, others, disagree)
    return Scan(
        cloud=cloud, spacing=spacing, table=table, seen=seen, views=len(views), noise_std=scene.sigma,
        disagree=disagree, moved_m=shift, findings=findings, stages=clock.laps, empty=_empty(scene, bottom),
    )  # fmt: skip


class _Clock:
    def __init__(self) -> None:
        self.laps: dict[str, float] = {}
        self._last = time.thread_time()

    def lap(self, name: str) -> None:
        now = time.thread_time()
        self.laps[name] = now - self._last
        self._last = now


def _scene(views: Views) -> tuple[_Scene, TablePlane]:
    """Return the images in the table's frame, and the table."""
    R, p = views.X_WC.rotation.matrix, views.X_WC.position
    stride = max(1, int(np.sqrt(views.depth.size / _SAMPLES)))
    sampled = images.sampled(views.depth, views.depth_unit, views.intrinsics.vector, R, p, stride)
    looks = _looked_at(R, p)
    distance = float(np.median(np.linalg.norm(p - looks, axis=1)))
    table = find_table(sampled[:, :3], p, distance, views.table)
    X_WT = table_frame(table, looks)
    noise = _depth_noise(sampled, X_WT.inverse().apply(sampled[:, :3]), views.depth_unit, distance)
    X_TC = X_WT.inverse() @ views.X_WC
    R, p = np.ascontiguousarray(X_TC.rotation.matrix), np.ascontiguousarray(X_TC.position)
    return _Scene(views, X_WT, R.copy(), p.copy(), distance, noise), table


def _looked_at(R: Array, p: Array) -> Array:
    """Return the point (3,) nearest to all optical axes; where they are parallel, half a metre along the first."""
    axis = R[:, :, 2]
    across = np.eye(3) - axis[:, :, None] * axis[:, None, :]
    # A weak pull, so that a single view has an answer too.
    start = p.mean(0) + 0.5 * axis.mean(0)
    H = across.sum(0) + 1e-3 * np.eye(3)
    return np.asarray(np.linalg.solve(H, np.einsum("vij,vj->i", across, p) + 1e-3 * start))


def _depth_noise(sampled: Array, xyz: Array, unit: float, distance: float) -> float:
    """Return the standard deviation of depth at 1 m: what each view's own plane leaves of its table points."""
    spreads = []
    view = sampled[:, 4].astype(int)
    near = np.abs(xyz[:, 2]) < 0.03 * distance
    for k in np.unique(view):
        rows = near & (view == k)
        if rows.sum() < 30:
            continue
        scale = sampled[rows, 3] ** 2
        A = np.column_stack([np.ones(rows.sum()), xyz[rows, :2]]) / scale[:, None]
        b = xyz[rows, 2] / scale
        keep = np.ones(len(b), bool)
        for _ in range(3):
            plane = np.linalg.lstsq(A[keep], b[keep], rcond=None)[0]
            rest = b - A @ plane
            spread = float(np.subtract(*np.percentile(rest, (75, 25)))) / 1.35
            keep = np.abs(rest) < 3 * max(spread, 1e-9)
        spreads.append(spread)
    # heights over the table are depth errors times the cosine of incidence, about 0.7 for a wrist's arc
    found = float(np.median(spreads)) / 0.7 if spreads else 0.0
    return max(found, unit / np.sqrt(12) / distance**2)


def _object_on_table(scene: _Scene) -> tuple[Any, Array, float, int]:
    """Return where on the table the object lies, with a margin: mask (I, J), corner (2,), cell [m]; other objects."""
    pitch = 2 * scene.pixel
    half = int(_REACH * scene.distance / pitch)
    low = np.full(2, -half * pitch)
    size = 2 * half
    sums = images.height_map(*scene.images(), _MAP_STRIDE, low, pitch, 6 * scene.sigma, size, size)
    count, mean = sums[..., 0], sums[..., 1] / np.maximum(sums[..., 0], 1)
    watched = count >= 0.25 * np.median(count[count > 0])
    spread = float(np.subtract(*np.percentile(mean[watched], (75, 25)))) / 1.35
    level = float(np.median(mean[watched]))
    up = watched & (mean > level + max(5 * spread, 0.3 * scene.sigma))
    label, found = ndimage.label(ndimage.binary_opening(up, np.ones((2, 2))), np.ones((3, 3)))
    if not found:
        raise CannotAnswer("no object was found on the table: nothing stands out of it where the cameras look.")
    area = np.bincount(label.ravel(), minlength=found + 1)[1:]
    largest = int(np.argmax(area)) + 1
    others = int((area > max(0.1 * area.max(), 25)).sum()) - 1
    margin = max(3, int(np.ceil(0.008 / pitch)))
    mine = ndimage.binary_dilation(label == largest, np.ones((3, 3)), iterations=margin)
    stranger = ndimage.binary_dilation((label > 0) & (label != largest) & np.isin(label, 1 + np.flatnonzero(area > 25)), np.ones((3, 3)))
    return mine & ~stranger, low, pitch, others


def _surfels(scene: _Scene, mask: Any, low: Array, pitch: float) -> Array:
    """Return patches (N, 8) of the object and of the table around it."""
    cell = _CELL * scene.pixel
    floor = -4 * scene.sigma - 2 * cell
    highest = float((scene.p[:, 2]).min())
    layers = int((min(highest, _REACH * scene.distance) - floor) / cell) + 1
    found = images.surfels(
        *scene.images(), _SURFEL_STRIDE, _NORMAL_STEP, mask, low, pitch, cell, floor, layers, scene.noise
    )
    return np.asarray(found[found[:, 7] >= min(_LEAST_VIEWS, len(scene.R))])


def _agreed(scene: _Scene, patches: Array, mask: Any, low: Array, pitch: float) -> tuple[Array, float, float | None]:
    """Return patches, how far the views disagree, and the rms shift of cameras if moving them made it better."""
    before = _disagreement(scene, patches)
    return patches, before, None


def _disagreement(scene: _Scene, patches: Array) -> float:
    """Return the median spread of the views about the surface, in standard deviations of depth."""
    order = np.argsort(-patches[:, 6], kind="stable")
    rows = spread(patches[:, :3], patches[:, 3:6], order, 4 * scene.pixel)[:2000]
    xyz, normal = patches[rows, :3].copy(), patches[rows, 3:6].copy()
    support = images.settled(*scene.images(), xyz, normal, 0.005, scene.noise, 1)
    good = support[:, 0] >= _LEAST_VIEWS
    return float(np.median(support[good, 2])) / (0.7 * scene.sigma)


def _surface(scene: _Scene, patches: Array, mask: Any, low: Array, pitch: float, points: int) -> tuple[Array, Array, float]:
    """Return points (N, 3) of the object's surface and normals, settled among the views."""
    order = np.argsort(-patches[:, 6], kind="stable")
    rows, _ = spread_to(patches[:, :3], patches[:, 3:6], order, 6 * points, scene.pixel)
    xyz, normal = patches[rows, :3].copy(), patches[rows, 3:6].copy()
    support = images.settled(*scene.images(), xyz, normal, _WINDOW, scene.noise, 2)
    least = min(_LEAST_VIEWS, len(scene.R))
    good = (support[:, 0] >= least) & (support[:, 1] <= 0.5 * support[:, 0])
    table = good & (normal[:, 2] > 0.9) & (np.abs(xyz[:, 2]) < 4 * scene.sigma)
    level, rough = 0.0, 0.1 * scene.sigma
    object_cells = ndimage.binary_erosion(mask, np.ones((3, 3)), iterations=3)
    cell = np.floor((xyz[:, :2] - low) / pitch).astype(int)
    around = table & ~object_cells[cell[:, 0].clip(0, mask.shape[0] - 1), cell[:, 1].clip(0, mask.shape[1] - 1)]
    if around.sum() >= 20:
        level = float(np.median(xyz[around, 2]))
        rough = float(np.subtract(*np.percentile(xyz[around, 2], (75, 25)))) / 1.35
    xyz[:, 2] -= level
    scene.p[:, 2] -= level
    keep = good & (xyz[:, 2] > 5 * rough)
    if keep.sum() < 20:
        raise CannotAnswer("no object was found on the table: nothing stands out of it once the views are fused.")
    return xyz[keep], normal[keep], 5 * rough


def _closed(scene: _Scene, xyz: Array, normal: Array, points: int) -> tuple[Array, Array, int, float, Underside]:
    """Return about `points` points, normals, how many of them were seen (first), their distance and the underside."""
    area = len(spread(xyz, normal, np.arange(len(xyz)), 3 * scene.pixel)) * (3 * scene.pixel) ** 2
    bottom = _underside(scene, xyz, normal, max(1.5 * scene.pixel, float(np.sqrt(area / _CELLS))))
    below, down = bottom.points()
    xyz, normal, seen = np.concatenate([xyz, below]), np.concatenate([normal, down]), len(xyz)
    rows, radius = spread_to(xyz, normal, np.arange(len(xyz)), points, scene.pixel)
    rows = np.sort(rows)
    return xyz[rows], normal[rows], int((rows < seen).sum()), radius, bottom


def _underside(scene: _Scene, xyz: Array, normal: Array, pitch: float) -> Underside:
    low = xyz[:, :2].min(0) - 2 * pitch
    size = np.ceil((xyz[:, :2].max(0) + 2 * pitch - low) / pitch).astype(int)
    cell = np.floor((xyz[:, :2] - low) / pitch).astype(int)
    top = np.full(size, -np.inf)
    np.maximum.at(top, (cell[:, 0], cell[:, 1]), xyz[:, 2])
    top = ndimage.maximum_filter(top, 3, mode="constant", cval=-np.inf)
    i, j = np.nonzero(np.isfinite(top))
    foot = np.column_stack([low + pitch * (np.stack([i, j], axis=1) + 0.5), np.zeros(len(i))])
    up = np.tile([0.0, 0.0, 1.0], (len(foot), 1))
    support = images.settled(*scene.images(), settled := foot.copy(), up, _WINDOW, scene.noise, 2)
    table = np.zeros(size, bool)
    table[i, j] = (support[:, 0] + support[:, 1] >= _LEAST_VIEWS) & (settled[:, 2] < 0.3 * scene.sigma)
    empty_to = np.full(size, np.inf)
    sight = _lowest_sight(scene)
    away = sight * pitch * ndimage.distance_transform_edt(table | ~np.isfinite(top))
    empty_to[i, j] = _empty_to(scene, foot, table[i, j], top[i, j], pitch, away[i, j])
    _raise_to_feet(scene, xyz, normal, low, pitch, empty_to, top)
    return underside(xyz, normal, low, pitch, empty_to, top, sight)


def _raise_to_feet(scene: _Scene, xyz: Array, normal: Array, low: Array, pitch: float, empty_to: Array, top: Array) -> None:
    """Raise the empty height of the outermost columns under the object to where the walls over them end."""
    under = np.isfinite(empty_to) & (empty_to < top)
    rim = under & ~ndimage.binary_erosion(under, np.ones((3, 3)))
    wall = np.abs(normal[:, 2]) < _WALL
    i, j = np.nonzero(rim)
    at = low + pitch * (np.stack([i, j], axis=1) + 0.5)
    if not len(i) or not wall.any():
        return
    away, nearest = cKDTree(xyz[wall, :2]).query(at, distance_upper_bound=2 * pitch)
    has = np.isfinite(away)
    i, j, nearest = i[has], j[has], nearest[has]
    level = normal[wall][nearest].copy()
    level[:, 2] = 0
    level /= np.linalg.norm(level, axis=1, keepdims=True)
    foot = images.feet(*scene.images(), xyz[wall][nearest].copy(), level, _FOOT, int(_HIGHEST_FOOT / _FOOT), scene.noise)
    empty_to[i, j] = np.maximum(empty_to[i, j], np.minimum(foot, top[i, j] - 1e-6))


def _lowest_sight(scene: _Scene) -> float:
    """Return the slope of the lowest sight lines to the object, a tenth of the views being lower."""
    return float(np.percentile(scene.p[:, 2] / np.linalg.norm(scene.p[:, :2], axis=1), 10))


def _empty_to(scene: _Scene, foot: Array, table_seen: Any, top: Array, step: float, near: Array) -> Array:
    """Return up to which height the column over each foot (N, 3) was seen to be empty [m], inf if up to its top."""
    out = np.where(table_seen, np.minimum(near, top), 0.0)
    # Sight lines that end on the table pass over it; nearer to it than the noise only their slope tells how high.
    height = 3 * scene.sigma
    open_ = np.flatnonzero(table_seen)
    out[table_seen & (top <= np.minimum(height, near))] = np.inf
    while len(open_):
        open_ = open_[top[open_] > height]
        at = foot[open_].copy()
        at[:, 2] = height
        past = images.seen_past(*scene.images(), at, 0.0, scene.noise, _LEAST_VIEWS) >= _LEAST_VIEWS
        open_ = open_[past]
        out[open_] = height + step / 2
        out[open_[top[open_] <= height + step]] = np.inf
        height += step
    return out


def _colours(scene: _Scene, xyz: Array, normal: Array, seen: int) -> Any:
    """Return colours (N, 3): of the first `seen` points from the views, of the rest from the nearest seen point."""
    if scene.views.rgb is None:
        return None
    depth, *rest = scene.images()
    rgb = images.colours(depth, scene.views.rgb, *rest, xyz[:seen], normal[:seen], _WINDOW, scene.noise)
    return np.concatenate([rgb, rgb[cKDTree(xyz[:seen]).query(xyz[seen:])[1]]]) if seen < len(xyz) else rgb


def _empty(scene: _Scene, bottom: Underside) -> Callable[[Array], Any]:
    back = scene.X_WT.inverse()

    def empty(points: Array) -> Any:
        at = back.apply(points)
        past = images.seen_past(*scene.images(), np.ascontiguousarray(at), 0.0, scene.noise, _LEAST_VIEWS)
        return (past >= min(_LEAST_VIEWS, len(scene.R))) | bottom.below(at)

    return empty


def _findings(scene: _Scene, others: int, disagree: float) -> tuple[Finding, ...]:
    return ()
