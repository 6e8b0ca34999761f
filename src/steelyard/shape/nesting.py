"""Solids from closed surfaces: a surface turned inside out is a void in the part around it; solids share no volume."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import manifold3d
import numpy as np

from steelyard.check import Array, Integers
from steelyard.errors import BadValue
from steelyard.findings import Finding
from steelyard.shape.mesh import TriangleMesh, part_moments, require_closed

TOUCHING = 0.02  # of the smaller solid: rounded, faceted surfaces that touch share up to this much
TOO_MUCH = 0.1  # of the whole: mass counted twice beyond this is no longer a detail
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
    parents = np.array([_parent(mesh, label, moments[:, 0], int(k)) for k in voids], np.int64)
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


@dataclass(frozen=True)
class Overlap:
    """Two solids `a` and `b` (labels) that share `volume` [m^3], as a part of the smaller and of the whole object."""

    a: int
    b: int
    volume: float
    of_smaller: float
    of_whole: float

    def __str__(self) -> str:
        return (
            f"parts {self.a} and {self.b} share {self.volume * 1e6:.2g} cm^3 of space "
            f"({100 * self.of_smaller:.1f} % of the smaller, {100 * self.of_whole:.1f} % of the whole)"
        )


def overlaps(mesh: TriangleMesh, solids: Solids | None = None) -> tuple[Overlap, ...]:
    """Return the pairs of solids that share more volume than rounded, faceted surfaces that touch.

    solids  those of the mesh, where they are known already

    Pairs whose surfaces cannot be joined (an edge with four triangles) are not judged. Raises as `solids_of`.
    """
    solids = solids_of(mesh) if solids is None else solids
    whole = float(solids.moments[:, 0].sum())
    boxes = np.stack([mesh.of_part(int(k)).bounds for k in solids.label])
    bodies: dict[int, manifold3d.Manifold] = {}
    found = []
    for i, j in combinations(range(len(boxes)), 2):
        if (boxes[i, 0] > boxes[j, 1]).any() or (boxes[j, 0] > boxes[i, 1]).any():
            continue
        for k in (i, j):
            if k not in bodies:
                voids = solids.void[solids.parent == solids.label[k]].tolist()
                bodies[k] = body_of(mesh, [int(solids.label[k]), *voids])
        volume, smaller = (bodies[i] ^ bodies[j]).volume(), float(solids.moments[[i, j], 0].min())
        if volume > TOUCHING * smaller:
            found.append(Overlap(int(solids.label[i]), int(solids.label[j]), volume, volume / smaller, volume / whole))
    return tuple(found)


def overlap_finding(mesh: TriangleMesh, solids: Solids | None = None) -> Finding | None:
    """Return the finding `parts-overlap` where solids share a little volume, else None; `solids` as in `overlaps`.

    Raises BadValue that names the two solids where they share over 10 % of the object's volume.
    """
    found = overlaps(mesh, solids)
    for overlap in found:
        if overlap.of_whole > TOO_MUCH:
            raise BadValue(f"{overlap}. Cut one out of the other, so that they only touch.")
    return Finding.of("parts-overlap", f"{'; '.join(map(str, found))}.".capitalize()) if found else None


def body_of(mesh: TriangleMesh, labels: list[int]) -> manifold3d.Manifold:
    """Return the parts as one body for set operations."""
    own = mesh.of_part(*labels)
    # Arrays of its own: read-only ones are refused.
    return manifold3d.Manifold(manifold3d.Mesh64(np.array(own.vertices), own.triangles.astype(np.uint64)))
