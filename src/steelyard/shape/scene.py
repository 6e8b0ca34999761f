"""Views in the frame of the table: where the object lies, how noisy depth is, patches of surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy import ndimage

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.shape import depth_images as images
from steelyard.shape import sight_lines
from steelyard.shape.medians import middle_half_std
from steelyard.shape.table_plane import leveller, looked_at, table_frame, table_noise, table_of
from steelyard.shape.thinning import in_cubes, spread_to
from steelyard.shape.view_mistakes import advice
from steelyard.shape.views import TablePlane, Views
from steelyard.spatial import Pose

LEAST_VIEWS = 3  # that must agree before something is believed
WINDOW = 0.002  # how far from a settled point a measurement of it may lie, beside its noise [m]
_SAMPLES = 30_000  # points that find the table
_STRIDE = 3  # of the pixels that are averaged
_ENDS, _CUT = 1.0, 0.5  # per cent of an object: its ends; share of the images from which on enough hold them
_FULL, _SPARED = 18, 0.85  # images of which none is to be spared, of few that share
_LOOKED_AT = 1000  # spots that are asked for that
_NORMAL_STEP = 2  # pixels from one whose normal is taken to its neighbours
_REACHES = (0.6, 1.2, 2.4)  # of the camera's distance: how far from where the cameras look it is sought, and followed
_WATCHED = 0.25  # of the pixels that usual cells hold: with fewer it is not known how high a cell is
_BRIM = 3  # cells from the edge of the map: an object there goes on past it
_COARSE = 4  # cells between those for which it is asked which images hold them
_SEEDS = 4  # points that are settled, for each that stays
_CAP = 0.02  # of the camera's distance: heights beyond it count alike where the object is sought
_CELL = 2.0  # edge of the cubes that pixels are averaged over, in pixel widths at the object
_CUBE = 8  # pixel widths: points of one cube are looked up in the images one after the other
_NEAR = 3  # cells of the map of heights: a point so near shows the surface there
_BARE = 0.3  # of a gap: more bare table parts two objects
_NEARLY = 0.9  # of an object's height: the mean over the cell of its top, its sides included
_MARGIN = 0.008  # of table kept around the object [m]


@dataclass(eq=False)
class Scene:
    """The images with their poses in the frame of the table T: z up, the origin under where the cameras look.

    X_WT      the table in W
    R, p      rotations (V, 3, 3) and positions (V, 3) [m] of the cameras in T; they start where they were reported
    distance  typical one from a camera to where the cameras look [m]
    noise     standard deviation of depth at 1 m; it grows with the square of depth [1/m]
    stated    the table that was given, as the points have it, in W; None where it was to be found
    raised    whether a lower table shows beside this one, as beside a stand: what lies there is no object's
    floor     what is measured lower than this is not of the table [m]
    """

    views: Views
    X_WT: Pose
    R: Array
    p: Array
    distance: float
    noise: float
    stated: TablePlane | None = None
    raised: bool = False
    floor: float = -np.inf

    @property
    def table(self) -> TablePlane:
        """The plane that the object lies on, in W."""
        normal = self.X_WT.rotation.matrix[:, 2]
        return TablePlane(normal, float(normal @ self.X_WT.position))

    @property
    def pixel(self) -> float:
        """Width of a pixel at the object [m]."""
        return self.distance / self.views.intrinsics.fx

    @property
    def sigma(self) -> float:
        """Standard deviation of depth at the object [m]."""
        return self.noise * self.distance**2

    def images(self) -> tuple[Any, float, Array, Array, Array]:
        """Return what every pass over the images needs: depth, its unit, the camera and its poses."""
        return self.views.depth, self.views.depth_unit, self.views.intrinsics.vector, self.R, self.p

    def held(self, points: Array) -> Array:
        """Return how many images hold each of points (N, 3), and how densely their pixels lie there [1/m^2]: (N, 2)."""
        lens = self.views.intrinsics
        return np.asarray(images.held(lens.vector, self.R, self.p, lens.height, lens.width, points))

    def keep(self, rows: Any) -> None:
        """Leave out all views but those of `rows`."""
        if len(rows) < len(self.R):
            self.views, self.R, self.p = self.views.chosen(rows), self.R[rows], self.p[rows]


class Region(NamedTuple):
    """Where on the table the object lies.

    mask     (I, J) cells of the map of heights, with a margin around the object
    low      (2,) corner of the map [m]
    pitch    edge of a cell [m]
    stands   (I, J) cells in which the object stands out of the table
    highest  over the table that anything is measured there, noise added [m]
    others   objects that stand beside it
    cut      whether many images cut off a part of it
    """

    mask: Any
    low: Array
    pitch: float
    stands: Any
    highest: float
    others: int
    cut: bool

    def spots(self, cells: Any) -> Array:
        """Return the middles (N, 3) of cells (I, J) on the table."""
        xy = self.low + self.pitch * (np.argwhere(cells) + 0.5)
        return np.column_stack([xy, np.zeros(len(xy))])

    @property
    def runs_off(self) -> bool:
        """Whether the object goes on where the map ends."""
        inner = (slice(_BRIM, -_BRIM),) * 2
        return bool(self.stands.sum() > self.stands[inner].sum())

    def cells_under(self, points: Array) -> tuple[tuple[Any, Any], Any]:
        """Return the cells i, j (N,) under points (N, 3), the nearest beyond the map, and which points are over it."""
        i, j = np.floor((points[:, :2] - self.low) / self.pitch).astype(int).T
        rows, columns = self.mask.shape
        within = (i >= 0) & (j >= 0) & (i < rows) & (j < columns)
        return (i.clip(0, rows - 1), j.clip(0, columns - 1)), within

    def holds(self, points: Array) -> Any:
        """Whether points (N, 3) lie over its cells."""
        cells, within = self.cells_under(points)
        return within & self.mask[cells]


def scene_of(views: Views) -> Scene:
    """Return the images in the table's frame."""
    R, p = views.X_WC.rotation.matrix, views.X_WC.position
    stride = max(1, int(np.sqrt(views.depth.size / _SAMPLES)))
    sampled = images.sampled(views.depth, views.depth_unit, views.intrinsics.vector, R, p, stride)
    looks = looked_at(R, p)
    distance = float(np.median(np.linalg.norm(p - looks, axis=1)))
    try:
        table = table_of(sampled[:, :3], p, distance, views.table)
    except CannotAnswer as error:
        raise CannotAnswer(f"{error} {advice(views)}") from None
    stated, step = None if views.table is None else table, np.inf
    if stated is not None:
        table, step = leveller(sampled[:, :3], p, distance, stated)
    X_WT = table_frame(table, looks)
    noise = table_noise(sampled, X_WT.inverse().apply(sampled[:, :3]), distance, views.depth_unit, len(views))
    X_TC = X_WT.inverse() @ views.X_WC
    R, p = np.ascontiguousarray(X_TC.rotation.matrix), np.ascontiguousarray(X_TC.position)
    return Scene(views, X_WT, R.copy(), p.copy(), distance, noise, stated, floor=-step / 2)


def object_on_table(scene: Scene) -> Region:
    """Return where the largest object near where the cameras look lies; CannotAnswer where nothing stands out there."""
    return _object_within(scene, _REACHES[0] * scene.distance, _STRIDE)


def followed(scene: Scene, region: Region) -> Region:
    """Return all of the object: where it runs off the map it is followed as far as views look.

    Only once they agree: the wrinkles of a table that they have apart have no end.
    """
    for reach in _REACHES[1:]:
        if region.runs_off:
            # Ends that lie far off are seen by few pixels: all of them are needed.
            region = _object_within(scene, reach * scene.distance, 1)
    spots, count = region.spots(region.stands), len(scene.R)
    held = np.percentile(scene.held(spots[:: max(1, len(spots) // _LOOKED_AT)])[:, 0], _ENDS)
    cut = bool(held < max(_CUT * count, min(_FULL, _SPARED * count)))
    return region._replace(cut=cut) if cut else region


def _object_within(scene: Scene, reach: float, stride: int) -> Region:
    """Return where the largest object lies, of a map that reaches so far from where the cameras look [m]."""
    pitch = 2 * scene.pixel
    half, near = int(reach / pitch), int(_REACHES[0] * scene.distance / pitch)
    low = np.full(2, -half * pitch)
    size = 2 * half
    cap = max(6 * scene.sigma, _CAP * scene.distance)
    floor = 0.0 if scene.raised else -cap
    sums = images.height_map(*scene.images(), stride, low, pitch, floor, cap, size, size)
    middle = (slice(half - near, half + near),) * 2
    well, watched = _watched(scene, sums[..., 0], middle, low, pitch)
    mean = sums[..., 1] / np.maximum(sums[..., 0], 1)
    # Beside a stand what lies lower counts as no height at all, and says nothing of how even the stand is.
    even = mean[well & (mean > 0) & (mean < 3 * scene.sigma)] if scene.raised else mean[well]
    spread = middle_half_std(even) if len(even) else 0.0
    level = float(np.median(even)) if len(even) else 0.0
    up = watched & (mean > level + min(max(5 * spread, 0.3 * scene.sigma), 0.5 * cap))
    label, found = ndimage.label(ndimage.binary_opening(up, np.ones((2, 2))), np.ones((3, 3)))
    area = np.bincount(label[well], minlength=found + 1)[1:]
    if not area.any():
        raise CannotAnswer(
            "no object was found on the table: nothing stands out of it where the cameras look. "
            "Lay it there; if it stands on a stand, give the plane of that in table.json."
        )
    largest = int(np.argmax(area)) + 1
    label = _with_its_floor(label, largest, watched & ~up)
    area, whole = (np.bincount(cells, minlength=found + 1)[1:] for cells in (label[well], label.ravel()))
    others = int((area > max(0.1 * area.max(), 25)).sum()) - 1
    margin = max(3, int(np.ceil(_MARGIN / pitch)))
    mine = ndimage.binary_dilation(label == largest, np.ones((3, 3)), iterations=margin)
    stranger = ndimage.binary_dilation(
        (label > 0) & (label != largest) & np.isin(label, 1 + np.flatnonzero(whole > 25)), np.ones((3, 3))
    )
    mine &= ~stranger
    highest = float(sums[..., 2][mine].max()) + 2 * scene.sigma
    return Region(mine, low, pitch, label == largest, highest, others, False)


def _with_its_floor(label: Any, largest: int, table: Any) -> Any:
    """Return labels (I, J), pieces within the largest added to it where hardly any of the table shows between.

    Down in a mug, beside its wall, next to nothing is measured: its floor is no other object.
    """
    whole = ndimage.binary_closing(label == largest, np.ones((3, 3)), iterations=_NEAR)
    hole, count = ndimage.label(ndimage.binary_fill_holes(whole) & (label != largest))
    gap, bare = (np.bincount(hole[cells], minlength=count + 1) for cells in (label == 0, (label == 0) & table))
    own = bare <= _BARE * gap
    own[0] = False
    return np.where(own[hole] & (label > 0), largest, label)


def heights(scene: Scene) -> tuple[Array, Array, float]:
    """Return the mean height (I, J) [m] measured in the cells about where the cameras look, corner (2,) and pitch [m].

    Cells in which too little was measured are 0.
    """
    pitch = 2 * scene.pixel
    half = int(_REACHES[0] * scene.distance / pitch)
    low = np.full(2, -half * pitch)
    sums = images.height_map(*scene.images(), _STRIDE, low, pitch, -scene.distance, scene.distance, 2 * half, 2 * half)
    enough = sums[..., 0] >= _WATCHED * np.median(sums[..., 0][sums[..., 0] > 0])
    return np.where(enough, sums[..., 1] / np.maximum(sums[..., 0], 1), 0.0), low, pitch


def _watched(scene: Scene, count: Array, middle: tuple[slice, slice], low: Array, pitch: float) -> tuple[Any, Any]:
    """Return which cells (I, J) of a map hold enough pixels: in the middle as many as usual, and all that are followed.

    count  (I, J) pixels in each

    A cell that few images hold, or only from afar, has enough if it has its share of the pixels that those images turn
    to it: what an image does not show is no sign that nothing is there.
    """
    typical = float(np.median(count[middle][count[middle] > 0]))
    usual, apart = count >= _WATCHED * typical, np.ones(count.shape, bool)
    well = np.zeros(count.shape, bool)
    well[middle] = usual[middle]
    held, density = _held(scene, count.shape, low, pitch)
    apart[middle] = held[middle] < _CUT * len(scene.R)
    apart &= held >= min(LEAST_VIEWS, len(scene.R))
    due = density * pitch**2
    share = float(np.median(count[well] / np.maximum(due[well], 1e-9)))
    return well, usual | (apart & (count > 0) & (count >= _WATCHED * share * due))


def _held(scene: Scene, shape: tuple[int, ...], low: Array, pitch: float) -> tuple[Array, Array]:
    """Return how many images hold the cells (I, J) of a map, and how densely their pixels lie there [1/m^2]."""
    i, j = (np.arange(-(-n // _COARSE)) + 0.5 for n in shape)
    xy = low + pitch * _COARSE * np.stack(np.meshgrid(i, j, indexing="ij"), axis=-1).reshape(-1, 2)
    coarse = scene.held(np.column_stack([xy, np.zeros(len(xy))])).reshape(len(i), len(j), 2)
    fine = coarse.repeat(_COARSE, 0).repeat(_COARSE, 1)[: shape[0], : shape[1]]
    return fine[..., 0], fine[..., 1]


def lost_share(xyz: Array, region: Region) -> float:
    """Return the share of where the object stands that is far from all of its surface points (N, 3)."""
    covered = np.zeros_like(region.stands)
    covered[region.cells_under(xyz)[0]] = True
    covered = ndimage.binary_dilation(covered, np.ones((3, 3)), iterations=_NEAR)
    return float((region.stands & ~covered).sum() / region.stands.sum())


def surfels(scene: Scene, region: Region) -> Array:
    """Return patches (N, 8) of the object and of the table around it."""
    cell = _CELL * scene.pixel
    floor = -4 * scene.sigma - 2 * cell
    layers = int((_top(scene, region) - floor) / cell) + 2
    # Where few images hold an end of it, all of their pixels are needed.
    stride = 1 if region.cut else _STRIDE
    found = images.surfels(*scene.images(), stride, _NORMAL_STEP, *region[:3], cell, floor, layers, scene.noise)
    found = np.asarray(found[found[:, 7] >= min(LEAST_VIEWS, len(scene.R))])
    if not len(found):
        raise no_surface()
    return found


def _top(scene: Scene, region: Region) -> float:
    """Return how high patches are looked for [m]: as usual things reach, or most of the pixels of a cell.

    Pixels that fly past edges are measured anywhere up to the cameras.
    """
    usual = _REACHES[0] * scene.distance
    if region.highest <= usual:
        return region.highest
    high, low, pitch = heights(scene)
    xy = low + pitch * (np.argwhere(high > usual * _NEARLY) + 0.5)
    over = region.holds(np.column_stack([xy, np.zeros(len(xy))]))
    tallest = high[high > usual * _NEARLY][over].max(initial=0.0)
    return min(region.highest, max(usual, float(tallest) / _NEARLY))


def no_surface() -> CannotAnswer:
    """Return the error of views that agree on nothing."""
    return CannotAnswer("no object was found on the table: the views agree on no surface there.")


def settled(scene: Scene, xyz: Array, normal: Array, window: float, rounds: int) -> Array:
    """Move points (N, 3) along their normals to what the views measure; return support (N, 3) as there."""
    order = in_cubes(xyz, _CUBE * scene.pixel)
    moved, support = xyz[order], np.empty((len(xyz), 3))
    support[order] = sight_lines.settled(*scene.images(), moved, normal[order], window, scene.noise, rounds)
    xyz[order] = moved
    return support


def surface_of(scene: Scene, patches: Array, region: Region, points: int) -> tuple[Array, Array]:
    """Return points (N, 3) of the object's surface and normals, settled among the views, the table around it level 0.

    CannotAnswer where nothing stands out of that.
    """
    mask = region.mask
    order = np.argsort(-patches[:, 6], kind="stable")
    rows, _ = spread_to(patches[:, :3], patches[:, 3:6], order, _SEEDS * points, scene.pixel)
    xyz, normal = patches[rows, :3].copy(), patches[rows, 3:6].copy()
    support = settled(scene, xyz, normal, WINDOW, 2)
    least = min(LEAST_VIEWS, len(scene.R))
    good = (support[:, 0] >= least) & (support[:, 1] <= 0.5 * support[:, 0])
    table = good & (normal[:, 2] > 0.9) & (np.abs(xyz[:, 2]) < 4 * scene.sigma)
    level, rough = 0.0, 0.1 * scene.sigma
    object_cells = ndimage.binary_erosion(mask, np.ones((3, 3)), iterations=3)
    around = table & ~object_cells[region.cells_under(xyz)[0]]
    if around.sum() >= 20:
        level = float(np.median(xyz[around, 2]))
        rough = middle_half_std(xyz[around, 2])
    xyz[:, 2] -= level
    scene.p[:, 2] -= level
    keep = good & (xyz[:, 2] > 5 * rough)
    if keep.sum() < 20:
        raise CannotAnswer("no object was found on the table: nothing stands out of it once the views are fused.")
    return xyz[keep], normal[keep]
