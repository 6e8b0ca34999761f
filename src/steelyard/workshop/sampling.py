"""A coloured, labelled cloud of the surface that a camera going around a tool would see."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array, Integers, Mask
from steelyard.errors import BadValue
from steelyard.shape.cloud import Cloud
from steelyard.shape.mesh import TriangleMesh
from steelyard.shape.nesting import body_of
from steelyard.spatial import area_vectors
from steelyard.workshop.finish import finished
from steelyard.workshop.solids import Solid, union
from steelyard.workshop.tools import Tool

POINTS = 2000
_VIEWS = 40  # camera directions all around
_GRAZING = 0.1  # cosine below which a camera does not count as seeing a surface
_LIFT = 2e-5  # points are lifted by this much off their surface before looking [m]


def surface_cloud(tool: Tool, seed: int = 0, points: int = POINTS) -> Cloud:
    """Return `points` points spread evenly over the visible area of a tool, in its frame O, without noise.

    A point is visible where a far camera, one of forty around the tool or the one right above the point, sees it.
    Hidden solids, closed hollows and faces between parts have none. Same seed, same cloud.
    """
    rng = np.random.default_rng(seed)
    mesh = tool.mesh
    body = union([body_of(mesh, [int(label)]) for label in mesh.labels])
    reach = 2 * float(np.linalg.norm(np.ptp(mesh.bounds, axis=0)))
    xyz, normal, face = np.empty((0, 3)), np.empty((0, 3)), np.empty(0, np.int64)
    for _ in range(100):
        drawn = spread_evenly(mesh, rng, points)
        seen = _visible(body, drawn[0], drawn[1], reach)
        xyz, normal, face = (np.concatenate([a, b[seen]]) for a, b in zip((xyz, normal, face), drawn, strict=True))
        if len(xyz) >= points:
            break
    else:
        raise BadValue(f"{tool.name}: hardly any of its surface can be seen from outside.")
    xyz, normal, face = xyz[:points], normal[:points], face[:points]
    return Cloud(xyz, finished(tool.finish, xyz, normal, mesh.colours[face]), mesh.part[face])


def spread_evenly(mesh: TriangleMesh, rng: np.random.Generator, points: int) -> tuple[Array, Array, Integers]:
    """Return points (N, 3), unit normals (N, 3) and triangles (N,) drawn evenly over all area."""
    a, b, c = np.moveaxis(mesh.corners, 1, 0)
    vectors = area_vectors(mesh.corners)
    area = np.linalg.norm(vectors, axis=1)
    face = rng.choice(len(mesh), points, p=area / area.sum())
    u, v = rng.random((2, points, 1))
    outside = u + v > 1
    u, v = np.where(outside, 1 - u, u), np.where(outside, 1 - v, v)
    xyz = a[face] + u * (b - a)[face] + v * (c - a)[face]
    return xyz, vectors[face] / area[face, None], face.astype(np.int64)


def _visible(body: Solid, xyz: Array, normal: Array, reach: float) -> Mask:
    """Return which points (N,) some camera sees."""
    cameras = _cameras()
    facing = normal @ cameras.T
    start = xyz + _LIFT * normal
    out = np.zeros(len(xyz), np.bool_)
    for k in range(len(xyz)):
        above = body.ray_cast(start[k], start[k] + reach * normal[k])
        if not above:
            out[k] = True
        elif above[0].normal @ normal[k] < 0:  # it looks at a front side, so it is not inside a neighbour
            order = np.argsort(-facing[k])
            looks = cameras[order[facing[k, order] > _GRAZING]]
            out[k] = any(not body.ray_cast(start[k], start[k] + reach * look) for look in looks)
    return out


def _cameras() -> Array:
    """Return unit directions (40, 3), evenly spread (a Fibonacci spiral)."""
    k = np.arange(_VIEWS) + 0.5
    z, turn = 1 - 2 * k / _VIEWS, np.pi * (1 + np.sqrt(5)) * k
    flat = np.sqrt(1 - z * z)
    return np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=1)
