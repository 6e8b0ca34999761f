"""Other meshers' cells: the volume is kept, and whatever goes wrong in their process is one clear error in ours."""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import Delaunay

from steelyard.errors import BadValue, CannotAnswer, MissingDependency
from steelyard.io.shapes import foreign_cells
from steelyard.io.shapes.foreign_cells import MESHERS, in_cells_of
from steelyard.shape.tets import TetMesh

# A mesher for the test: Delaunay cells of a convex surface, one turned inside out, one point left unused.
CONVEX = """
import numpy as np
from scipy.spatial import Delaunay

class TetGen:
    def __init__(self, vertices, triangles):
        self.vertices = vertices

    def tetrahedralize(self, **options):
        tets = Delaunay(self.vertices).simplices
        tets[0] = tets[0][[1, 0, 2, 3]]
        return np.vstack([self.vertices * SCALE, [[9, 9, 9]]]), tets
"""


@pytest.fixture
def ball() -> TetMesh:
    points = np.random.default_rng(0).normal(size=(60, 3))
    points *= 0.05 / np.linalg.norm(points, axis=1, keepdims=True)
    points = np.vstack([points, np.zeros(3)])
    return TetMesh(points, Delaunay(points).simplices)


@pytest.fixture
def fake(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A place for a package `tetgen` that both processes find first."""
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.delitem(sys.modules, "tetgen", raising=False)
    return tmp_path / "tetgen.py"


def test_the_volume_is_kept_and_cells_face_the_right_way(ball: TetMesh, fake: Path) -> None:
    fake.write_text(CONVEX.replace("SCALE", "1"))
    filled = in_cells_of("tetgen", ball)
    assert filled.volume == pytest.approx(ball.volume, rel=1e-12)
    assert len(filled.vertices) == 60  # the centre was inside, and the stray point has no cell
    assert (filled.volumes > 0).all()


def test_another_volume_is_refused(ball: TetMesh, fake: Path) -> None:
    fake.write_text(CONVEX.replace("SCALE", "1.1"))
    with pytest.raises(CannotAnswer, match=r"tetgen filled 1\.33 times the volume"):
        in_cells_of("tetgen", ball)


@pytest.mark.parametrize(
    ("source", "said"),
    [
        ("import os; os.abort()", "it crashed, as on surfaces that cross themselves"),
        ("raise RuntimeError('no facets')", "RuntimeError: no facets"),
        ("import time; time.sleep(60)", "was stopped after 2 s"),
    ],
)
def test_what_fails_there_is_an_error_here(ball: TetMesh, fake: Path, source: str, said: str) -> None:
    fake.write_text(source)
    with pytest.raises(CannotAnswer, match=said):
        in_cells_of("tetgen", ball, patience_s=2 if "sleep" in source else 60)


def test_a_mesher_that_is_not_there(ball: TetMesh, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(foreign_cells, "find_spec", lambda name: None)
    with pytest.raises(MissingDependency, match=r"pip install 'steelyard\[tetwild\]'"):
        in_cells_of("ftetwild", ball)
    with pytest.raises(BadValue, match="mesher must be one of ftetwild, tetgen; got 'gmsh'"):
        in_cells_of("gmsh", ball)


@pytest.mark.parametrize("mesher", MESHERS)
def test_the_real_mesher(ball: TetMesh, mesher: str) -> None:
    if find_spec(MESHERS[mesher][0]) is None:
        pytest.skip(f"{MESHERS[mesher][0]} is not installed")
    assert in_cells_of(mesher, ball).volume == pytest.approx(ball.volume, rel=0.02)
