"""Third central moments of closed surfaces: what the moments of a density that is linear in position need."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array
from steelyard.shape.mesh import TriangleMesh
from steelyard.spatial import cross


def third_moments(mesh: TriangleMesh, about: Array) -> Array:
    """Return the integral of x_i x_j x_k (P, 3, 3, 3) [m^6] of each part, labels rising, x from `about` (P, 3) [m].

    Exact for flat triangles, negative for a surface turned inside out. With s the sum of the corners v of a
    tetrahedron and Q the sum of v v^T its integral is V/120 (s_i s_j s_k + s_i Q_jk + s_j Q_ik + s_k Q_ij
    + 2 sum v_i v_j v_k).
    Source: moments of barycentric coordinates, E[l^a] = 3! a! / (3 + |a|)!.
    """
    labels, row = np.unique(mesh.part, return_inverse=True)
    v = mesh.corners - about[row][:, None]
    volume = (v[:, 0] * cross(v[:, 1], v[:, 2])).sum(1) / 6
    s = v.sum(1)
    mixed = np.einsum("fi,faj,fak->fijk", s, v, v)
    each = np.einsum("fi,fj,fk->fijk", s, s, s) + 2 * np.einsum("fai,faj,fak->fijk", v, v, v)
    each += mixed + mixed.transpose(0, 2, 1, 3) + mixed.transpose(0, 2, 3, 1)
    out = np.zeros((len(labels), 3, 3, 3))
    np.add.at(out, row, (volume / 120)[:, None, None, None] * each)
    return out
