"""Solids from closed surfaces: a surface turned inside out is a void in the part around it; solids share no volume."""

from __future__ import annotations

from dataclasses import dataclass

import manifold3d
import numpy as np

from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.shape.mesh import Integers, TriangleMesh, part_moments, require_closed

SHARED = 0.02  # of the smaller solid: touching parts of rounded, faceted surfaces share up to this much
_INSIDE = 0.5  # winding number between outside (0) and inside (1)


@dataclass(frozen=True, eq=False)
class Solids:
    """What closed surfaces enclose.

    label    (P,) labels of the solid parts, rising
    moments  (P, 10) ten parameters at 1 kg/m^3 in the mesh's frame, the voids inside taken away
    void     (K,) labels of parts that are voids
    parent   (K,) label of the solid that each void lies in
    """

    label: Integers
    moments: Array
    void: Integers
    parent: Integers


def solids_of(mesh: TriangleMesh) -> Solids:
    """Return the solid parts of a mesh of closed surfaces.

    Raises BadValue where a part is open, has no volume, or is turned inside out without lying in another part.
    """
    require_closed(mesh)
    label, moments = mesh.labels, part_moments(mesh).copy()
    edge = float(np.ptp(mesh.bounds, axis=0).max())
    for k in np.flatnonzero(np.abs(moments[:, 0]) < 1e-12 * edge**3):
        raise BadValue(
            f"part {label[k]} has a volume of {moments[k, 0]:.3g} m^3, next to nothing. "
            "Leave it out, or give it thickness."
        )
    voids = np.flatnonzero(moments[:, 0] < 0)
    parents = np.array([_parent(mesh, label, moments[:, 0], k) for k in voids], np.int64)
    np.add.at(moments, parents, moments[voids])
    solid = moments[:, 0] > 0
    solid[voids] = False
    return Solids(label[solid], moments[solid], label[voids], label[parents])


def _parent(mesh: TriangleMesh, label: Integers, volume: Array, void: int) -> int:
    """Return the row of the smallest solid around the void."""
    point = mesh.vertices[mesh.triangles[mesh.part == label[void]][0, 0]]
    for k in np.argsort(volume):
        if volume[k] > -volume[void] and winding_number(mesh.corners[mesh.part == label[k]], point) > _INSIDE:
            return int(k)
    raise BadValue(
        f"part {label[void]} has a volume of {volume[void]:.3g} m^3, below zero, and lies in no other part. "
        "Turn its triangles outward."
    )


def winding_number(corners: Array, point: Array) -> float:
    """Return how often the surface of triangles (F, 3, 3) winds around `point` (3,): 1 inside, 0 outside.

    Source: Van Oosterom and Strackee 1983, the solid angle of a triangle.
    """
    a, b, c = np.moveaxis(corners - point, 1, 0)
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    triple = np.einsum("fi,fi->f", a, np.cross(b, c))
    rest = la * lb * lc + (a * b).sum(1) * lc + (b * c).sum(1) * la + (c * a).sum(1) * lb
    return float(np.arctan2(triple, rest).sum() / (2 * np.pi))


def require_separate(mesh: TriangleMesh, shared: float = SHARED) -> TriangleMesh:
    """Return the mesh, or raise BadValue that names two solids that share volume.

    shared  the part of the smaller solid's volume up to which two are taken to touch only

    Pairs whose surfaces cannot be joined (an edge with four triangles) are not judged.
    """
    solids = solids_of(mesh)
    bodies = {int(k): _body(mesh, [int(k), *solids.void[solids.parent == k].tolist()]) for k in solids.label}
    boxes = {k: mesh.of_part(k).bounds for k in bodies}
    volume = dict(zip(bodies, solids.moments[:, 0].tolist(), strict=True))
    for a in bodies:
        for b in bodies:
            if a < b and (boxes[a][0] < boxes[b][1]).all() and (boxes[b][0] < boxes[a][1]).all():
                common = (bodies[a] ^ bodies[b]).volume()
                if common > shared * min(volume[a], volume[b]):
                    raise BadValue(
                        f"parts {a} and {b} share {common * 1e6:.3g} cm^3 of space "
                        f"({100 * common / min(volume[a], volume[b]):.0f} % of the smaller). "
                        "Cut one out of the other, so that they only touch."
                    )
    return mesh


def _body(mesh: TriangleMesh, labels: list[int]) -> manifold3d.Manifold:
    """Return the parts as one body for set operations."""
    chosen = np.isin(mesh.part, labels)
    used, corners = np.unique(mesh.triangles[chosen], return_inverse=True)
    return manifold3d.Manifold(
        manifold3d.Mesh64(
            np.ascontiguousarray(mesh.vertices[used]), np.ascontiguousarray(corners.reshape(-1, 3), np.uint64)
        )
    )
