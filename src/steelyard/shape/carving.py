"""A solid corrected by what the views saw: space seen to be empty is outside, space never seen is inside."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadValue, CannotAnswer
from steelyard.findings import Finding, percent
from steelyard.shape.cells.islands import without_islands
from steelyard.shape.known_space import KeptSpace, SeenSpace, Space
from steelyard.shape.solid import Solid
from steelyard.shape.tets import TetMesh

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


def carved(solid: Solid, space: Space) -> Solid:
    """Return the solid with its cells decided anew where the views decide.

    With the underside closed, all that no view saw to be empty is the object's; between, and before a surface by less
    than its noise, the solid's own verdict holds: such cells filled every dip of noisy points up to the outermost.
    A surface that looked open is closed by that, and what closes it is a guess: `surface-open` where that is much of
    the skin. CannotAnswer where the views leave nothing.
    """
    around, known = _cells(solid)
    share = space.emptied(around)
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
    std = max(least_std(space.unseen), min(solid.volume_std, _HALF * disputed))
    made = replace(
        solid, mesh=mesh, sure=sure[inside], volume_std=std, findings=findings, inside=np.flatnonzero(inside)
    )
    return _unsure(made, space)


def kept(solid: Solid, space: SeenSpace) -> KeptSpace:
    """Return what a file is to keep, beside the cloud of a solid, of the space that its views saw."""
    found = space.kept(_cells(solid)[0])
    return replace(found, skin=space.guessed(carved(solid, found).mesh))


def uncarved(solid: Solid, space: Space) -> Solid:
    """Return the solid, its cells as they are, no surer than its views were: points were changed since they were seen.

    Whatever the cells, what nobody saw, what is a guess and what the table left open stays so.
    """
    return _unsure(replace(solid, volume_std=max(solid.volume_std, least_std(space.unseen))), space)


def _unsure(solid: Solid, space: Space) -> Solid:
    """Return the solid with what the views leave open in its bar: guessed skin, and the table."""
    guess, findings = space.guessed(solid.mesh), solid.findings
    if guess > _GUESSED:
        findings, behind = (*findings, _open(guess)), _BEHIND
    else:
        behind = 1.0
    std = float(np.linalg.norm([solid.volume_std, behind * guess, space.unsure_m3 / solid.mesh.volume]))
    return replace(solid, volume_std=std, findings=findings)


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
