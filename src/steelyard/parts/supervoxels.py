"""Supervoxels of a coloured cloud that keep to the boundaries of parts, as initial clusters of a solid's tetrahedra.

Source: Lin, Wang, Zhai, Li, Li 2018, "Toward better boundary preserved supervoxel segmentation for 3D point clouds";
"The Sum of Its Parts", eq. 9 and section IV: the dissimilarity with colour, and 50 supervoxels. Points are visited from
the middle of the cloud outward, not in their order in the file, so that order and frame do not matter; the number asked
for is met, not missed by one; on fusion only representatives are counted, no point twice.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np

from steelyard.check import Array, Integers
from steelyard.errors import BadValue
from steelyard.parts.groups import root
from steelyard.shape.cloud import Cloud
from steelyard.shape.points.spacing import nearest
from steelyard.shape.sides.tangent_planes import plane_normals
from steelyard.shape.tets import TetMesh

COUNT = 50
NEIGHBOURS = 10
WEIGHTS = (10.0, 1.0, 1.0)  # of position (on a diagonal of one), colour (0..1) and normal


def supervoxels(cloud: Cloud, count: int = COUNT) -> Integers:
    """Return the supervoxel (N,), 0..count-1, of every point of a cloud; more where the cloud has more separate bodies.

    A cloud without colours is taken as of one colour; without normals, they are those of planes through neighbours.
    """
    from scipy.spatial import cKDTree

    if count < 1:
        raise BadValue(f"the number of supervoxels must be at least 1; got {count}.")
    middle = cloud.xyz - cloud.xyz.mean(0)
    axes = np.linalg.svd(middle.T @ middle)[0]
    diagonal = float(np.linalg.norm(np.ptp(middle @ axes, axis=0))) or 1.0
    order = np.argsort(np.round((middle**2).sum(1) / diagonal**2, 12), kind="stable")
    xyz = middle[order] / diagonal
    near = cKDTree(xyz).query(xyz, min(NEIGHBOURS + 1, len(xyz)))[1].reshape(len(xyz), -1)
    normals = plane_normals(xyz, near) if cloud.normals is None else cloud.normals[order]
    colour = np.zeros_like(xyz) if cloud.rgb is None else cloud.rgb[order] / 255
    feature = np.hstack([WEIGHTS[0] * xyz, WEIGHTS[1] * colour, normals])
    labels = np.empty(len(xyz), dtype=np.int64)
    fused = _fuse(feature, near, count, _first_threshold(feature, near))
    labels[order] = _exchange(feature, near, fused)
    return np.unique(labels, return_inverse=True)[1]


def pieces_of_points(mesh: TetMesh, cloud: Cloud, labels: Any) -> Integers:
    """Return the label (T,) of every tet: that of the point nearest to its centroid."""
    return np.asarray(np.asarray(labels, dtype=np.int64)[nearest(cloud.xyz, mesh.centroids)])


@numba.njit(cache=True, nogil=True)
def _distance(feature: Array, i: int, j: int) -> float:
    """Return eq. 9 of two points."""
    place = colour = along = 0.0
    for k in range(3):
        place += (feature[i, k] - feature[j, k]) ** 2
        colour += (feature[i, 3 + k] - feature[j, 3 + k]) ** 2
        along += feature[i, 6 + k] * feature[j, 6 + k]
    return float(np.sqrt(place) + np.sqrt(colour) + WEIGHTS[2] * (1 - abs(along)))


@numba.njit(cache=True, nogil=True)
def _first_threshold(feature: Array, near: Any) -> float:
    """Return the median over points of the least dissimilarity to a neighbour, above zero."""
    least = np.empty(len(near))
    for i in range(len(near)):
        least[i] = np.inf
        for j in near[i]:
            if j != i:
                least[i] = min(least[i], _distance(feature, i, j))
    return float(max(np.median(least), 1e-9))


@numba.njit(cache=True, nogil=True)
def _fuse(feature: Array, near: Any, count: int, threshold: float) -> Any:
    """Return the representative of every point: in every sweep each absorbs those near whose loss is below a threshold.

    The loss of absorbing j is its size times its dissimilarity; the threshold doubles. Separate bodies stay so.
    """
    n = len(near)
    parent, size, left = np.arange(n), np.ones(n, np.int64), n
    following, last = np.full(n, -1), np.arange(n)  # members of a supervoxel, as a list
    met = np.full(n, -1)
    visit, touching = -1, True
    while left > count and touching:
        touching = False
        for i in range(n):
            if parent[i] != i:
                continue
            visit += 1
            met[i] = visit
            member = i
            while member >= 0 and left > count:
                for k in near[member]:
                    j = root(parent, k)
                    if met[j] == visit:
                        continue
                    met[j] = visit
                    if size[j] * _distance(feature, i, j) < threshold:
                        parent[j] = i
                        size[i] += size[j]
                        following[last[i]], last[i] = j, last[j]
                        left -= 1
                        if left <= count:
                            break
                    touching = True
                member = following[member]
        threshold *= 2
    for i in range(n):
        parent[i] = root(parent, i)
    return parent


@numba.njit(cache=True, nogil=True)
def _exchange(feature: Array, near: Any, label: Any) -> Any:
    """Return the labels after points moved to the supervoxel next to them whose representative is more like them."""
    n = len(near)
    queue, queued = np.empty(n, np.int64), np.zeros(n, np.bool_)
    head, waiting = 0, 0
    for i in range(n):
        for j in near[i]:
            if label[j] != label[i] and not queued[i]:
                queued[i] = True
                queue[waiting] = i
                waiting += 1
    while waiting > 0:
        i = queue[head]
        head = (head + 1) % n
        waiting -= 1
        queued[i] = False
        own, least = label[i], _distance(feature, i, label[i])
        for j in near[i]:
            if label[j] != label[i]:
                other = _distance(feature, i, label[j])
                if other < least:
                    label[i], least = label[j], other
        if label[i] != own:
            for j in near[i]:
                if label[j] != label[i] and not queued[j]:
                    queued[j] = True
                    queue[(head + waiting) % n] = j
                    waiting += 1
    return label
