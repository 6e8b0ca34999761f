"""Bodies made of boxes, as clouds with known parts and as solids."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import Delaunay

from steelyard.check import Array
from steelyard.shape.cloud import Cloud
from steelyard.shape.tets import TetMesh

Box = tuple[Sequence[float], Sequence[float]]  # low and high corner
SLACK = 1e-9


def inside(points: Array, box: Box, slack: float = 0.0) -> Array:
    """Which points lie in the box, `slack` wider."""
    low, high = np.array(box[0]) - slack, np.array(box[1]) + slack
    return ((points > low) & (points < high)).all(-1)


def body(boxes: Sequence[Box], colours: Sequence[Sequence[int]], points: int = 1500, seed: int = 0) -> Cloud:
    """Points evenly over the surface of a union of boxes; label = the box; no point inside another box."""
    rng = np.random.default_rng(seed)
    xyz, label = [], []
    edges = np.array([np.array(high) - np.array(low) for low, high in boxes])
    areas = np.stack([edges[:, 1] * edges[:, 2], edges[:, 0] * edges[:, 2], edges[:, 0] * edges[:, 1]], axis=1)
    for k, (low, _) in enumerate(boxes):
        for axis in range(3):
            for side in (0.0, 1.0):
                share = rng.uniform(size=(round(points * areas[k, axis] / (2 * areas.sum())), 3))
                share[:, axis] = side
                xyz.append(np.array(low) + share * edges[k])
                label.append(np.full(len(share), k))
    p, part = np.concatenate(xyz), np.concatenate(label)
    hidden = np.zeros(len(p), dtype=bool)
    for k, box in enumerate(boxes):
        hidden |= inside(p, box, SLACK) & (part != k)
    return Cloud(p[~hidden], np.array(colours, np.uint8)[part[~hidden]], part[~hidden])


def solid(cloud: Cloud, boxes: Sequence[Box]) -> TetMesh:
    """The Delaunay tets of the cloud whose centroid lies in a box."""
    tets = Delaunay(cloud.xyz).simplices
    centroid = cloud.xyz[tets].mean(1)
    volume = np.abs(np.linalg.det(cloud.xyz[tets[:, 1:]] - cloud.xyz[tets[:, :1]]))
    kept = np.any([inside(centroid, box) for box in boxes], axis=0) & (volume > 1e-12 * volume.max())
    return TetMesh(cloud.xyz, tets[kept])
