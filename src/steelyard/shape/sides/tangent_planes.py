"""Normals of a cloud by local planes, turned to agree along a tree of neighbours: the classic route, as published.

The noise of one tangent plane can turn a whole branch of the tree; `orient` judges all points together.
Source: Hoppe, DeRose, Duchamp, McDonald, Stuetzle 1992, "Surface reconstruction from unorganized points".
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, minimum_spanning_tree
from scipy.spatial import cKDTree

from steelyard import check
from steelyard.check import Array, Integers
from steelyard.errors import BadValue

NEIGHBOURS = 10
_ALIKE = 1e-6  # added to a cost that may be zero: a sparse matrix holds no zero


def tangent_normals(xyz: Array) -> Array:
    """Return unit normals (N, 3) of points (N, 3) [m]: the thin direction of the nearest, all turned alike.

    Every separate piece of the neighbour graph is turned so that its highest point looks up. Raises BadValue for
    fewer than four points.
    """
    xyz = check.vectors("points", xyz)
    if xyz.ndim != 2 or len(xyz) < 4:
        raise BadValue(f"normals need at least 4 points (N, 3); got {xyz.shape}.")
    near = cKDTree(xyz).query(xyz, min(NEIGHBOURS, len(xyz)))[1]
    return consistent(xyz, plane_normals(xyz, near), near)


def plane_normals(xyz: Array, near: Integers) -> Array:
    """Return the unit normals (N, 3), of either sign, of the planes through the neighbours `near` (N, k)."""
    gap = xyz[near] - xyz[near].mean(1, keepdims=True)
    return np.asarray(np.linalg.eigh(np.einsum("nki,nkj->nij", gap, gap))[1][..., 0])


def consistent(xyz: Array, normals: Array, near: Integers) -> Array:
    """Return the normals (N, 3) with signs that agree along the tree of least turning over neighbours `near` (N, k)."""
    count = len(xyz)
    start, end = np.repeat(np.arange(count), near.shape[1]), near.ravel()
    turning = 1 + _ALIKE - np.abs((normals[start] * normals[end]).sum(1))
    low, high = np.minimum(start, end), np.maximum(start, end)
    first = np.unique(low * count + high, return_index=True)[1]
    keep = first[low[first] != high[first]]
    ends = low[keep].astype(np.int32), high[keep].astype(np.int32)  # all that SciPy's graphs took before 1.17
    tree = minimum_spanning_tree(coo_array((turning[keep], ends), shape=(count, count)).tocsr())
    tree = tree + tree.T
    sign = np.zeros(count)
    for root in np.argsort(-xyz[:, 2], kind="stable"):
        if sign[root]:
            continue
        sign[root] = 1.0 if normals[root, 2] >= 0 else -1.0
        order, before = breadth_first_order(tree, root, directed=False)
        for point in order[1:]:
            parent = before[point]
            sign[point] = sign[parent] * (1.0 if normals[point] @ normals[parent] >= 0 else -1.0)
    return np.asarray(normals * sign[:, None])
