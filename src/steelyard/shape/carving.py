"""A solid corrected by what the views saw: space seen to be empty is outside, space never seen is inside."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadValue, CannotAnswer
from steelyard.findings import Finding, percent
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
# Share of the skin clear of the table that may be a guess: corners and shadows leave 0.06 in sound scans, hollows that
# too few views look into 0.14 and more. The standard deviation of the volume is as large, and from there on twice that.
_GUESSED, _BEHIND = 0.12, 2.0


def carved(
    solid: Solid,
    empty: Callable[[Array], Any],
    unseen: float = 0.0,
    guessed: Callable[[Array, Array], float] | None = None,
    unsure_m3: float = 0.0,
) -> Solid:
    """Return the solid with its cells decided anew where the views decide.

    empty   whether points (N, 3) are known to be outside: `Scan.empty`
    unseen  share of the skin that nobody saw: `Scan.unseen`
    guessed how much of a skin, middles (N, 3) and areas (N, 3) of its triangles, is a guess: `Scan.guessed`; None: not
            asked
    unsure_m3  standard deviation of the volume that the table leaves open [m^3]: `Scan.unsure_m3`

    With the underside closed, all that no view saw to be empty is the object's; between, the solid's own verdict holds.
    A surface that looked open is closed by that, and what closes it is a guess: `surface-open` where that is much of
    the skin. CannotAnswer where the views leave nothing.
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
    guess = guessed(*_skin(mesh)) if guessed else 0.0
    if guess > _GUESSED:
        findings += (_open(guess),)
    std = float(np.linalg.norm([std, (_BEHIND if guess > _GUESSED else 1.0) * guess, unsure_m3 / mesh.volume]))
    return replace(
        solid, mesh=mesh, sure=sure[inside], volume_std=std, findings=findings, inside=np.flatnonzero(inside)
    )


def _skin(mesh: TetMesh) -> tuple[Array, Array]:
    """Return middles (F, 3) and outward areas (F, 3) [m^2] of the triangles of the surface."""
    corners = mesh.vertices[mesh.surface]
    return corners.mean(1), np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2


def _open(guess: float) -> Finding:
    text = (
        f"On {percent(guess)} of the skin no view measured a surface: a hollow, or a gap under an edge, that too few "
        "views look into may count as solid."
    )
    return Finding("surface-open", text, "Take more views that look into openings and under edges, three for each.")


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
