"""Parts of a solid by colour and shape, how many there are, and how sure that is.

Colour says where materials meet, unless it is a print, a shadow or the same on both sides; shape says where bodies
meet, unless they meet flush. Each is used for what it can tell: colours are cleaned first, pieces of one colour are
joined along what is no seam, and the tree is cut where the parts and the seams hidden in them are shortest to describe.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from steelyard import check
from steelyard.check import Array, Integers
from steelyard.errors import BadValue
from steelyard.findings import Finding
from steelyard.parts.colours import colour_modes
from steelyard.parts.description import Cuts, cuts_of
from steelyard.parts.doubt import doubts
from steelyard.parts.fades import without_fades
from steelyard.parts.hierarchy import Hierarchy
from steelyard.parts.inner_borders import cut_at_borders
from steelyard.parts.parts import Parts
from steelyard.parts.pieces import cell_colours, pieces_of, with_points
from steelyard.parts.prints import without_prints
from steelyard.parts.seams import seam_tree
from steelyard.parts.skin import Skin, skin_of
from steelyard.shape.cloud import Cloud
from steelyard.shape.eight_bits import Colours
from steelyard.shape.points.spacing import nearest
from steelyard.shape.tets import TetMesh
from steelyard.spatial import summed

PER_PART = 0.08  # worth of a part: a hollow of a twelfth of the volume at a full seam, or 0.8 % of the surface

AROUND = 16  # cells nearest to a point among which there is one of its colour, if it belongs to any


@dataclass(frozen=True, eq=False)
class Segmentation:
    """A solid in P parts.

    mesh        the solid, T tets [m]; those that reached through it from part to part are cut at the border
    labels      (T,) the part 0..P-1 of every tet, by falling volume
    hierarchy   the tree that the parts are cut from
    cuts        the best cut into every number of parts, with its description length; None where `labels` were given
    rgb         (P, 3) mean colour 0..255 of the points of each part, None where the cloud has no colours
    point_part  (N,) the part of every point of the cloud: that of the nearest tet of the point's colour
    names       (P,) what each part is called
    findings    what a reader must know of the cut that was chosen; none of a cut asked for
    inner       how many vertices, the last ones, lie inside, where cells are cut at borders
    """

    mesh: TetMesh
    labels: Integers
    hierarchy: Hierarchy
    cuts: Cuts | None
    rgb: Array | None
    point_part: Integers
    names: tuple[str, ...]
    cloud: Cloud
    nearest: Integers
    findings: tuple[Finding, ...] = ()
    inner: int = 0

    def __len__(self) -> int:
        """Number P of parts."""
        return len(self.names)

    @cached_property
    def parts(self) -> Parts:
        """The parts with their exact moments, in the frame of the solid."""
        return Parts(np.arange(len(self)), self.mesh.moments(self.labels, len(self)), self.rgb)

    @cached_property
    def border_share(self) -> float:
        """Share of the volume that corners of another part say, of cells that reach from one part to another.

        Inside a thick body nothing shows where the border lies. Corners where cells were cut at it count, too: it is
        taken to be flat, which a tang or a plug is not.
        """
        cut = self.mesh.tets >= len(self.mesh.vertices) - self.inner
        foreign = cut | (self._vertex_part[self.mesh.tets] != self.labels[:, None])
        return float((self.mesh.volumes * foreign.mean(1)).sum() / self.mesh.volume)

    @property
    def _vertex_part(self) -> Integers:
        """The part (V,) of every vertex: that of the nearest point."""
        return np.asarray(self.point_part[nearest(self.cloud.xyz, self.mesh.vertices)])

    @property
    def sureness(self) -> Array:
        """Share (K,) of every number of parts 1..K; see `Cuts.sureness`."""
        if self.cuts is None:
            raise BadValue("the parts of this solid were given, not chosen; there is no score of their number.")
        return self.cuts.sureness

    def cut(self, count: int) -> Segmentation:
        """Return the solid in another number of parts: the best cut of the tree into so many."""
        nodes = self.hierarchy.nodes(count) if self.cuts is None else self.cuts.nodes(count)
        return self.cut_at(nodes)

    def cut_at(self, nodes: Sequence[int]) -> Segmentation:
        """Return the solid in the parts that are these nodes of the hierarchy."""
        return self._labelled(self.hierarchy.cut_at(nodes))

    def with_labels(self, labels: Integers) -> Segmentation:
        """Return the solid in the parts of `labels` (T,), any whole numbers; they are numbered by falling volume.

        They are given, not chosen: `cuts` is None then, and a log is offered no others. The cells are those of `mesh`
        of this segmentation: those of the solid that reached over a border between parts were cut. Raises BadValue.
        """
        labels = check.whole("labels", labels)
        if labels.shape != (len(self.mesh),):
            raise BadValue(
                f"labels must be one for each of the {len(self.mesh)} cells of the segmentation's own mesh; got shape "
                f"{labels.shape}. The solid's mesh has others: cells at borders were cut."
            )
        return replace(self._labelled(labels), cuts=None)

    def _labelled(self, labels: Integers) -> Segmentation:
        ordered = by_volume(labels, self.mesh)
        point_part = ordered[self.nearest]
        count = int(ordered.max()) + 1
        rgb = _mean_colours(self.cloud.rgb, point_part, count)
        names = tuple(f"part {k}" for k in range(count))
        return replace(self, labels=ordered, rgb=rgb, point_part=point_part, names=names, findings=())

    def merged(self, groups: Sequence[Sequence[int]]) -> Segmentation:
        """Return parts joined: each group lists the parts that are one; it takes the name of its first part."""
        groups = [_group(group) for group in groups]
        named = [k for group in groups for k in group]
        if not all(groups) or len(set(named)) < len(named) or not set(named) <= set(range(len(self))):
            raise BadValue(f"groups must name parts 0..{len(self) - 1}, none twice, none empty; got {groups}.")
        goal = np.arange(len(self))
        for group in groups:
            goal[list(group)] = group[0]
        joined = self.with_labels(goal[self.labels])
        first = np.zeros(len(joined), dtype=np.int64)
        first[joined.labels] = goal[self.labels]
        return replace(joined, names=tuple(self.names[k] for k in first))

    def named(self, names: Sequence[str]) -> Segmentation:
        """Return the same parts under other names (P,)."""
        if len(names) != len(self):
            raise BadValue(f"{len(self)} parts need as many names; got {len(names)}.")
        return replace(self, names=tuple(names))


def _group(parts: Sequence[int]) -> list[int]:
    """Return the numbers of parts that are one."""
    numbers = check.whole("each group", parts)
    if numbers.ndim != 1:
        raise BadValue(f"groups must be lists of parts, such as [[0, 1]]; got {parts!r} as one of them.")
    return [int(k) for k in numbers]


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
    return drawn._labelled(labels)


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


def by_volume(labels: Any, mesh: TetMesh) -> Integers:
    """Return labels (T,) numbered from 0 by falling volume, equal ones by first appearance."""
    _, first, inverse = np.unique(labels, return_index=True, return_inverse=True)
    rank = np.empty(len(first), dtype=np.int64)
    rank[np.lexsort((first, -np.bincount(inverse, mesh.volumes)))] = np.arange(len(first))
    return np.asarray(rank[inverse])


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


def _mean_colours(rgb: Colours | None, part: Integers, count: int) -> Array | None:
    """Return the mean colour (P, 3) of each part's points; grey where a part has none."""
    if rgb is None:
        return None
    points = np.bincount(part, minlength=count)
    return np.where(points[:, None] > 0, summed(part, rgb, count) / np.maximum(points, 1)[:, None], 128.0)
