"""The cells of a Delaunay complex that lie behind a surface, and how far they look like a solid."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array, Mask
from steelyard.errors import BadValue
from steelyard.shape.cells.cells import votes_of
from steelyard.shape.cells.islands import without_islands
from steelyard.shape.orient import DEPTH, Oriented, on_sheets, ties_between
from steelyard.shape.sides.discs import Discs
from steelyard.shape.sides.sheets import stacked
from steelyard.shape.tets import TetMesh

CLEAR = 0.2  # doubt below which no sheets need be looked at
_JUMP = 0.01  # of a spacing: height over which the jump through a disc is spread
_LEFT = 0.5  # of the volume, at least, or it was not the walls' thickness that was found
# Share of the points that sheets turned above which the solid without them is looked at, and the share of its blur that
# it leaves, at most, where sheets were seen that are none.
_UPSET, _NO_SHEETS = 0.02, 0.8


@dataclass(frozen=True, eq=False)
class Filled:
    """Which cells of a complex lie inside.

    mesh    all T cells
    score   (T,) above zero where the surface says inside
    inside  (T,) whether each is, without free groups
    solid   those that are
    blur    how little their winding numbers look like a solid (see `_blur`)
    doubt   the same, with what contradicts them (see `_contradictions`) where it is not clear
    """

    mesh: TetMesh
    score: Array
    inside: Mask
    solid: TetMesh
    blur: float
    doubt: float


def filled(surface: Oriented) -> Filled:
    """Return the cells that lie behind a surface. Raises BadValue where there are none."""
    found = _filled(surface)
    if found is None:
        raise BadValue(
            "the points enclose nothing: no side of their surface is inside. Scan the object from all sides."
        )
    return found


def _filled(surface: Oriented) -> Filled | None:
    """Return the cells that lie behind a surface, None where there are none."""
    sites, (mesh, centres) = surface.sites, surface.sites.cells
    # How much the normals (-1..1) of its corners say that a cell lies inside.
    votes = votes_of(sites.xyz, surface.normals, mesh.tets, centres)
    found = _winding_number(surface)
    score = found - 0.5 + votes
    if not (score > 0).any():
        return None
    inside = without_islands(mesh, score > 0)
    blur = _blur(mesh.volumes, found, votes)
    doubt = blur + _contradictions(surface) if blur > CLEAR else blur
    return Filled(mesh, score, inside, mesh.chosen(inside), blur, doubt)


def clearer_alone(surface: Oriented, found: Filled) -> tuple[Oriented, Filled]:
    """Return the surface and its cells without what sheets said, where these are clear and clearer.

    Relief as deep as the points are far apart, as of threads and ribs, looks like sheets that face each other: what
    they say of their sides then turns whole rods inside out, where dipoles alone are right. Walls that are two layers
    are sheets.
    """
    surface, found = _clearer_thick(surface, found)
    alone = surface.alone if surface.layers is None else None
    if alone is None or float(((alone * surface.normals).sum(1) < 0).mean()) < _UPSET:
        return surface, found
    without = outward(Oriented(surface.sites, alone))
    again = _filled(without)
    if again is None or again.blur >= min(CLEAR, _NO_SHEETS * found.blur):
        return surface, found
    return without, again


def _clearer_thick(surface: Oriented, found: Filled) -> tuple[Oriented, Filled]:
    """Return the surface and its cells without the two layers of a thin wall, where these are no clearer for them.

    Grooves finer than the points are far apart have two layers, too, but one side.
    """
    sites, alone = surface.sites, surface.alone
    if alone is None or surface.layers is None or not surface.layers.part:
        return surface, found
    thick = outward(Oriented(sites, on_sheets(sites, alone), alone))
    again = _filled(thick)
    return (surface, found) if again is None or found.blur < again.blur else (thick, again)


def by_walls(surface: Oriented, found: Filled) -> tuple[Oriented, Filled]:
    """Return the surface and its cells found anew from the one thickness of its walls, or as they are if it has none.

    Doubt stays: what a thickness tells is likely, not seen.
    """
    again = surface.walled()
    if again is None:
        return surface, found
    again = outward(again)
    emptied = filled(again)
    if emptied.solid.volume < _LEFT * found.solid.volume:
        return surface, found
    return again, replace(emptied, doubt=max(found.doubt, emptied.doubt))


def outward(surface: Oriented) -> Oriented:
    """Return the surface, all of it turned if it is inside out."""
    # What the hull shows is the outer side: true also of a surface with holes, whose total flux may have any sign.
    sites = surface.sites
    inside_out = sites.delaunay.flux(sites.xyz, surface.normals, sites.spacing) < 0
    return replace(surface, normals=-surface.normals) if inside_out else surface


def _winding_number(surface: Oriented) -> Array:
    """Return the winding number (T,) of the surface at centroids of cells."""
    sites = surface.sites
    discs = Discs.on(sites.tree, surface.normals, surface.area, DEPTH, _JUMP * sites.spacing)
    found = sites.sight_of_cells.targets.back(discs.winding(sites.sight_of_cells))
    return np.asarray(np.clip(found, 0, 2), float)


def _blur(volumes: Array, found: Array, votes: Array) -> float:
    """Return how little the cells inside look like it: 0 for a clean solid, 1/2 where walls and gaps are one blur.

    What their mean winding number lacks to 1, and twice the share of them that the normals call outside.
    """
    inside = volumes * (found - 0.5 + votes > 0)
    return float((inside * (1 - found + 2 * (votes < 0) * (found > 0.5))).sum() / inside.sum())


def _contradictions(surface: Oriented) -> float:
    """Return the share of points beside a sheet that looks the same way, and that of ties between points not kept."""
    sites, normals, layers = surface.sites, surface.normals, surface.layers
    behind = stacked(sites.xyz, normals, sites.near.index, sites.sheets(layers)[1])
    return behind + ties_between(sites, normals, layers).torn
