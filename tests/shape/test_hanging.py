"""Undersides that hang over the table: what was closed though nobody saw it is in the bar, of rods it is not.

So is what is left open below thin rods.
"""

from __future__ import annotations

import manifold3d
import numpy as np
import pytest

from steelyard.pipelines.shape_in_parts import Shape, kept, shape_of
from steelyard.shape.mesh import TriangleMesh
from steelyard.shape.scan import fuse
from steelyard.simulate.scanning import scan_mesh
from steelyard.spatial import Pose

LIES = Pose.identity()
Solid = manifold3d.Manifold


def block(x: tuple[float, float], y: tuple[float, float], z: tuple[float, float]) -> Solid:
    low, high = np.array([x, y, z], float).T
    return Solid.cube(high - low).translate(low)


def rod(length: float, radius: float) -> Solid:
    return Solid.cylinder(length, radius, -1, 48).rotate((0, 90, 0)).translate((0, 0, radius))


KNIFE = block((-110, 0), (-12, 12), (0, 14)) + block((0, 170), (-16, 16), (5, 7.5))
SHELF = block((-100, 100), (-60, 60), (10, 16)) + Solid.batch_boolean(
    [block((x - 5, x + 5), (y - 5, y + 5), (0, 10)) for x in (-90, 90) for y in (-50, 50)], manifold3d.OpType.Add
)
# Thicker than it is high over the table, as a rod is, but sheer.
CAR = (
    block((-60, 60), (-22, 22), (10, 30)) + block((-50, -30), (-20, 20), (0, 20)) + block((30, 50), (-20, 20), (0, 20))
)
HAMMER = rod(220, 11).translate((-220, 0, 0)) + rod(90, 13).rotate((0, 0, 90)).translate((10, -45, 0))
CUP = Solid.cylinder(80, 30, 38, 48) - Solid.cylinder(80, 26, 34, 48).translate((0, 0, 5))
SOUND = {
    "rod": rod(180, 12), "hammer": HAMMER, "ball": Solid.sphere(30, 64).translate((0, 0, 30)), "cup": CUP,
    "box": block((-50, 50), (-30, 30), (0, 30)),
}  # fmt: skip
# Its underside lies nearer to the table than the depth noise tells.
HEX_KEY = rod(120, 3) + rod(50, 3).rotate((0, 0, 90)).translate((117, 0, 0))
HANGING = {"knife": KNIFE, "shelf": SHELF, "car": CAR}


def mesh_of(solid: Solid) -> tuple[TriangleMesh, float]:
    """Return a body that was built in millimetres, and its volume [m^3]."""
    made = solid.scale((1e-3,) * 3)
    mesh = made.to_mesh64()
    count = len(mesh.tri_verts)
    red = np.tile(np.array([200, 40, 40], np.uint8), (count, 1))
    return TriangleMesh(mesh.vert_properties[:, :3], mesh.tri_verts, np.zeros(count), red), made.volume()


def shape_and_volume(solid: Solid, count: int) -> tuple[Shape, float]:
    mesh, volume = mesh_of(solid)
    return shape_of(fuse(scan_mesh(mesh, 1, count=count, X_WO=LIES).views)), volume


@pytest.mark.parametrize("name", HANGING)
def test_space_that_was_closed_under_an_overhang_is_in_the_bar_and_named(name: str) -> None:
    shape, volume = shape_and_volume(HANGING[name], 24)
    solid = shape.solid
    share = 1 - volume / solid.mesh.volume
    assert share > 0.1  # else nothing is wrong with it
    assert share < 2.5 * solid.volume_std
    said = [f.message for f in shape.findings if f.code == "surface-open"]
    assert any("hang over the table" in message for message in said)


@pytest.mark.parametrize("name", SOUND)
def test_what_lies_on_the_table_is_as_sure_as_it_was(name: str) -> None:
    shape, volume = shape_and_volume(SOUND[name], 24)
    scan = shape.scan
    assert shape.solid.mesh.volume == pytest.approx(volume, rel=0.1)
    assert scan is not None
    assert scan.space.unsure_m3 < 0.03 * volume
    assert not any("hang over" in f.message for f in shape.findings)


def test_how_a_thin_rod_goes_on_below_is_in_the_bar() -> None:
    shape, volume = shape_and_volume(HEX_KEY, 24)
    scan = shape.scan
    assert scan is not None
    assert scan.space.unsure_m3 > 0.05 * volume
    assert shape.solid.mesh.volume == pytest.approx(volume, rel=2 * shape.solid.volume_std)


def test_a_written_cloud_keeps_what_hangs() -> None:
    scan = fuse(scan_mesh(mesh_of(KNIFE)[0], 1, count=24, X_WO=LIES).views)
    there = kept(scan).kept
    assert there is not None
    assert there.space.unsure_m3 == scan.space.unsure_m3 > 0
    assert "surface-open" in {f.code for f in there.findings}
