"""Triangle meshes of several closed parts, and the exact moments of what each part encloses."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from steelyard import check
from steelyard.check import Array, Integers
from steelyard.errors import BadValue
from steelyard.inertia import InertialParameters
from steelyard.shape.eight_bits import Colours, eight_bits
from steelyard.spatial import Pose, Rotation, area_vectors, cross, summed


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """F triangles over V vertices; each triangle belongs to one part and turns its front side outward.

    vertices   (V, 3) [m]
    triangles  (F, 3) numbers of the corners, counter-clockwise seen from outside
    part       (F,) label of the part that each triangle bounds
    rgb        (F, 3) uint8 colour of each triangle, None where it is not known; given as floats 0..1 or numbers 0..255
    """

    vertices: Array
    triangles: Integers
    part: Integers
    rgb: Colours | None = None

    def __post_init__(self) -> None:
        vertices = check.vectors("mesh vertices", self.vertices)
        triangles, part = check.whole("triangles", self.triangles), check.whole("part labels", self.part)
        if vertices.ndim != 2 or triangles.ndim != 2 or triangles.shape[1] != 3 or not len(triangles):
            raise BadValue(
                f"a mesh needs vertices (V, 3) and triangles (F, 3), F > 0; got {vertices.shape} and {triangles.shape}."
            )
        if part.shape != triangles.shape[:1]:
            raise BadValue(f"each of the {len(triangles)} triangles needs one part label; got {part.shape}.")
        if triangles.min() < 0 or triangles.max() >= len(vertices):
            raise BadValue(
                f"triangles must name vertices 0..{len(vertices) - 1}; got {triangles.min()}..{triangles.max()}."
            )
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "triangles", triangles)
        object.__setattr__(self, "part", part)
        if self.rgb is not None:
            rgb = eight_bits(self.rgb)
            rgb.flags.writeable = False
            if rgb.shape != triangles.shape:
                raise BadValue(f"each of the {len(triangles)} triangles needs one colour; got {rgb.shape}.")
            object.__setattr__(self, "rgb", rgb)

    def __len__(self) -> int:
        return len(self.triangles)

    @property
    def labels(self) -> Integers:
        """Labels of the parts (P,), rising."""
        return np.unique(self.part)

    @property
    def corners(self) -> Array:
        """Corners (F, 3, 3) of the triangles [m]."""
        return np.asarray(self.vertices[self.triangles])

    @property
    def colours(self) -> Colours:
        """Colour (F, 3) of every triangle, grey where it is not known."""
        return np.full((len(self), 3), 128, np.uint8) if self.rgb is None else self.rgb

    @property
    def bounds(self) -> Array:
        """Lower and upper corner (2, 3) of the box around all triangles [m]."""
        used = self.vertices[self.triangles.ravel()]
        return np.stack([used.min(0), used.max(0)])

    def areas(self) -> Array:
        """Return the area (F,) of every triangle [m^2]."""
        return np.asarray(np.linalg.norm(area_vectors(self.corners), axis=1))

    def of_part(self, *labels: int) -> TriangleMesh:
        """Return the triangles of one part, or of some, with only the vertices they use."""
        chosen = np.isin(self.part, labels)
        used, corners = np.unique(self.triangles[chosen], return_inverse=True)
        rgb = None if self.rgb is None else self.rgb[chosen]
        return TriangleMesh(self.vertices[used], corners.reshape(-1, 3), self.part[chosen], rgb)

    def in_frame(self, X_AB: Pose) -> TriangleMesh:
        """Return the same mesh, given in B, seen from frame A."""
        return replace(self, vertices=X_AB.apply(self.vertices))


def part_moments(mesh: TriangleMesh) -> Array:
    """Return the ten parameters (P, 10) of each part at 1 kg/m^3 in the mesh's frame, labels rising.

    The surface integral of each closed part, as signed tetrahedra over the mean of its corners: exact for flat
    triangles, negative for a surface turned inside out (a void). Nothing is checked; see `require_closed`.
    Source: divergence theorem.
    """
    labels, row = np.unique(mesh.part, return_inverse=True)
    middle = _middles(mesh, row, len(labels))
    corners = np.moveaxis(mesh.corners - middle[row][:, None], 1, 0)
    volume = (corners[0] * cross(corners[1], corners[2])).sum(1) / 6
    return tetrahedra_moments(corners, volume, row, middle)


def tetrahedra_moments(corners: Array, volume: Array, group: Integers, middle: Array) -> Array:
    """Return the ten parameters (G, 10) of groups of tetrahedra at 1 kg/m^3.

    corners  (4, T, 3) about the middle of their group; (3, T, 3) where the fourth corner of each is that middle
    volume   (T,) may be negative      group (T,) of each, 0..G-1      middle (G, 3)

    Source: a tetrahedron's second moment about a point is V/20 (sum v v^T + s s^T), s the sum of its corners v.
    """
    count, total = len(middle), corners.sum(0)
    pseudo = np.empty((count, 4, 4))
    for i in range(3):
        pseudo[:, i, 3] = pseudo[:, 3, i] = np.bincount(group, volume / 4 * total[:, i], count)
        for j in range(i, 3):
            second = (corners[..., i] * corners[..., j]).sum(0) + total[:, i] * total[:, j]
            pseudo[:, i, j] = pseudo[:, j, i] = np.bincount(group, volume / 20 * second, count)
    pseudo[:, 3, 3] = np.bincount(group, volume, count)
    about_middle = InertialParameters.from_pseudo_inertia(pseudo)
    return about_middle.in_frame(Pose(Rotation.identity(count), middle)).vector


def _middles(mesh: TriangleMesh, row: Integers, count: int) -> Array:
    """Return the mean corner (P, 3) of each part: a point near it, so that no digits are lost far from the origin."""
    sums = summed(np.repeat(row, 3), mesh.corners.reshape(-1, 3), count)
    return np.asarray(sums / (3 * np.bincount(row, minlength=count))[:, None])


def open_edges(mesh: TriangleMesh) -> Integers:
    """Return how many edges (P,) of each part, labels rising, lack a neighbour that runs the other way.

    An edge is closed when as many triangles of its part run along it one way as the other.
    """
    labels, row = np.unique(mesh.part, return_inverse=True)
    start, end = mesh.triangles, np.roll(mesh.triangles, -1, axis=1)
    forward = np.where(start < end, 1.0, -1.0).ravel()
    low, high = np.minimum(start, end).ravel(), np.maximum(start, end).ravel()
    size = len(mesh.vertices)
    key = (np.repeat(row, 3) * size + low) * size + high
    edges, place = np.unique(key, return_inverse=True)
    unmatched = np.abs(np.bincount(place, forward)).astype(np.int64)
    return np.bincount(edges // (size * size), unmatched, len(labels)).astype(np.int64)


def require_closed(mesh: TriangleMesh) -> TriangleMesh:
    """Return the mesh, or raise BadValue that names the first open part and how many edges are open."""
    counts = open_edges(mesh)
    if counts.any():
        worst = int(np.flatnonzero(counts)[0])
        raise BadValue(
            f"part {mesh.labels[worst]} is not closed: {counts[worst]} edges lack a neighbour that runs the other way. "
            "Close the surface, weld equal vertices, and turn all triangles outward."
        )
    return mesh
