"""Parts of a solid by colour and shape, how many there are, and how sure that is.

Colour says where materials meet, unless it is a print, a shadow or the same on both sides; shape says where bodies
meet, unless they meet flush. Each is used for what it can tell: colours are cleaned first, pieces of one colour are
joined along what is no seam, and the tree is cut where the parts and the seams hidden in them are shortest to describe.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from steelyard.check import Array, Integers
from steelyard.errors import BadValue
from steelyard.parts.colour.fades import without_fades
from steelyard.parts.colour.modes import colour_modes
from steelyard.parts.colour.prints import without_prints
from steelyard.parts.description import cuts_of
from steelyard.parts.doubt import doubts
from steelyard.parts.inner_borders import cut_at_borders
from steelyard.parts.pieces import cell_colours, pieces_of, with_points
from steelyard.parts.seams.tree import seam_tree
from steelyard.parts.segmentation import Segmentation
from steelyard.parts.skin import Skin, skin_of
from steelyard.shape.cloud import Cloud
from steelyard.shape.eight_bits import Colours
from steelyard.shape.points.spacing import nearest
from steelyard.shape.tets import TetMesh
from steelyard.spatial import summed

PER_PART = 0.08  # worth of a part: a hollow of a twelfth of the volume at a full seam, or 0.8 % of the surface

AROUND = 16  # cells nearest to a point among which there is one of its colour, if it belongs to any


@dataclass(frozen=True, eq=False)
class Pieces:
    """A solid in small pieces of one colour each, before they are joined.

    skin     its boundary
    piece    (T,) the piece of every tet
    colour   (N,) the colour of every piece
    nearest  (points,) the tet of its colour nearest to every point of the cloud
    """

    cloud: Cloud
    mesh: TetMesh
    skin: Skin
    piece: Integers
    colour: Integers
    nearest: Integers


def segment(cloud: Cloud, solid: Any, *, parts: int | None = None) -> Segmentation:
    """Return the solid of a cloud in its homogeneous parts.

    cloud  points of the surface, with or without colours, in the frame of the solid
    solid  a TetMesh, or what has one under `mesh` (the Solid that `enclose` returns)
    parts  how many, where that is known; chosen by description length where not
    """
    return parts_of_pieces(coloured_pieces(cloud, solid), parts)


def coloured_pieces(cloud: Cloud, solid: Any) -> Pieces:
    """Return the small pieces that parts are put together from: the first half of `segment`."""
    mesh: TetMesh = solid if isinstance(solid, TetMesh) else solid.mesh
    cell = nearest_cell(cloud.xyz, mesh.centroids)
    same = _same(cloud, mesh)
    owner = np.arange(len(cloud)) if same else nearest(mesh.vertices, cloud.xyz)
    skin = skin_of(mesh, cloud.near if same else None)
    colour = np.zeros(len(mesh.vertices), dtype=np.int64)
    if cloud.rgb is not None:
        told = (cloud.normals, cloud.seen) if same else (None, None)  # what is known of points is known of vertices
        rgb = cloud.rgb if same else _vertex_colours(cloud.rgb, cloud.xyz, mesh.vertices, owner)
        colours = colour_modes(rgb, skin, *told)
        colour = without_prints(without_fades(colours, skin), skin)
    piece, of_piece = pieces_of(mesh, skin, cell_colours(mesh, colour))
    cell = _cell_of_its_colour(cloud.xyz, mesh.centroids, cell, colour[owner], of_piece[piece])
    piece, of_piece = with_points(mesh, piece, of_piece, cell)
    return Pieces(cloud, mesh, skin, piece, of_piece, cell)


def parts_of_pieces(pieces: Pieces, parts: int | None = None) -> Segmentation:
    """Return the parts put together from small pieces: the second half of `segment`."""
    tree = seam_tree(pieces.mesh, pieces.skin, pieces.piece, pieces.colour)
    cuts = cuts_of(tree.hierarchy, tree.seam, PER_PART)
    one = np.zeros(len(pieces.mesh), dtype=np.int64)
    whole = Segmentation(
        pieces.mesh, one, tree.hierarchy, cuts, None, one[pieces.nearest], ("part 0",), pieces.cloud, pieces.nearest
    )
    if parts is not None:
        return _with_borders(whole.cut(parts), pieces.skin)
    return replace(_with_borders(whole.cut(cuts.count), pieces.skin), findings=doubts(cuts, pieces.colour))


def _with_borders(made: Segmentation, skin: Skin) -> Segmentation:
    """Return parts with the cells that reach from one to another cut at the border; solids of other vertices as is.

    skin  the boundary of the solid
    """
    if len(made) == 1 or not _same(made.cloud, made.mesh):
        return made
    cut = cut_at_borders(made.mesh, skin, made.labels, made.point_part)
    if cut is None:
        return made
    tree, kept = made.hierarchy, cut.vertex < 0
    old = tree.piece[cut.cell]
    tree = tree.of_cells(np.where(kept, old, tree.piece[made.nearest[cut.vertex]]), cut.mesh.volumes)
    # Every cut cell keeps its part somewhere: there its points go on.
    staying = np.flatnonzero(kept)[::-1]
    goes_on = np.empty(len(made.mesh), np.int64)
    goes_on[cut.cell[staying]] = staying
    labels = np.where(kept, made.labels[cut.cell], made.point_part[cut.vertex])
    inner = len(cut.mesh.vertices) - len(made.mesh.vertices)
    cuts = None if made.cuts is None else replace(made.cuts, hierarchy=tree)
    drawn = replace(made, mesh=cut.mesh, hierarchy=tree, cuts=cuts, nearest=goes_on[made.nearest], inner=inner)
    return drawn.labelled(labels)


def nearest_cell(points: Array, centroids: Array) -> Integers:
    """Return which of the centroids (T, 3) is nearest to each point (N, 3).

    Raises BadValue where half of the points are farther away than the centroids are apart.
    """
    from scipy.spatial import cKDTree

    gap, found = cKDTree(centroids, balanced_tree=False, compact_nodes=False).query(points)
    far, size = float(np.median(gap)), float(np.linalg.norm(centroids.max(0) - centroids.min(0)))
    if far > size > 0:
        raise BadValue(
            f"half of the points lie more than {far:.3g} m from a solid {size:.3g} m large. "
            "Give the cloud and the solid in one frame and unit."
        )
    return np.asarray(found, dtype=np.int64)


def _cell_of_its_colour(
    points: Array, centroids: Array, cell: Integers, colour: Integers, of_cell: Integers
) -> Integers:
    """Return the cell (N,) of every point: of the nearest few the first of its colour, the nearest where none is.

    cell    (N,) the nearest
    colour  (N,) of the points, of_cell (T,) of the cells

    Cells reach through thin walls and layers to what is behind; the nearest is often of another colour than the point.
    """
    from scipy.spatial import cKDTree

    torn = np.flatnonzero(of_cell[cell] != colour)
    if not len(torn):
        return cell
    near = cKDTree(centroids).query(points[torn], min(AROUND, len(centroids)))[1].reshape(len(torn), -1)
    alike = of_cell[near] == colour[torn, None]
    found = cell.copy()
    found[torn] = np.where(alike.any(1), near[np.arange(len(torn)), alike.argmax(1)], cell[torn])
    return found


def _same(cloud: Cloud, mesh: TetMesh) -> bool:
    """Return whether the points are the vertices, in their order."""
    return cloud.xyz.shape == mesh.vertices.shape and np.array_equal(cloud.xyz, mesh.vertices)


def _vertex_colours(rgb: Colours, points: Array, vertices: Array, owner: Integers) -> Array:
    """Return the colour (V, 3) of every vertex: the mean of the points it is nearest to, else the nearest point's.

    owner  (N,) the vertex nearest to each point
    """
    count = np.bincount(owner, minlength=len(vertices))
    colours = summed(owner, rgb, len(vertices)) / np.maximum(count, 1)[:, None]
    empty = count == 0
    colours[empty] = rgb[nearest(points, vertices[empty])]
    return np.asarray(colours)
