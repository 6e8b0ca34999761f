"""From posed RGB-D views to one coloured, oriented cloud of the object on the table."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.findings import Finding, counted
from steelyard.shape import depth_images as images
from steelyard.shape import sight_lines
from steelyard.shape.cloud import Cloud
from steelyard.shape.common_table import levelled
from steelyard.shape.image_borders import cut_off
from steelyard.shape.lens_error import lens_by_table
from steelyard.shape.patches import surface_of, surfels
from steelyard.shape.placement import Placement, placement
from steelyard.shape.region import followed, lost_share
from steelyard.shape.registration import Seen, agreed
from steelyard.shape.scene import LEAST_VIEWS, WINDOW, Scene, scene_of
from steelyard.shape.spacing import Neighbours
from steelyard.shape.stand import put_on_stand
from steelyard.shape.thinning import in_cubes, spread, spread_to
from steelyard.shape.underside import DOWNWARD, Underside, closed_below
from steelyard.shape.uneven import uneven
from steelyard.shape.view_mistakes import likely_mistake
from steelyard.shape.views import Intrinsics, TablePlane, Views
from steelyard.shape.working_cloud import in_small_pieces
from steelyard.spatial import Pose, Rotation

POINTS = 3000  # of the cloud, about
_CELLS = 8000  # of the grid under the object, about
_CLEAR = 3.0  # times the depth noise: what is measured higher than this above the table is not the table
_OFF_TABLE = 4.0  # times the depth noise: what is lower may not be told from the table
_TABLE_SAMPLES, _NEARLY_ALL = 20_000, 90  # pixels that tell the table's colour, and per cent of them that have it
_ALIKE = 12.0  # levels between colours that look the same, at least
_WRONG = 2.5  # times the depth noise: views that spread more are wrong in something else than their noise
_FAR = 0.02  # rms move of the cameras [m] that no arm's error explains
_TABLE_OFF = 0.003  # of the table in the views, rms [m], from which on poses or camera are said to be wrong
_STILL = 1e-9  # move of a camera that is none [m]
_LEAST_SEEN = 0.25  # of the points: scans with views from all sides see half
_LOST = 0.1  # of where the object stands: so much without surface is not a ragged rim


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
    placement  what moved cameras say of where the cloud lies as a whole, None where the poses were good enough
    findings   what you must know
    stages     CPU time of each step [s]
    empty      whether points (N, 3) of W are known to be outside the object
    guessed    share of a skin, middles (N, 3) and outward areas (N, 3) of its triangles in W, on which no view measured
               a surface; of what stands clear of the table and does not face it
    unsure_m3  standard deviation of the object's volume that the table leaves open [m^3]
    """

    cloud: Cloud
    spacing: float
    table: TablePlane
    seen: int
    views: int
    noise_std: float
    disagree: float
    moved_m: float | None
    placement: Placement | None
    findings: tuple[Finding, ...]
    stages: dict[str, float]
    empty: Callable[[Array], Any] = field(repr=False)
    guessed: Callable[[Array, Array], float] = field(repr=False)
    unsure_m3: float = 0.0

    @property
    def unseen(self) -> float:
        """Share of the cloud that no camera saw, which closes the rest."""
        return 1 - self.seen / len(self.cloud)


def fuse(views: Views, points: int = POINTS) -> Scan:
    """Return the object that lies on the table as one cloud of about `points` points.

    Raises CannotAnswer where no table or no object on it is found.
    """
    clock, mistake = _Clock(), cache(lambda: likely_mistake(views))
    scene = scene_of(views)
    try:
        level, off = _levelled(scene, mistake), 0.0
        if level.lens:
            read = scene_of(replace(scene.views, intrinsics=level.lens))
            again = levelled(read)
            # A lens with which the views have the table no more alike, or with which they see none, explains nothing.
            better = again is not None and again < level.off
            scene, level = (read, level) if better else (scene, replace(level, lens=None))
            off = again or 0.0
        off = off if level.lens else level.off
        said, unsure = put_on_stand(scene)
        clock.lap("table")
        found = _surface(scene, points, off, clock)
    except CannotAnswer as error:
        raise CannotAnswer(" ".join(filter(None, (str(error), mistake())))) from None
    xyz, normal, seen, spacing, bottom = _closed(scene, found.xyz, found.normal, points)
    clock.lap("underside")
    rgb, coloured = _colours(scene, xyz, normal, seen)
    clock.lap("colour")
    placed = None if found.shift is None else _placed(scene, xyz.mean(0))
    cloud = Cloud(xyz, rgb, None, normal, coloured).in_frame(scene.X_WT)
    rough, more = uneven(scene, bottom, found.disagree)
    findings = (
        *said,
        *rough,
        *_findings(scene, found, level, placed, mistake),
        *_few_seen(seen / len(xyz), len(scene.views)),
    )
    return Scan(
        cloud=cloud, spacing=spacing, table=scene.table, seen=seen, views=len(scene.views), noise_std=scene.sigma,
        disagree=found.disagree, moved_m=found.shift, placement=placed, findings=findings, stages=clock.laps,
        empty=_empty(scene, bottom), guessed=_guessed(scene), unsure_m3=float(np.hypot(unsure, more)),
    )  # fmt: skip


def _placed(scene: Scene, middle: Array) -> Placement:
    """Move the scene to where the reported poses have it, all together, and return how surely."""
    found = Pose(Rotation.nearest(scene.R), scene.p)
    placed = placement(scene.X_WT.inverse() @ scene.views.X_WC, found, middle)
    scene.X_WT = scene.X_WT @ placed.common.inverse()
    return placed


@dataclass(frozen=True, eq=False)
class _Surface:
    """What was seen of the object: points (N, 3) and normals, and how well the views agree on them.

    others    objects that stand beside it
    disagree  spread of the views, in depth noise
    shift     rms move of the cameras that made them agree [m], None where none was needed
    lost      share of where the object stands without surface
    """

    xyz: Array
    normal: Array
    others: int
    disagree: float
    shift: float | None
    lost: float


@dataclass(frozen=True)
class _Level:
    """How far off the views had the table before they were levelled, rms [m], 0 where they were not; the lens as it was
    given, and the one with which they have one table, None where the given one is as good."""

    off: float
    given: Intrinsics
    lens: Intrinsics | None


def _levelled(scene: Scene, mistake: Callable[[], str]) -> _Level:
    given, off = scene.views.intrinsics, levelled(scene) or 0.0
    if off > _TABLE_OFF and mistake():
        raise CannotAnswer(f"no table was found that the views share: they have it {1e3 * off:.2g} mm (rms) apart.")
    return _Level(off, given, lens_by_table(scene) if off else None)


def _surface(scene: Scene, points: int, off: float, clock: _Clock) -> _Surface:
    seen = Seen.by(scene)
    clock.lap("object")
    seen = agreed(scene, seen, off)
    moved = scene.p - (scene.X_WT.inverse() @ scene.views.X_WC).position
    shift = float(np.sqrt((moved**2).sum(1).mean())) if np.abs(moved).max() > _STILL else None
    clock.lap("registration")
    region = followed(scene, seen.region)
    patches = seen.patches if region is seen.region else surfels(scene, region)
    xyz, normal = surface_of(scene, patches, region, points)
    lost = lost_share(xyz, region)
    clock.lap("surface")
    return _Surface(xyz, normal, region.others, seen.spread, shift, lost)


class _Clock:
    def __init__(self) -> None:
        self.laps: dict[str, float] = {}
        self._last = time.thread_time()

    def lap(self, name: str) -> None:
        now = time.thread_time()
        self.laps[name] = now - self._last
        self._last = now


def _closed(scene: Scene, xyz: Array, normal: Array, points: int) -> tuple[Array, Array, int, float, Underside]:
    """Return about `points` points, normals, how many of them were seen (first), their distance and the underside."""
    area = len(spread(xyz, normal, np.arange(len(xyz)), 3 * scene.pixel)) * (3 * scene.pixel) ** 2
    bottom = closed_below(scene, xyz, normal, max(1.5 * scene.pixel, float(np.sqrt(area / _CELLS))))
    below, down = bottom.points()
    xyz, normal, seen = np.concatenate([xyz, below]), np.concatenate([normal, down]), len(xyz)
    rows, radius = spread_to(xyz, normal, np.arange(len(xyz)), points, scene.pixel)
    rows = np.sort(rows)
    # What closes the object from below and hangs by itself closes nothing.
    rows = rows[(rows < seen) | ~in_small_pieces(Neighbours.of(xyz[rows]))]
    return xyz[rows], normal[rows], int((rows < seen).sum()), radius, bottom


def _colours(scene: Scene, xyz: Array, normal: Array, seen: int) -> tuple[Any, Any]:
    """Return colours (N, 3), and which of them (N,) the views show: of the first `seen` points, those that do not mix
    with the table. The rest have the colour of the nearest of those.
    """
    if (images_rgb := scene.views.rgb) is None:
        return None, None
    shown, rgb = np.zeros(len(xyz), bool), np.zeros((len(xyz), 3), np.uint8)
    clear, enough = _CLEAR * scene.sigma, min(LEAST_VIEWS, len(scene.R))
    rgb[:seen], shown[:seen] = sight_lines.colours(
        images_rgb, *scene.images(), xyz[:seen], normal[:seen], WINDOW, scene.noise, clear, enough
    )
    # What lies as low as the table and looks like it may be its fringe.
    shown &= (xyz[:, 2] > 2 * clear) | ~_like_table(scene, images_rgb, clear, rgb)
    if not shown.any():
        return rgb, None
    if not shown.all():
        rgb[~shown] = rgb[shown][cKDTree(xyz[shown]).query(xyz[~shown])[1]]
    return rgb, shown


def _like_table(scene: Scene, images_rgb: Any, clear: float, rgb: Any) -> Any:
    """Return which colours (N, 3) are as near to the table's median as nearly all of the table is."""
    depth = scene.views.depth
    stride = max(1, int(np.sqrt(depth.size / _TABLE_SAMPLES)))
    shown = images.sampled(depth, *scene.images()[1:], stride)
    every = (slice(None), slice(stride // 2, None, stride), slice(stride // 2, None, stride))
    pixels = images_rgb[every][depth[every] > 0].astype(float)
    table = pixels[np.abs(shown[:, 2]) < clear]
    if not len(table):
        return np.zeros(len(rgb), bool)
    middle = np.median(table, axis=0)
    reach = float(np.percentile(np.linalg.norm(table - middle, axis=1), _NEARLY_ALL))
    return np.linalg.norm(rgb - middle, axis=1) < max(2 * reach, _ALIKE)


def _empty(scene: Scene, bottom: Underside) -> Callable[[Array], Any]:
    back = scene.X_WT.inverse()

    def empty(points: Array) -> Any:
        at = back.apply(points)
        found = np.asarray(bottom.below(at))
        rows = np.flatnonzero(~found)
        rows = rows[in_cubes(at[rows], 8 * scene.pixel)] if len(rows) else rows
        past = sight_lines.seen_past(*scene.images(), at[rows], 0.0, scene.noise, LEAST_VIEWS)
        found[rows] = past >= min(LEAST_VIEWS, len(scene.R))
        return found

    return empty


def _guessed(scene: Scene) -> Callable[[Array, Array], float]:
    back = scene.X_WT.inverse()

    def guessed(middles: Array, areas: Array) -> float:
        at, size = back.apply(middles), np.linalg.norm(areas, axis=1)
        clear = at[:, 2] > _OFF_TABLE * scene.sigma
        clear &= back.rotation.apply(areas)[:, 2] > DOWNWARD * size
        at, size = at[clear], size[clear]
        bare = sight_lines.sights(*scene.images(), at, scene.noise)[:, 1] < 1
        return float(size[bare].sum() / size.sum()) if len(at) else 0.0

    return guessed


def _findings(
    scene: Scene, surface: _Surface, level: _Level, placed: Placement | None, mistake: Callable[[], str]
) -> tuple[Finding, ...]:
    found, disagree, shift = [], surface.disagree, surface.shift
    if others := surface.others:
        found.append(
            Finding.of(
                "several-objects",
                f"{others + 1} separate objects stand on the table where the cameras look; the largest was kept.",
            )
        )
    far = shift is not None and (shift > _FAR or level.off > _TABLE_OFF)
    why = " " + said if (disagree > _WRONG or far) and (said := mistake()) else ""
    if disagree > _WRONG:
        found.append(
            Finding.of(
                "views-disagree",
                f"The views of one surface spread {disagree:.1f} times as far as the depth noise of "
                f"{1e3 * scene.sigma:.2g} mm, even where moving the cameras was tried; expected below {_WRONG:g}."
                f"{why}",
            )
        )
    if far or level.lens or (placed and placed.at_wrist):
        found.append(Finding.of("views-disagree", _said_of(level, shift, placed) + why))
    if cut := cut_off(scene, surface.xyz, surface.normal):
        found.append(cut)
    # What is cut off has no surface for that reason.
    elif (lost := surface.lost) > _LOST:
        found.append(
            Finding.of(
                "surface-open",
                f"Of where the object stands on the table {100 * lost:.0f} % has no surface in the cloud: it is too "
                f"low, or too narrow for pixels {1e3 * scene.pixel:.2g} mm wide. Bring the camera nearer, and check "
                "fx, fy, cx, cy in camera.json.",
            )
        )
    return tuple(found)


def _few_seen(share: float, views: int) -> tuple[Finding, ...]:
    """Return the finding on a surface that is mostly what closes it; `share` of the points were seen."""
    if share >= _LEAST_SEEN:
        return ()
    text = (
        f"Only {100 * share:.0f} % of the points were seen, in {counted(views, 'view')}; the rest closes what is left."
    )
    remedy = f"Take more views, from all sides and heights: {LEAST_VIEWS} must see each place of the surface."
    return (Finding("surface-open", text, remedy),)


def _said_of(level: _Level, shift: float | None, placed: Placement | None) -> str:
    """Return what was put right of views that did not agree, `shift` [m] of the cameras by registration."""
    said = []
    if level.off:
        said.append(f"The views have the table {1e3 * level.off:.2g} mm (rms) too high or too low at the object.")
    if lens := level.lens:
        said.append(f"They were read with {_named(lens)} instead of {_named(level.given)}: then they have one table.")
    if shift:
        said.append(f"The cameras had to be moved by {1e3 * shift:.2g} mm (rms) until the views agreed.")
    if placed and (wrist := placed.at_wrist):
        said.append(
            f"A camera that sits {1e3 * wrist[0]:.2g} mm and {np.degrees(wrist[1]):.2g} degrees from where its pose at "
            "the wrist says explains most of that: calibrate it anew."
        )
    return " ".join(said)


def _named(lens: Intrinsics) -> str:
    return f"fx {lens.fx:.0f}, fy {lens.fy:.0f}, cx {lens.cx:.0f}, cy {lens.cy:.0f}"
