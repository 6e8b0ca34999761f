"""From posed RGB-D views to one coloured, oriented cloud of the object on the table."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.findings import Finding
from steelyard.shape.cloud import Cloud
from steelyard.shape.known_space import SeenSpace
from steelyard.shape.points.spacing import Neighbours
from steelyard.shape.points.thinning import in_cubes, spread, spread_to
from steelyard.shape.scans.common_table import levelled
from steelyard.shape.scans.hanging import hanging
from steelyard.shape.scans.lens_error import lens_by_table
from steelyard.shape.scans.patches import surface_of, surfels
from steelyard.shape.scans.placement import Placement, moved_m, placement
from steelyard.shape.scans.region import Region, bare_share, followed, lost_share
from steelyard.shape.scans.registration import Seen, agreed, left_open
from steelyard.shape.scans.round_below import round_below
from steelyard.shape.scans.scan_colours import colours_of
from steelyard.shape.scans.scan_findings import TABLE_OFF, Level, Surface, few_seen, findings_of
from steelyard.shape.scans.scene import LEAST_VIEWS, Scene, scene_of
from steelyard.shape.scans.stand import put_on_stand
from steelyard.shape.scans.strangers import left_out, strangers
from steelyard.shape.scans.underside import DOWNWARD, Underside, closed_below
from steelyard.shape.scans.uneven import uneven
from steelyard.shape.scans.view_mistakes import likely_mistake
from steelyard.shape.views import TablePlane, Views
from steelyard.shape.working_cloud import in_small_pieces
from steelyard.spatial import Pose, Rotation

POINTS = 3000  # of the cloud, about
_CELLS = 8000  # of the grid under the object, about
_OFF_TABLE = 4.0  # times the depth noise: what is lower may not be told from the table
_LEVEL = 0.9  # cosine of the normals of a table with the vertical
_TABLE = 0.45  # of the brim around an object: less is covered by one of its own faces
_STILL = 1e-9  # move of a camera that is none [m]


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
    moved_m    rms shift of the cameras along what the surface shows, None where the poses were good enough
    placement  what moved cameras say of where the cloud lies as a whole, None where the poses were good enough
    findings   what you must know
    stages     CPU time of each step [s]
    space      what the views know of the space around the object, in W
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
    space: SeenSpace = field(repr=False)

    @property
    def place_std(self) -> tuple[float, float]:
        """Standard deviations of where the cloud lies as a whole, per axis [m], [rad]; 0 where the poses were right."""
        return (self.placement.std_m, self.placement.std_rad) if self.placement else (0.0, 0.0)


def fuse(views: Views, points: int = POINTS) -> Scan:
    """Return the object that lies on the table as one cloud of about `points` points.

    Raises CannotAnswer where no table or no object on it is found.
    """
    views = views if views.names else replace(views, names=tuple(map(str, range(len(views)))))
    clock, mistake = _Clock(), cache(lambda: likely_mistake(views))
    scene = scene_of(views)
    try:
        scene, level, off = _read_right(scene, _levelled(scene, mistake))
        said, unsure = put_on_stand(scene)
        clock.lap("table")
        first = Seen.by(scene)
        if (wrong := strangers(scene, first)).any():
            return _without(views, scene.views.chosen(wrong).names, points)
        clock.lap("object")
        found = _surface(scene, first, points, off, clock)
    except CannotAnswer as error:
        raise CannotAnswer(" ".join(filter(None, (str(error), mistake())))) from None
    xyz, normal, seen, spacing, bottom = _closed(scene, found.xyz, found.normal, points)
    clock.lap("underside")
    rgb, coloured = colours_of(scene, xyz, normal, seen)
    clock.lap("colour")
    placed = None if found.shift is None else _placed(scene, xyz.mean(0))
    cloud = Cloud(xyz, rgb, None, normal, coloured).in_frame(scene.X_WT)
    rough, more = uneven(scene, bottom, found.disagree)
    hangs, closed = hanging(scene, bottom, found.xyz, found.normal)
    unsure_m3 = float(np.linalg.norm([unsure, more, closed, found.unsure_m3]))
    findings = (
        *said,
        *rough,
        *hangs,
        *findings_of(scene, found, level, placed, mistake),
        *few_seen(seen / len(xyz), len(scene.views), scene.enough),
    )
    clock.lap("findings")
    return Scan(
        cloud=cloud, spacing=spacing, table=scene.table, seen=seen, views=len(scene.views), noise_std=scene.sigma,
        disagree=found.disagree, moved_m=found.shift, placement=placed, findings=findings, stages=clock.laps,
        space=SeenSpace(_empty(scene, bottom), _guessed(scene), 1 - seen / len(cloud), unsure_m3),
    )  # fmt: skip


def _without(views: Views, wrong: tuple[str, ...], points: int) -> Scan:
    """Return the scan of `views` without those of the names `wrong`, as if they had never been taken."""
    scan = fuse(views.chosen(~np.isin(views.names, wrong)), points)
    return replace(scan, findings=(left_out(wrong), *scan.findings))


def _placed(scene: Scene, middle: Array) -> Placement:
    """Move the scene to where the reported poses have it, all together, and return how surely."""
    found = Pose(Rotation.nearest(scene.R), scene.p)
    placed = placement(scene.given, found, middle)
    scene.X_WT = scene.X_WT @ placed.common.inverse()
    return placed


def _levelled(scene: Scene, mistake: Callable[[], str]) -> Level:
    given, off = scene.views.intrinsics, levelled(scene) or 0.0
    if off > TABLE_OFF and mistake():
        raise CannotAnswer(f"no table was found that the views share: they have it {1e3 * off:.2g} mm (rms) apart.")
    return Level(off, given, lens_by_table(scene) if off else None)


def _read_right(scene: Scene, level: Level) -> tuple[Scene, Level, float]:
    """Return the scene as the lens that explains its tables reads it, and how far off they are then, rms [m].

    A lens with which the views have the table no more alike, or with which they see none, explains nothing.
    """
    if level.lens:
        read = scene_of(replace(scene.views, intrinsics=level.lens))
        again = levelled(read)
        if again is not None and again < level.off:
            return read, level, again
    return scene, replace(level, lens=None), level.off


def _surface(scene: Scene, first: Seen, points: int, off: float, clock: _Clock) -> Surface:
    seen = agreed(scene, first, off)
    given, poses = scene.given, Pose(Rotation.nearest(scene.R), scene.p)
    clock.lap("registration")
    region = followed(scene, seen.region)
    patches = seen.patches if region is seen.region else surfels(scene, region)
    _require_table(scene, patches, region)
    xyz, normal = surface_of(scene, patches, region, points)
    still = np.abs(poses.position - given.position).max() <= _STILL
    shift = None if still else moved_m(given, poses, xyz, normal)
    lost = lost_share(xyz, region)
    by_poses = left_open(scene, seen, xyz, normal)
    clock.lap("surface")
    return Surface(xyz, normal, region.others, seen.spread, shift, lost, by_poses)


def _require_table(scene: Scene, patches: Array, region: Region) -> None:
    """Raise CannotAnswer where the plane that was found goes on beside too little of the object to be its table.

    Of few views the object may hide the table behind it.
    """
    level = (patches[:, 5] > _LEVEL) & (np.abs(patches[:, 2]) < _OFF_TABLE * scene.sigma)
    asked = scene.stated is None and scene.enough == LEAST_VIEWS
    if asked and bare_share(scene, patches[level, :3], region) < _TABLE:
        raise CannotAnswer(
            "no table was found: the plane that most measured points lie on does not go on around the object. It may "
            "be a face of it, or a floor, or end where the object hangs over its edge. Lay all of the object on the "
            "table, move the camera so that more of the table is seen, or give table.json."
        )


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
    pitch = max(1.5 * scene.pixel, float(np.sqrt(area / _CELLS)))
    bottom = round_below(closed_below(scene, xyz, normal, pitch), xyz, scene.sigma)
    below, down = bottom.points()
    xyz, normal, seen = np.concatenate([xyz, below]), np.concatenate([normal, down]), len(xyz)
    rows, radius = spread_to(xyz, normal, np.arange(len(xyz)), points, scene.pixel)
    rows = np.sort(rows)
    # What closes the object from below and hangs by itself closes nothing.
    rows = rows[(rows < seen) | ~in_small_pieces(Neighbours.of(xyz[rows]))]
    return xyz[rows], normal[rows], int((rows < seen).sum()), radius, bottom


def _empty(scene: Scene, bottom: Underside) -> Callable[[Array], Array]:
    back = scene.X_WT.inverse()

    def empty(points: Array) -> Array:
        at = back.apply(points)
        found = np.asarray(bottom.below(at), float)
        rows = np.flatnonzero(found == 0)
        rows = rows[in_cubes(at[rows], 8 * scene.pixel)] if len(rows) else rows
        found[rows] = scene.emptiness(at[rows])
        return found

    return empty


def _guessed(scene: Scene) -> Callable[[Array, Array], float]:
    back = scene.X_WT.inverse()

    def guessed(middles: Array, areas: Array) -> float:
        at, size = back.apply(middles), np.linalg.norm(areas, axis=1)
        clear = at[:, 2] > _OFF_TABLE * scene.sigma
        clear &= back.rotation.apply(areas)[:, 2] > DOWNWARD * size
        at, size = at[clear], size[clear]
        bare = scene.sights(at)[:, 1] < 1
        return float(size[bare].sum() / size.sum()) if len(at) else 0.0

    return guessed
