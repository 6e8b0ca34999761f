"""Walls thinner than their points are apart: told by their two layers, and not filled."""

from __future__ import annotations

import numpy as np
import pytest

from steelyard.shape.cloud import Cloud
from steelyard.shape.sides.layers import Layers
from steelyard.shape.volume import enclose
from steelyard.workshop.sheets import Sheet, sheet_of
from steelyard.workshop.solids import ball, block, ring, rod, threaded, union


def cup(across: float, height: float, wall: float) -> object:
    return ring(across / 2, across / 2 - wall, 0, height) + rod(across / 2, 0, wall)


def sheet(body: object, points: int = 2000) -> Sheet:
    return sheet_of("a body", body, np.random.default_rng(0), points)


def layers(xyz: np.ndarray) -> Layers | None:
    return Layers.of(xyz, Cloud(xyz).near.index)


@pytest.mark.parametrize("noise_mm", [0.0, 0.1])
@pytest.mark.parametrize(
    "body",
    [ring(21, 20, 0, 169), ring(40, 38.6, 0, 200), ring(10.5, 9.6, 0, 200), cup(84, 120, 1.3), cup(70, 80, 0.9)],
    ids=["tube", "wide tube", "narrow tube", "cup", "thin cup"],
)
def test_thin_cups_and_tubes_are_not_filled(body: object, noise_mm: float) -> None:
    # 3.6 to 16 times the volume where both faces of a wall were told alike, half of them without a word.
    made = sheet(body)
    noise = 1e-3 * noise_mm * np.random.default_rng(1).standard_normal(made.cloud.xyz.shape)
    solid = enclose(Cloud(made.cloud.xyz + noise))
    ratio = solid.mesh.volume / made.volume
    assert 0.65 < ratio < 1.1
    assert abs(ratio - 1) < 0.15 or "thin-thickened" in {finding.code for finding in solid.findings}
    assert abs(1 - 1 / ratio) < 2.5 * solid.volume_std


@pytest.mark.parametrize(
    ("body", "noise_mm"), [(ring(24, 22.8, 0, 180), 0.25), (cup(70, 90, 1.0), 0.2)], ids=["tube", "cup"]
)
def test_walls_that_noise_blurs_are_not_filled(body: object, noise_mm: float) -> None:
    # 9.7 times the volume without a word and 14 times it at a bar of 16 %: no single point showed two layers.
    made = sheet(body)
    noise = 1e-3 * noise_mm * np.random.default_rng(1).standard_normal(made.cloud.xyz.shape)
    solid = enclose(Cloud(made.cloud.xyz + noise))
    assert 0.65 < solid.mesh.volume / made.volume < 1.1
    assert "thin-thickened" in {finding.code for finding in solid.findings}


@pytest.mark.parametrize("wall", [0.8, 1.0])
def test_a_thin_blade_costs_no_more_than_it_holds(wall: float) -> None:
    # The blade is a twentieth of all: half of the whole volume had been in doubt for it.
    made = sheet(block((0, 80), (-20, 20), (-wall / 2, wall / 2)) + block((-100, 0), (-12, 12), (-10, 10)))
    solid = enclose(made.cloud)
    assert "thin-thickened" in {finding.code for finding in solid.findings}
    assert abs(solid.mesh.volume / made.volume - 1) < 2 * solid.volume_std < 0.2


@pytest.mark.parametrize("noise_mm", [0.0, 0.1])
def test_a_thin_blade_of_a_thick_tool_has_its_sides(noise_mm: float) -> None:
    # A fifth of the points are the blade's. Nearly half of their normals looked inward, and it came in pieces.
    blade = block((0, 280), (-6, 6), (-0.35, 0.35))
    made = sheet(
        blade
        + block((-8, 2), (-8, 90), (-4, 4))
        + block((278, 288), (-8, 90), (-4, 4))
        + block((-8, 288), (80, 90), (-5, 5))
        + rod(14, 0, 110).rotate([90, 0, 0]).translate([-20, 40, 0])
    )
    noise = 1e-3 * noise_mm * np.random.default_rng(1).standard_normal(made.cloud.xyz.shape)
    solid = enclose(Cloud(made.cloud.xyz + noise))
    xyz, normals = 1e3 * made.cloud.xyz, np.asarray(solid.cloud.normals)
    on = (np.abs(xyz[:, 2]) > 0.34) & (np.abs(xyz[:, 2]) < 0.36) & (xyz[:, 0] > 5) & (xyz[:, 0] < 275)
    assert 300 < on.sum() < 500
    assert (normals[on, 2] * np.sign(xyz[on, 2]) < 0).mean() < 0.2
    assert "thin-thickened" in {finding.code for finding in solid.findings}
    assert abs(solid.mesh.volume / made.volume - 1) < 2 * solid.volume_std < 0.2


def test_grooves_of_a_file_are_no_walls() -> None:
    # Tops and grounds of teeth between points that are farther apart are two layers as well, and look the same way.
    teeth = [block((1.6 * k, 1.6 * k + 0.8), (-11, 11), (2, 2.5)) for k in range(75)]
    made = sheet(union([block((0, 120), (-11, 11), (-2, 2)), *teeth]))
    xyz, near = made.cloud.xyz, made.cloud.near
    found = Layers.of(xyz, near.index, near.spacing)
    assert found is not None
    assert found.part
    solid = enclose(made.cloud)
    assert solid.mesh.volume / made.volume == pytest.approx(0.987, abs=0.005)
    upward = (xyz[:, 2] > 1.99e-3) & (np.asarray(solid.cloud.normals)[:, 2] > 0)
    assert upward.sum() > 0.97 * (xyz[:, 2] > 1.99e-3).sum()
    assert "thin-thickened" not in {finding.code for finding in solid.findings}


def test_layers_are_those_of_the_wall() -> None:
    wall = 0.9
    made = sheet(block((0, 120), (0, 80), (0, wall)))
    xyz = made.cloud.xyz
    found = layers(xyz)
    assert found is not None
    assert found.thickness == pytest.approx(1e-3 * wall, rel=0.1)
    upper = xyz[:, 2] > 0.5e-3 * wall
    near = Cloud(xyz).near.index[:, : found.same.shape[1]]
    truly = upper[near] == upper[:, None]
    assert (found.same == truly)[found.two].mean() > 0.95
    assert (np.abs(found.plane[found.two, 2]) > 0.99).mean() > 0.95


@pytest.mark.parametrize("noise_mm", [0.0, 0.3])
@pytest.mark.parametrize(
    "body",
    [ball((0, 0, 0), 40), block((0, 60), (0, 40), (0, 30)), threaded(16, 0, 114, 4.3, 2.9), ring(20, 12, 0, 60)],
    ids=["ball", "brick", "thread", "thick tube"],
)
def test_thick_bodies_have_no_layers(body: object, noise_mm: float) -> None:
    xyz = sheet(body).cloud.xyz
    assert layers(xyz + 1e-3 * noise_mm * np.random.default_rng(1).standard_normal(xyz.shape)) is None


def test_few_points_have_no_layers() -> None:
    assert layers(np.random.default_rng(0).standard_normal((15, 3))) is None
