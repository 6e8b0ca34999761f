"""Solids cut by planes and lines: exact moments of slabs, and points spread through the inside."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array
from steelyard.inertia import InertialParameters
from steelyard.shape.inside import inside
from steelyard.shape.mesh import TriangleMesh
from steelyard.spatial import Pose, Rotation


def below(corners: Array, normal: Array, offset: float) -> Array:
    """Return the triangles (F', 3, 3) [m] of a surface (F, 3, 3) on the side n x < offset, cut at the plane, left open.

    normal  n (3,); offset [m]
    """
    side = corners @ normal - offset
    inside = side < 0
    count = inside.sum(1)
    # Turn each cut triangle so that the corner alone on its side comes first.
    lonely = np.where(count == 1, inside.argmax(1), (~inside).argmax(1))
    order = (lonely[:, None] + np.arange(3)) % 3
    turned = np.take_along_axis(corners, order[:, :, None], 1)
    height = np.take_along_axis(side, order, 1)
    first, second = (_crossing(turned[:, 0], turned[:, k], height[:, 0], height[:, k]) for k in (1, 2))
    one, two = count == 1, count == 2
    return np.concatenate([
        corners[count == 3],
        np.stack([turned[one, 0], first[one], second[one]], 1),
        np.stack([first[two], turned[two, 1], turned[two, 2]], 1),
        np.stack([first[two], turned[two, 2], second[two]], 1),
    ])  # fmt: skip


def _crossing(a: Array, b: Array, height_a: Array, height_b: Array) -> Array:
    """Return where the edges a-b meet height zero; nonsense where they do not cross."""
    fall = height_a - height_b
    share = height_a / np.where(fall == 0, 1.0, fall)
    return np.asarray(a + share[:, None] * (b - a))


def moments_about(corners: Array, point: Array) -> Array:
    """Return the ten parameters (10,) at 1 kg/m^3 of what triangles (F, 3, 3) and flat caps through `point` enclose.

    Signed tetrahedra over `point`: those over a cap that holds it are flat, so that caps need not be made.
    """
    v = corners - point
    volume = np.linalg.det(v) / 6
    total = v.sum(1)
    second = np.einsum("f,fki,fkj->ij", volume / 20, v, v) + np.einsum("f,fi,fj->ij", volume / 20, total, total)
    pseudo = np.zeros((4, 4))
    pseudo[:3, :3] = 0.5 * (second + second.T)
    pseudo[:3, 3] = pseudo[3, :3] = (volume / 4) @ total
    pseudo[3, 3] = volume.sum()
    here = InertialParameters.from_pseudo_inertia(pseudo)
    return here.in_frame(Pose(Rotation.identity(), point)).vector


def slabs(corners: Array, whole: Array, normal: Array, offsets: Array) -> Array:
    """Return the moments (K + 1, 10) of a closed surface cut by planes n x = offsets (K,); they add up to `whole`."""
    up_to = [moments_about(below(corners, normal, o), o * normal) for o in offsets]
    return np.diff(np.stack([np.zeros(10), *up_to, whole]), axis=0)


def interior_points(mesh: TriangleMesh, count: int) -> Array:
    """Return about `count` points (K, 3) inside the closed surfaces of a mesh, evenly spread, in its frame [m]."""
    return inside(mesh, count)[0]
