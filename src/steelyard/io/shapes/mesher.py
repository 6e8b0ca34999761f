"""The process that fTetWild or TetGen runs in: `python -m steelyard.io.shapes.mesher NAME SURFACE.npz CELLS.npz`."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

RADIUS_EDGE = 10.0  # as in the paper


def _ftetwild(vertices: Any, triangles: Any) -> tuple[Any, Any]:
    import pytetwild

    cells: tuple[Any, Any] = pytetwild.tetrahedralize(vertices, triangles, num_threads=1)
    return cells


def _tetgen(vertices: Any, triangles: Any) -> tuple[Any, Any]:
    import tetgen

    # Without new points on the surface: recovering facets that touch at an edge fails otherwise.
    made = tetgen.TetGen(vertices, triangles).tetrahedralize(order=1, minratio=RADIUS_EDGE, nobisect=True, quiet=True)
    return made[0], made[1]


if __name__ == "__main__":
    mesher, given, made = sys.argv[1:]
    with np.load(given, allow_pickle=False) as arrays:
        surface = arrays["vertices"], arrays["triangles"]
    points, tets = {"ftetwild": _ftetwild, "tetgen": _tetgen}[mesher](*surface)
    np.savez(made, vertices=points, tets=tets)
