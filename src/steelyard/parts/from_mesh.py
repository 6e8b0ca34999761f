"""Parts from a mesh of closed surfaces."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array, Integers
from steelyard.parts.interior import Interior
from steelyard.parts.parts import Parts
from steelyard.shape.mesh import TriangleMesh
from steelyard.shape.nesting import Solids, solids_of


def parts_of_mesh(mesh: TriangleMesh, solids: Solids | None = None) -> Parts:
    """Return the homogeneous parts that the surfaces of a mesh enclose, in the mesh's frame.

    solids  those of the mesh, where they are known already

    A surface turned inside out is a void of the part around it and no part of its own. Colours are means over the
    area. Raises BadValue where a part is open, flat, or inside out on its own.
    """
    solids = solids_of(mesh) if solids is None else solids
    surfaces = tuple((int(k), *solids.void[solids.parent == k].tolist()) for k in solids.label)
    return Parts(solids.label, solids.moments, _mean_colours(mesh, solids.label), Interior(mesh, surfaces))


def _mean_colours(mesh: TriangleMesh, label: Integers) -> Array | None:
    """Return the mean colour (P, 3) 0..255 of the listed parts."""
    if mesh.rgb is None:
        return None
    area = mesh.areas()
    return np.stack([np.average(mesh.rgb[mesh.part == k], axis=0, weights=area[mesh.part == k]) for k in label])
