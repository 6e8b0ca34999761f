"""A stand under the object: a second plane to lie on, above the table.

A box, a book or a turntable shows as a wide level face with sheer sides and something much smaller well inside it. So
does a lid with a knob or a flat iron: no shape tells them apart. So the stand is only taken for the table where the
cameras plainly look past it, or where its plane was given; else it stays a part of the object, and is named.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import ndimage

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.findings import Finding
from steelyard.shape.scans.common_table import laid
from steelyard.shape.scans.grid import Grid
from steelyard.shape.scans.region import heights, object_on_table
from steelyard.shape.scans.scene import Scene
from steelyard.shape.scans.table_plane import NEAR, find_table
from steelyard.shape.views import TablePlane

_CLEAR = (0.004, 6.0)  # how far over the table a plane is another one: at least so high [m], times the depth noise
_LEAST = 0.015  # height of a stand [m]: base plates and feet are thinner
_WIDE = 0.120  # width of a stand [m]: feet are narrower
_TALLEST = 1.0  # of its width: what is taller is a body with something on its top
_BARE, _OF_ONE_COLOUR = 2.0, 6.0  # bare face over what stands on it: where colours differ, and where they do not
# Of the stand's height that what stands on it rises, or of its width that it is long: less are caps and buttons, but on
# a stand that is flatter than that share of its width.
_STANDS_UP, _LONG, _FLAT = 0.3, 0.75, 0.35
_SHEER, _INSIDE = 0.05, 0.35  # share of a stand that may slope, and of its brim that may be taken
_BRIM = 3  # cells that a brim is wide
_BIN = 0.002  # step in which the height of a face is sought [m]
_LEAST_CELLS = 16  # of what stands on it
_PIXELS = 200_000  # that tell colours
_OTHER, _MOST = 60.0, 0.8  # levels between colours that differ, and the share of the pixels that must
# Share of the images that hold the brim of a stand that is looked past, at most, and the object on it, at least.
_CUT, _WHOLE = 0.6, 0.85
_LOWER = 0.05  # share of the pixels: so many below a plane are those of a lower table
_UNSURE = 0.6  # of the volume of what may be a stand: standard deviation


@dataclass(frozen=True, eq=False)
class _Stand:
    """What may be a stand, in the frame of the table.

    height  of its face over the table [m]
    size    longer and shorter side of it [m]
    share   of it that is taken by what stands on it
    volume  [m^3]
    passed  whether the images cut off the stand and not what stands on it
    """

    height: float
    size: tuple[float, float]
    share: float
    volume: float
    passed: bool


def put_on_stand(scene: Scene) -> tuple[tuple[Finding, ...], float]:
    """Lay a levelled scene on the stand that the object stands on, if there is one that is given or plain.

    Returns what is said of it, and the standard deviation of the object's volume that a stand left with it adds [m^3].
    """
    if scene.stated is None and (stand := _stand_under(scene)):
        if not (stand.passed or not _stands_out(scene)):
            return (_may_stand(scene, stand),), _UNSURE * stand.volume
        below = scene.table
        _raise(scene, _top(scene, stand))
        return (_taken_for_table(stand, below),), 0.0
    if scene.stated is not None and _above(scene, scene.stated):
        _raise(scene, scene.stated)
    else:
        scene.raised = _has_lower(scene)
    return (), 0.0


def _stands_out(scene: Scene) -> bool:
    """Whether anything is found on the table as it is."""
    try:
        object_on_table(scene)
    except CannotAnswer:
        return False
    return True


def _raise(scene: Scene, plane: TablePlane) -> None:
    """Lay the scene on a plane of W above the table, as its points have it: what lies below it is then no object's."""
    back = scene.X_WT.inverse()
    normal = back.rotation.apply(plane.normal)
    stated = TablePlane(normal, float(plane.offset - plane.normal @ scene.X_WT.position))
    points = scene.sampled(_PIXELS)[:, :3]
    near = points[np.abs(stated.height(points)) < NEAR * scene.distance]
    fitted = find_table(near, scene.p, scene.distance, stated) if len(near) > 2 else stated
    laid(scene, np.array([fitted.offset, *-fitted.normal[:2]]) / fitted.normal[2])
    scene.raised = True


def _above(scene: Scene, plane: TablePlane) -> bool:
    return float(plane.height(scene.X_WT.position)) < -max(_CLEAR[0], _CLEAR[1] * scene.sigma)


def _has_lower(scene: Scene) -> bool:
    """Whether a lower table shows beside this one."""
    below = scene.sampled(_PIXELS)[:, 2]
    return bool((below < -max(2 * _CLEAR[0], _CLEAR[1] * scene.sigma)).mean() > _LOWER)


def _stand_under(scene: Scene) -> _Stand | None:
    """Return what seems a stand under the object in the middle of the views, None where nothing does."""
    grid, high = heights(scene)
    pitch = grid.pitch
    clear, thick = max(_CLEAR[0], _CLEAR[1] * scene.sigma), max(_BIN, 3 * scene.sigma)
    whole = _largest(high > clear)
    if not whole.any():
        return None
    face = _face(high[whole])
    # Behind what stands on it, and within, little is measured.
    whole = ndimage.binary_fill_holes(whole)
    on, bare = whole & (high > face + thick), whole & (np.abs(high - face) <= thick)
    wide = 2 * pitch * float(ndimage.distance_transform_edt(np.pad(whole, 1)).max())
    if not max(_LEAST, 2 * clear) <= face <= _TALLEST * wide or wide < _WIDE or on.sum() < _LEAST_CELLS:
        return None
    brim = whole & ~ndimage.binary_erosion(whole, np.ones((3, 3)), iterations=_BRIM)
    sloping = whole & ~brim & (high > 0) & ~on & ~bare
    long = pitch * float(np.linalg.norm(np.ptp(np.argwhere(on), axis=0)))
    is_cap = float(high[on].max()) < (1 + _STANDS_UP) * face and long < _LONG * wide and face > _FLAT * wide
    if sloping.sum() > _SHEER * whole.sum() or on[brim].mean() > _INSIDE or is_cap:
        return None
    held, shown = (_held(scene, grid.spots(cells, high[cells])) for cells in (brim, on))
    passed, ratio = held < _CUT and shown > _WHOLE, bare.sum() / on.sum()
    if ratio < _BARE or not (passed or ratio >= _OF_ONE_COLOUR or _differ(scene, grid, whole & ~brim, face, thick)):
        return None
    area = float(whole.sum()) * pitch**2
    return _Stand(face, (area / wide, wide), float(on.sum() / whole.sum()), area * face, passed)


def _largest(up: Any) -> Any:
    """Return which cells (I, J) of a mask are of its largest piece, without what dangles from it by single cells."""
    label, found = ndimage.label(up)
    if not found:
        return up
    return ndimage.binary_opening(label == 1 + np.argmax(np.bincount(label.ravel())[1:]), np.ones((3, 3)))


def _held(scene: Scene, spots: Array) -> float:
    """Return the share of the images that hold spots (N, 3), in the middle of them."""
    return float(np.median(scene.held(spots)[:, 0])) / len(scene.R)


def _face(high: Array) -> float:
    """Return the height that most of some cells have."""
    bins = np.floor(high / _BIN).astype(int)
    return float(np.median(high[np.abs(bins - np.argmax(np.bincount(bins))) <= 1]))


def _differ(scene: Scene, grid: Grid, inner: Any, face: float, thick: float) -> bool:
    """Whether what stands on a face, over cells (I, J), has other colours than it."""
    if scene.views.rgb is None:
        return False
    xyz, colour = scene.sampled(_PIXELS)[:, :3], scene.sampled_rgb(_PIXELS)
    cells, over = grid.cells_under(xyz)
    over &= inner[cells]
    bare, on = (colour[over & there] for there in (np.abs(xyz[:, 2] - face) < thick, xyz[:, 2] > face + 2 * thick))
    if not len(bare) or not len(on):
        return False
    return float((np.linalg.norm(on - np.median(bare, axis=0), axis=1) > _OTHER).mean()) > _MOST


def _may_stand(scene: Scene, stand: _Stand) -> Finding:
    """Return what is said of a stand that was left a part of the object."""
    text = (
        f"{_said(stand)}: it may be a stand, and is taken for a part of the object, which the standard deviation of "
        "the volume holds."
    )
    return Finding(
        "table-in-cloud", text, f"If it is a stand, give its plane in table.json: {_json(_top(scene, stand))}"
    )


def _taken_for_table(stand: _Stand, below: TablePlane) -> Finding:
    """Return what is said of a stand that was taken for the table, which was at `below` in W."""
    text = f"{_said(stand)}, which the images cut off: it was taken for the table, not for a part of the object."
    return Finding("table-in-cloud", text, f"If it belongs to the object, give the table in table.json: {_json(below)}")


def _said(stand: _Stand) -> str:
    long, wide = (1e3 * side for side in stand.size)
    return (
        f"A level face {long:.0f} x {wide:.0f} mm, {1e3 * stand.height:.0f} mm over the table, bears something that "
        f"covers {100 * stand.share:.0f} % of it"
    )


def _top(scene: Scene, stand: _Stand) -> TablePlane:
    """Return the plane of the stand's face in W."""
    return TablePlane(scene.table.normal, scene.table.offset + stand.height)


def _json(plane: TablePlane) -> str:
    normal = ", ".join(f"{value:.5f}" for value in plane.normal)
    return f'{{"normal": [{normal}], "offset_m": {plane.offset:.4f}}}'
