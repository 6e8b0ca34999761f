"""A solid corrected by what the views saw: space seen to be empty is outside, space never seen is inside."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadValue, CannotAnswer
from steelyard.shape.islands import without_islands
from steelyard.shape.tets import TetMesh
from steelyard.shape.volume import Solid

# Places in a cell that are asked: its centroid, and halfway from there to each corner.
_PLACES = np.array([[0.25] * 4, *(0.15 + 0.4 * np.eye(4))])
_EMPTY, _FULL = 0.5, 0.1  # share of the places seen empty, above which a cell is outside, below which it is inside
# Cells that cloud and views judge differently count half. Volumes of scans are no better than this share even where
# they agree: the rms error over scans of tools without hidden hollows, whose undersides nobody saw.
_HALF, _LEAST_STD = 0.5, 0.05
# Of what lies on a table views all around leave half of the skin unseen. What closes more of it may stand off: so much
# further standard deviation for all of the skin.
_ON_TABLE, _UNSEEN = 0.5, 0.3


def carved(solid: Solid, empty: Callable[[Array], Any], unseen: float = 0.0) -> Solid:
    """Return the solid with its cells decided anew where the views decide.

    empty   whether points (N, 3) are known to be outside: `Scan.empty`
    unseen  share of the skin that nobody saw: `Scan.unseen`

    With the underside closed, all that no view saw to be empty is the object's; between, the solid's own verdict holds.
    A surface that looked open is closed by that. CannotAnswer where the views leave nothing.
    """
    around, known = _cells(solid)
    corners = around.vertices[around.tets]
    asked = np.einsum("pk,tkd->ptd", _PLACES, corners)
    share = np.asarray(empty(asked.reshape(-1, 3)), float).reshape(len(_PLACES), -1).mean(0)
    inside = without_islands(around, ((known >= 0) & (share < _EMPTY)) | (share < _FULL))
    if not inside.any():
        raise CannotAnswer(
            "the object has no volume left: cameras see past all of what its points enclose. The views do not agree: "
            "check their poses and camera.json, calibrate hand to eye anew, or take more views from all sides."
        )
    # A cell that only the views put inside is as sure as they are.
    sure = np.where(known >= 0, known, 1 - share / _EMPTY)
    findings = tuple(f for f in solid.findings if f.code != "surface-open")
    mesh = around.chosen(inside)
    disputed = float(around.volumes[(share < _EMPTY) != (known >= 0)].sum()) / mesh.volume
    std = max(least_std(unseen), min(solid.volume_std, _HALF * disputed))
    return replace(
        solid, mesh=mesh, sure=sure[inside], volume_std=std, findings=findings, inside=np.flatnonzero(inside)
    )


def least_std(unseen: float) -> float:
    """Return the least standard deviation of the volume of a scan, as a share of it.

    unseen  share of the skin that nobody saw
    """
    return _LEAST_STD + _UNSEEN * max(0.0, unseen - _ON_TABLE)


def _cells(solid: Solid) -> tuple[TetMesh, Array]:
    """Return the cells among which the solid lies, and how sure it is of each (T,), -1 of a cell it left outside."""
    if solid.around is None or solid.inside is None:
        raise BadValue("only a solid fresh from a cloud can be carved; this one's cells are no longer of one complex.")
    known = np.full(len(solid.around), -1.0)
    known[solid.inside] = solid.sure
    return solid.around, known
