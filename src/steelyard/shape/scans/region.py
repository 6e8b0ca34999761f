"""Where on the table the object lies, in a map of the heights that all views measure."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy import ndimage

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.shape.points.medians import middle_half_std
from steelyard.shape.scans import depth_images as images
from steelyard.shape.scans.grid import Grid
from steelyard.shape.scans.scene import Scene

STRIDE = 3  # of the pixels that are averaged
_PIXELS = 1_000_000  # that show how high what stands on the table is, about
_ENDS, _CUT = 1.0, 0.5  # per cent of an object: its ends; share of the images from which on enough hold them
_FULL, _SPARED = 18, 0.85  # images of which none is to be spared, of few that share
_LOOKED_AT = 1000  # spots that are asked for that
REACHES = (0.6, 1.2, 2.4)  # of the camera's distance: how far from where the cameras look it is sought, and followed
_WATCHED = 0.25  # of the pixels that usual cells hold: with fewer it is not known how high a cell is
_BRIM = 3  # cells from the edge of the map: an object there goes on past it
_COARSE = 4  # cells between those for which it is asked which images hold them
_CAP = 0.02  # of the camera's distance: heights beyond it count alike where the object is sought
_NEAR = 3  # cells of the map of heights: a point so near shows the surface there
_BARE = 0.3  # of a gap: more bare table parts two objects
_RESTS = 0.3  # of the brim around an object: so much goes on around what rests on a table, whatever hangs over its edge
_BELOW, _SIGHT = 6.0, np.radians(40.0)  # times the depth noise, slope of sight lines: where it is seen under a table
_MARGIN = 0.008  # of table kept around the object [m]


class Region(NamedTuple):
    """Where on the table the object lies.

    grid     of the map of heights
    mask     (I, J) cells of the object, with a margin around it
    stands   (I, J) cells in which the object stands out of the table
    highest  over the table that anything is measured there, noise added [m]
    others   objects that stand beside it
    cut      whether many images cut off a part of it
    """

    grid: Grid
    mask: Any
    stands: Any
    highest: float
    others: int
    cut: bool

    @property
    def runs_off(self) -> bool:
        """Whether the object goes on where the map ends."""
        inner = (slice(_BRIM, -_BRIM),) * 2
        return bool(self.stands.sum() > self.stands[inner].sum())

    def holds(self, points: Array) -> Any:
        """Whether points (N, 3) lie over its cells."""
        cells, within = self.grid.cells_under(points)
        return within & self.mask[cells]


def object_on_table(scene: Scene) -> Region:
    """Return where the largest object near where the cameras look lies; CannotAnswer where nothing stands out there."""
    return _object_within(scene, REACHES[0] * scene.distance, STRIDE)


def followed(scene: Scene, region: Region) -> Region:
    """Return all of the object: where it runs off the map it is followed as far as views look.

    Only once they agree: the wrinkles of a table that they have apart have no end.
    """
    for reach in REACHES[1:]:
        if region.runs_off:
            # Ends that lie far off are seen by few pixels: all of them are needed.
            region = _object_within(scene, reach * scene.distance, 1)
    spots, count = region.grid.spots(region.stands), len(scene.R)
    held = np.percentile(scene.held(spots[:: max(1, len(spots) // _LOOKED_AT)])[:, 0], _ENDS)
    cut = bool(held < max(_CUT * count, min(_FULL, _SPARED * count)))
    return region._replace(cut=cut) if cut else region


def _object_within(scene: Scene, reach: float, stride: int) -> Region:
    """Return where the object lies, of a map that reaches so far from where the cameras look [m].

    It is the largest, each cell counted by the images that hold it: one that most images cut off is not looked at.
    """
    pitch = 2 * scene.pixel
    half, near = int(reach / pitch), int(REACHES[0] * scene.distance / pitch)
    grid = Grid.about_origin(half, pitch)
    cap = max(6 * scene.sigma, _CAP * scene.distance)
    sums = images.height_map(scene.images, stride, grid.low, pitch, -cap, cap, *grid.shape)
    middle = (slice(half - near, half + near),) * 2
    well, watched, held = _watched(scene, grid, sums[..., 0], middle)
    mean = sums[..., 1] / np.maximum(sums[..., 0], 1)
    # What lies lower beside a stand says nothing of how even it is.
    even = mean[well & (np.abs(mean) < 3 * scene.sigma)] if scene.raised else mean[well]
    spread = middle_half_std(even) if len(even) else 0.0
    level = float(np.median(even)) if len(even) else 0.0
    up = watched & (mean > level + min(max(5 * spread, 0.3 * scene.sigma), 0.5 * cap))
    label, found = ndimage.label(ndimage.binary_opening(up, np.ones((2, 2))), np.ones((3, 3)))
    area = np.bincount(label[well], minlength=found + 1)[1:]
    if not area.any():
        raise CannotAnswer(_nothing(scene, level > 0.5 * cap))
    largest = int(np.argmax(np.bincount(label[well], held[well], found + 1)[1:])) + 1
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
    return Region(grid, mine, label == largest, highest, others, False)


def _nothing(scene: Scene, covered: bool) -> str:
    """Return what to say where nothing stands out; `covered` where most of what is seen lies over the table."""
    if covered and scene.stated is not None:
        return (
            "no object was found: most of what lies where the cameras look is level, and above the plane in "
            "table.json. Give the plane that the object itself stands on, as that of a stand, or leave table.json out."
        )
    return (
        "no object was found on the table: nothing stands out of it where the cameras look. "
        "Lay it there; if it stands on a stand, give the plane of that in table.json."
    )


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


def heights(scene: Scene) -> tuple[Grid, Array]:
    """Return cells about where the cameras look, and the mean height (I, J) [m] measured in each.

    Cells in which too little was measured are 0.
    """
    pitch = 2 * scene.pixel
    grid, far = Grid.about_origin(int(REACHES[0] * scene.distance / pitch), pitch), scene.distance
    stride = max(STRIDE, images.stride_of(scene.views.depth, _PIXELS))
    sums = images.height_map(scene.images, stride, grid.low, pitch, -far, far, *grid.shape)
    enough = sums[..., 0] >= _WATCHED * np.median(sums[..., 0][sums[..., 0] > 0])
    return grid, np.where(enough, sums[..., 1] / np.maximum(sums[..., 0], 1), 0.0)


def _watched(scene: Scene, grid: Grid, count: Array, middle: tuple[slice, slice]) -> tuple[Any, Any, Array]:
    """Return which cells (I, J) of a grid hold pixels enough: in the middle as many as usual, all that are followed.

    And how many images hold each.

    count  (I, J) pixels in each

    A cell that few images hold, or only from afar, has enough if it has its share of the pixels that those images turn
    to it: what an image does not show is no sign that nothing is there.
    """
    typical = float(np.median(count[middle][count[middle] > 0]))
    usual, apart = count >= _WATCHED * typical, np.ones(count.shape, bool)
    well = np.zeros(count.shape, bool)
    well[middle] = usual[middle]
    held, density = _held(scene, grid)
    apart[middle] = held[middle] < _CUT * len(scene.R)
    apart &= held >= scene.enough
    due = density * grid.pitch**2
    share = float(np.median(count[well] / np.maximum(due[well], 1e-9)))
    return well, usual | (apart & (count > 0) & (count >= _WATCHED * share * due)), held


def _held(scene: Scene, grid: Grid) -> tuple[Array, Array]:
    """Return how many images hold the cells (I, J) of a grid, and how densely their pixels lie there [1/m^2]."""
    rows, columns = grid.shape
    coarse = Grid(grid.low, grid.pitch * _COARSE, (-(-rows // _COARSE), -(-columns // _COARSE)))
    held = scene.held(coarse.spots(np.ones(coarse.shape, bool))).reshape(*coarse.shape, 2)
    fine = held.repeat(_COARSE, 0).repeat(_COARSE, 1)[:rows, :columns]
    return fine[..., 0], fine[..., 1]


def bare_share(scene: Scene, table: Array, region: Region) -> float:
    """Return the share of the brim around where the object stands that points (N, 3) of the table cover.

    Beside what hangs over the table's edge there is none to cover it: views see past what lies lower there.
    """
    brim = region.mask & ~ndimage.binary_dilation(ndimage.binary_fill_holes(region.stands), np.ones((3, 3)))
    if not brim.any():
        return 1.0
    covered = np.zeros_like(brim)
    covered[region.grid.cells_under(table)[0]] = True
    covered = brim & ndimage.binary_dilation(covered, np.ones((3, 3)))
    beside = ndimage.distance_transform_edt(~region.stands, return_distances=False, return_indices=True)
    due = brim & (covered | ~_over_the_edge(scene, region)[tuple(beside)])
    return float(covered.sum() / max(due.sum(), _RESTS * brim.sum()))


def _over_the_edge(scene: Scene, region: Region) -> Any:
    """Return under which cells (I, J) of the object views see past what lies lower than the table."""
    deep = region.grid.pitch * ndimage.distance_transform_edt(region.stands)
    low = region.grid.spots(region.stands)
    low[:, 2] = -_BELOW * scene.sigma - np.tan(_SIGHT) * deep[region.stands]
    over = np.zeros_like(region.stands)
    over[region.stands] = scene.seen_empty(low)
    return over


def lost_share(xyz: Array, region: Region) -> float:
    """Return the share of where the object stands that is far from all of its surface points (N, 3)."""
    covered = np.zeros_like(region.stands)
    covered[region.grid.cells_under(xyz)[0]] = True
    covered = ndimage.binary_dilation(covered, np.ones((3, 3)), iterations=_NEAR)
    return float((region.stands & ~covered).sum() / region.stands.sum())
