"""The tree of pieces by seams: which two clusters are one part rather, and what it costs to say that they are.

Between two clusters of one colour a seam shows where three things agree:
* their union is hollow: hull(a u b) - v_a - v_b over the whole volume (eq. 8 of "The Sum of Its Parts");
* the surface turns up across the border, on the mean around it. At a bend it turns up inside and down outside, which
  cancels; where an arm leaves a body or a screw a nut, it turns up all around. In thin walls, which turn faster inside
  than outside, what lies behind a place is looked at: what it turns down is taken off;
* the contact is a neck: small against the smaller cluster. A rib or flange is joined along its whole length.
Their product is the cost of keeping the two together. Colours are joined last, at the cost of the surface painted over.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from steelyard.check import Array, Integers
from steelyard.parts.hierarchy import Hierarchy
from steelyard.parts.hulls import hulls_of
from steelyard.parts.seams.costs import AREA, BEHIND, LENGTH, TURN, VECTOR, WIDTH
from steelyard.parts.seams.merges import Clusters, merge
from steelyard.parts.skin import Skin
from steelyard.shape.hull import hull_work
from steelyard.shape.pairs import joined
from steelyard.shape.tets import TetMesh
from steelyard.spatial import area_vectors, summed

# Hulls need not be exact: points nearer to them than this, over the cube root of the volume, are on them.
_BLUNT = 0.005


@dataclass(frozen=True, eq=False)
class SeamTree:
    """The tree, and what keeping each merge costs.

    hierarchy  the pieces and their merges
    seam       (N-1,) cost of a part that holds both sides of the merge, of the order of the worth of a part
    """

    hierarchy: Hierarchy
    seam: Array


def seam_tree(mesh: TetMesh, skin: Skin, piece: Integers, colour: Integers) -> SeamTree:
    """Return the tree of pieces (T,) with colours (N,)."""
    count = len(colour)
    corner = np.zeros((count, len(mesh.vertices)), dtype=bool)  # which vertices each piece has
    corner[np.repeat(piece, 4), mesh.tets.ravel()] = True
    middle, scale = mesh.vertices[corner.any(0)].mean(0), mesh.volume ** (1 / 3)
    xyz = np.ascontiguousarray((mesh.vertices - middle) / scale)
    contact = _contacts(mesh, skin, piece, count, xyz, scale)
    touch = contact[:, :, AREA] > 0
    _join_by_corners(corner, touch)
    owner, member = np.nonzero(corner)
    start = np.searchsorted(owner, np.arange(count + 1))
    share = np.bincount(piece[skin.cell], skin.areas, count) / max(float(skin.areas.sum()), 1e-300)
    volume = np.bincount(piece, mesh.volumes, count) / mesh.volume
    weighted = mesh.volumes[:, None] * (mesh.centroids - middle) / scale
    centre = summed(piece, weighted, count) / np.maximum(volume * mesh.volume, 1e-300)[:, None]
    clusters = Clusters.of(volume, share, colour, centre, contact, touch)
    hulls = hulls_of(start, member, 2 * count - 1, len(xyz))
    merges, cost, seam, node_volume, hull = merge(xyz, clusters, hulls, _BLUNT, hull_work(len(xyz)))
    whole = mesh.volume
    return SeamTree(Hierarchy(piece, merges, cost, node_volume * whole, hull * whole), seam)


def _contacts(mesh: TetMesh, skin: Skin, piece: Integers, count: int, xyz: Array, scale: float) -> Array:
    """Return for every two pieces (N, N, 22): contact area, its vector sum, and sums along their common border.

    The border's sums are of edge length l over d d^T, of l times the turn and of l times the turn of the other side of
    a thin wall, d the unit vector across: with them, the mean turns along any direction are known, for any union of
    pieces.

    xyz, scale  (V, 3) the vertices, over the scale [m]
    """
    table = np.zeros((count, count, WIDTH))
    ends = piece[mesh.dual]
    apart = ends[:, 0] != ends[:, 1]
    vector = area_vectors(xyz[mesh.inner_faces[apart]])
    area = np.linalg.norm(vector, axis=1)
    i, j = ends[apart].T
    np.add.at(table, (i, j, AREA), area)
    np.add.at(table, (j, i, AREA), area)
    for k in range(3):
        np.add.at(table, (i, j, VECTOR + k), vector[:, k])
        np.add.at(table, (j, i, VECTOR + k), -vector[:, k])
    ends = piece[skin.cell[skin.beside]]
    apart = ends[:, 0] != ends[:, 1]
    i, j = ends[apart].T
    across, length = skin.across[apart], skin.lengths[apart] / scale
    sums = (LENGTH, length), (TURN, length * skin.turning[apart]), (BEHIND, length * skin.turning_behind[apart])
    for k, (p, q) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))):
        for column, value in sums:
            part = value * across[:, p] * across[:, q]
            np.add.at(table, (i, j, column + k), part)
            np.add.at(table, (j, i, column + k), part)
    return table


def _join_by_corners(corner: Any, touch: Any) -> None:
    """Mark pieces of bodies without a common face as touching where they share one of the corners (N, V)."""
    body = joined(np.argwhere(touch), len(touch))
    if not body.any():
        return
    meeting = corner[:, corner.sum(0) > 1].astype(np.float32)
    shared = meeting @ meeting.T > 0
    touch |= shared & (body[:, None] != body)
