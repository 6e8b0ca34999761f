"""The volume of a solid in the cells of another mesher: fTetWild or TetGen, where they are installed.

Both run in a process of their own: TetGen ends the process where a surface crosses itself, and its library is under the
AGPL, so that nothing of it is ever loaded into this one. fTetWild is slow, and not the same from run to run.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from steelyard.errors import BadValue, CannotAnswer, MissingDependency
from steelyard.shape.tets import TetMesh

# Mesher -> (package, extra that installs it).
MESHERS = {"ftetwild": ("pytetwild", "tetwild"), "tetgen": ("tetgen", "tetgen")}
PATIENCE_S = 300.0
# A mesher keeps the volume to its envelope, a thousandth of the size; more is another solid.
_SAME_VOLUME = 0.1


def in_cells_of(mesher: str, mesh: TetMesh, *, patience_s: float = PATIENCE_S) -> TetMesh:
    """Return the same volume as `mesh`, filled anew from its boundary.

    mesher  "ftetwild" (MPL-2.0, robust, seconds) or "tetgen" (AGPL-3.0, fast, boundary kept, radius-edge ratio 10
            as in the paper)

    Source: "The Sum of Its Parts", section IV-A (TetGen); fTetWild, Hu et al. 2020.
    Raises MissingDependency, BadValue for an unknown mesher, CannotAnswer where the mesher fails.
    """
    if mesher not in MESHERS:
        raise BadValue(f"mesher must be one of {', '.join(MESHERS)}; got {mesher!r}.")
    package, extra = MESHERS[mesher]
    if find_spec(package) is None:
        raise MissingDependency.of(package, extra, f"Cells by {mesher}")
    with tempfile.TemporaryDirectory() as scratch:
        given, made = Path(scratch) / "surface.npz", Path(scratch) / "cells.npz"
        corners, triangles = np.unique(mesh.surface, return_inverse=True)
        np.savez(given, vertices=mesh.vertices[corners], triangles=triangles.reshape(-1, 3).astype(np.int32))
        _run(mesher, given, made, patience_s)
        with np.load(made, allow_pickle=False) as arrays:
            filled = _facing_out(arrays["vertices"], arrays["tets"].astype(np.int64))
    off = filled.volume / mesh.volume - 1
    if abs(off) > _SAME_VOLUME:
        raise CannotAnswer(
            f"{mesher} filled {1 + off:.2f} times the volume that was given: it could not follow the surface. "
            "Use the default cells."
        )
    return filled


def _run(mesher: str, given: Path, made: Path, patience_s: float) -> None:
    """Run the mesher to its end; raises CannotAnswer where it fails, crashes or takes too long.

    It runs in the scratch folder, since fTetWild leaves files where it stands.
    """
    command = [sys.executable, "-m", "steelyard.io.shapes.mesher", mesher, str(given), str(made)]
    try:
        done = subprocess.run(command, cwd=made.parent, capture_output=True, text=True, timeout=patience_s, check=False)
    except subprocess.TimeoutExpired:
        raise CannotAnswer(f"{mesher} was stopped after {patience_s:g} s. Use the default cells.") from None
    if done.returncode:
        said = done.stderr.strip().splitlines()
        why = said[-1] if done.returncode > 0 and said else "it crashed, as on surfaces that cross themselves"
        raise CannotAnswer(f"{mesher} failed ({why}). Use the default cells.")


def _facing_out(vertices: np.ndarray, tets: np.ndarray) -> TetMesh:
    """Return the cells with positive volume, each turned the right way, vertices without a cell left out."""
    a, b, c, d = (vertices[tets[:, k]] for k in range(4))
    six = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a)
    tets = np.where((six < 0)[:, None], tets[:, [1, 0, 2, 3]], tets)[six != 0]
    used, cells = np.unique(tets, return_inverse=True)
    return TetMesh(vertices[used], cells.reshape(-1, 4))
