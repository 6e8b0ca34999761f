"""Hierarchical tetrahedra clustering: pieces of a solid are joined, always the two whose union is the least hollow.

Source: "The Sum of Its Parts", section IV: eq. 8 and Algorithm 1; Attene et al. 2008, "Hierarchical convex
approximation of 3D shapes for fast region selection". Unlike the published code,
two edges between the same clusters are one, all initial clusters keep their neighbours, and bodies that do not touch
stay in the tree: they are joined last.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from steelyard.check import Integers
from steelyard.errors import BadValue
from steelyard.parts.hierarchy import Hierarchy
from steelyard.parts.htc.merging import merge_all
from steelyard.shape.hull import TOLERANCE
from steelyard.shape.pairs import distinct_pairs
from steelyard.shape.tets import TetMesh


def cluster(mesh: TetMesh, piece: Any = None) -> Hierarchy:
    """Return the tree of merges of the pieces of a solid.

    piece  (T,) initial cluster of every tet (labels, any integers), None: every tet by itself

    The cost of a merge is that of eq. 8: 1 + hollow where the union is hollow, else (n_i^2 + n_j^2) / N^2 of numbers of
    tets. Hollow is hull(i and j) - volume(i) - volume(j), scaled to a solid whose box has a diagonal of one. Separate
    bodies are joined last, at cost inf, always the two of least volume. Raises BadValue where the shape does not fit.
    """
    leaf = np.arange(len(mesh)) if piece is None else _numbered(piece, len(mesh))
    count = int(leaf.max()) + 1
    start, member = _corners(mesh, leaf, count)
    used = mesh.vertices[np.bincount(mesh.tets.ravel(), minlength=len(mesh.vertices)) > 0]
    diagonal = float(np.linalg.norm(np.ptp(used, axis=0)))
    xyz = np.ascontiguousarray(mesh.vertices - used.mean(0)) / diagonal
    volumes = np.bincount(leaf, mesh.volumes / diagonal**3, count).astype(np.float64)
    tets, edges = np.bincount(leaf, minlength=count), _edges(mesh, leaf, count)
    merges, costs, volume, hull = merge_all(xyz, start, member, volumes, tets, edges, TOLERANCE)
    return Hierarchy(leaf, merges, costs, volume * diagonal**3, hull * diagonal**3)


def _numbered(labels: Any, tets: int) -> Integers:
    labels = np.asarray(labels)
    if labels.shape != (tets,) or labels.dtype.kind not in "iu":
        raise BadValue(f"piece needs one whole number per tet ({tets},); got {labels.dtype} of shape {labels.shape}.")
    return np.unique(labels, return_inverse=True)[1]


def _corners(mesh: TetMesh, leaf: Integers, count: int) -> tuple[Integers, Integers]:
    """Return the vertices of every piece, each once: those of piece k are member[start[k]:start[k + 1]]."""
    owner, member = distinct_pairs(np.repeat(leaf, 4), mesh.tets.ravel(), len(mesh.vertices)).T
    return np.r_[0, np.cumsum(np.bincount(owner, minlength=count))], member


def _edges(mesh: TetMesh, leaf: Integers, count: int) -> Integers:
    """Return pairs (E, 2) of pieces that share a face, each once."""
    one, other = leaf[mesh.dual].T
    ends = distinct_pairs(np.minimum(one, other), np.maximum(one, other), count)
    return np.asarray(ends[ends[:, 0] != ends[:, 1]])
