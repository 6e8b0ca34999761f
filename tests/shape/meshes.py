"""Small meshes with known moments."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull

from steelyard.shape.mesh import TriangleMesh

_FACES = np.array([
    [0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4], [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6],
    [1, 3, 5], [3, 7, 5],
])  # fmt: skip


def box_mesh(low: tuple[float, ...], high: tuple[float, ...], part: int = 0, inward: bool = False) -> TriangleMesh:
    """A box of twelve triangles."""
    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
    vertices = np.asarray(low) + corners * (np.asarray(high) - np.asarray(low))
    faces = _FACES[:, ::-1] if inward else _FACES
    return TriangleMesh(vertices, faces, np.full(12, part), np.full((12, 3), 50 + 30 * part, np.uint8))


def ball_mesh(radius: float, centre: tuple[float, ...], points: int = 4000) -> TriangleMesh:
    """The convex hull of evenly spread points of a sphere."""
    k = np.arange(points) + 0.5
    z, turn = 1 - 2 * k / points, np.pi * (1 + np.sqrt(5)) * k
    flat = np.sqrt(1 - z * z)
    xyz = np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=1)
    hull = ConvexHull(xyz)
    a, b, c = (xyz[hull.simplices[:, i]] for i in range(3))
    flip = (np.cross(b - a, c - a) * a).sum(1) < 0
    faces = np.where(flip[:, None], hull.simplices[:, ::-1], hull.simplices)
    return TriangleMesh(np.asarray(centre) + radius * xyz, faces, np.zeros(len(faces)))


def joined(*meshes: TriangleMesh) -> TriangleMesh:
    """Several meshes as one, labels kept."""
    sizes = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    return TriangleMesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.triangles + n for mesh, n in zip(meshes, sizes[:-1], strict=True)]),
        np.concatenate([mesh.part for mesh in meshes]),
        np.concatenate([mesh.rgb if mesh.rgb is not None else np.zeros_like(mesh.triangles) for mesh in meshes]),
    )


def without(mesh: TriangleMesh, *faces: int) -> TriangleMesh:
    """The mesh with some triangles removed."""
    keep = np.setdiff1d(np.arange(len(mesh)), faces)
    rgb = None if mesh.rgb is None else mesh.rgb[keep]
    return TriangleMesh(mesh.vertices, mesh.triangles[keep], mesh.part[keep], rgb)
