"""What an object stands on: a stand is named or found, its plane is used where it is given, a foot is no stand."""

from __future__ import annotations

import json
from dataclasses import replace

import manifold3d
import numpy as np
import pytest

from steelyard.errors import CannotAnswer
from steelyard.pipelines.shape_in_parts import Shape, shape_of
from steelyard.shape.mesh import TriangleMesh
from steelyard.shape.scan import Scan, fuse
from steelyard.shape.views import Intrinsics, TablePlane, Views
from steelyard.simulate.scanning import scan_mesh
from steelyard.spatial import Pose

SMALL = Intrinsics(320, 240, 307.5, 307.5, 160.0, 120.0)
EDGE = 0.045
RED, WHITE = (200, 40, 40), (230, 230, 225)


def block(x: float, y: float, z: float, over: float = 0.0) -> manifold3d.Manifold:
    return manifold3d.Manifold.cube((x, y, z)).translate((-x / 2, -y / 2, over))


def painted(*solids: tuple[manifold3d.Manifold, tuple[int, int, int]]) -> TriangleMesh:
    made = [(solid.to_mesh64(), rgb) for solid, rgb in solids]
    first = np.cumsum([0] + [len(mesh.vert_properties) for mesh, _ in made])
    triangles = np.concatenate([mesh.tri_verts + n for (mesh, _), n in zip(made, first[:-1], strict=True)])
    return TriangleMesh(
        np.concatenate([mesh.vert_properties[:, :3] for mesh, _ in made]),
        triangles,
        np.zeros(len(triangles)),
        np.concatenate([np.tile(np.array(rgb, np.uint8), (len(mesh.tri_verts), 1)) for mesh, rgb in made]),
    )


def seen(mesh: TriangleMesh, high: float, distance: float = 0.35) -> Views:
    """Return views that are aimed at what stands `high` up."""
    choices = {"count": 36, "intrinsics": SMALL, "X_WO": Pose.identity(), "distance": distance}
    return scan_mesh(mesh, 1, aim=(0, 0, high + EDGE / 2), **choices).views  # type: ignore[arg-type]


def on_stand(x: float, y: float, high: float) -> Views:
    return seen(painted((block(EDGE, EDGE, EDGE, high), RED), (block(x, y, high), WHITE)), high)


def said(shape: Shape) -> list[str]:
    return [finding.code for finding in shape.findings]


@pytest.mark.parametrize(("x", "y", "high"), [(0.15, 0.21, 0.025), (0.14, 0.14, 0.08), (0.08, 0.08, 0.05)])
def test_a_stand_whose_plane_is_given_is_no_part_of_the_object(x: float, y: float, high: float) -> None:
    """Also where it is low, so that the table under it shows, and where it is small."""
    given = replace(on_stand(x, y, high), table=TablePlane(np.array([0, 0, 1.0]), high))
    shape = shape_of(given)
    assert shape.solid.mesh.volume == pytest.approx(EDGE**3, rel=0.05)
    assert isinstance(shape.scan, Scan)
    assert shape.scan.table.offset == pytest.approx(high, abs=5e-4)
    assert "table-in-cloud" not in said(shape)


def test_what_may_be_a_stand_is_named_with_its_plane_and_the_bar_holds_it() -> None:
    views = on_stand(0.15, 0.21, 0.025)
    shape = shape_of(views)
    (named,) = (finding for finding in shape.findings if finding.code == "table-in-cloud")
    volume = shape.solid.mesh.volume
    assert volume > 5 * EDGE**3
    assert volume * (1 - 2 * shape.solid.volume_std) < EDGE**3
    plane = json.loads(named.remedy[named.remedy.index("{") :])
    put = replace(views, table=TablePlane(np.array(plane["normal"]), plane["offset_m"]))
    assert shape_of(put).solid.mesh.volume == pytest.approx(EDGE**3, rel=0.05)


@pytest.mark.parametrize(("rgb", "named"), [(RED, True), (WHITE, False)])
def test_a_stand_that_is_largely_covered_is_told_by_its_colour(rgb: tuple[int, int, int], named: bool) -> None:
    """Its bare face is not six times what stands on it: of one colour they may be one body."""
    views = seen(painted((block(0.06, 0.05, 0.05, 0.03), rgb), (block(0.13, 0.15, 0.03), WHITE)), 0.03)
    assert ("table-in-cloud" in {finding.code for finding in fuse(views).findings}) == named
    assert "table-in-cloud" not in {finding.code for finding in fuse(replace(views, rgb=None)).findings}


@pytest.mark.parametrize(("x", "y", "high"), [(0.30, 0.26, 0.025), (0.40, 0.30, 0.018)])
def test_a_stand_that_fills_the_views_is_the_table(x: float, y: float, high: float) -> None:
    """Where it is low, the table under it shows in some views."""
    shape = shape_of(on_stand(x, y, high))
    assert shape.solid.mesh.volume == pytest.approx(EDGE**3, rel=0.05)
    assert isinstance(shape.scan, Scan)
    assert shape.scan.table.offset == pytest.approx(high, abs=1e-3)


@pytest.mark.parametrize("high", [0.025, 0.06])
def test_the_plane_of_a_table_hidden_under_a_stand_is_said_to_be_the_wrong_one(high: float) -> None:
    views = on_stand(0.40, 0.30, high)
    with pytest.raises(CannotAnswer, match="Give the plane that the object itself stands on"):
        fuse(replace(views, table=TablePlane(np.array([0, 0, 1.0]), 0.0)))


@pytest.mark.parametrize(
    "mesh",
    [
        painted((block(0.03, 0.10, 0.03), WHITE), (block(0.02, 0.02, 0.15, 0.03), RED)),  # a hammer on its head
        painted((block(0.10, 0.10, 0.008), WHITE), (block(0.02, 0.02, 0.07, 0.008), RED)),  # a base plate with a post
        painted((block(0.15, 0.12, 0.006) + block(0.15, 0.006, 0.08), WHITE)),  # a bracket
        painted((block(0.11, 0.07, 0.15), WHITE), (block(0.03, 0.03, 0.02, 0.15), RED)),  # a canister with a cap
        painted((block(0.08, 0.08, 0.06), WHITE), (block(0.03, 0.03, 0.025, 0.06), RED)),  # a switch in its box
        painted((block(0.14, 0.14, 0.10), WHITE), (block(0.03, 0.03, 0.01, 0.10), RED)),  # a box with a button
    ],
    ids=["hammer", "post", "bracket", "canister", "switch", "button"],
)
def test_a_foot_or_a_body_of_its_own_is_no_stand(mesh: TriangleMesh) -> None:
    low, high = mesh.bounds
    shape = shape_of(seen(mesh, 0.3 * high[2], float(np.linalg.norm(high - low)) + 0.15))
    assert "table-in-cloud" not in said(shape)
