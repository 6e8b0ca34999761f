"""Points of dense noisy clouds brought to the surface that they share, and solids of clouds that are hard to read."""

import numpy as np
import pytest

from steelyard.shape.cloud import Cloud
from steelyard.shape.points.noisy_points import settled
from steelyard.shape.solid import Solid
from steelyard.shape.volume import enclose
from steelyard.workshop.sampling import spread_evenly
from steelyard.workshop.sheets import sheet_of, sheets
from steelyard.workshop.solids import block

RADIUS = 0.04
BALL_M3 = 4 / 3 * np.pi * RADIUS**3


def ball(points: int, noise: float, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Return points on a ball with noise [m], and their true normals."""
    rng = np.random.default_rng(seed)
    out = rng.standard_normal((points, 3))
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    return RADIUS * out + noise * rng.standard_normal((points, 3)), out


def plates(gap: float, noise: float, points: int = 40_000) -> np.ndarray:
    """Return points on two square plates 100 mm wide, `gap` apart, with noise [m]."""
    rng = np.random.default_rng(1)
    xyz = np.column_stack([rng.uniform(-0.05, 0.05, (points, 2)), gap * rng.integers(0, 2, points)])
    return xyz + noise * rng.standard_normal(xyz.shape)


def codes(solid: Solid) -> set[str]:
    return {finding.code for finding in solid.findings}


def test_noise_is_told_and_averaged_out_without_shrinking_what_is_round() -> None:
    xyz, _ = ball(48_000, 5e-4)
    found = settled(xyz, None, np.arange(4000), 2.2e-3)
    assert found is not None
    assert found.noise == pytest.approx(5e-4, rel=0.2)
    height = np.linalg.norm(found.xyz, axis=1) - RADIUS
    assert height.std() < 0.5 * 5e-4
    # A plain mean over this reach would put the points 0.05 mm too low.
    assert abs(height.mean()) < 0.02e-3


def test_calm_points_stay() -> None:
    xyz, _ = ball(48_000, 2e-5)
    assert settled(xyz, None, np.arange(4000), 2.2e-3) is None


@pytest.mark.parametrize("gap", [2e-3, 4e-3])
def test_two_sheets_stay_two(gap: float) -> None:
    noise = 3e-4
    xyz = plates(gap, noise)
    inner = np.flatnonzero(np.abs(xyz[:, :2]).max(1) < 0.04)
    found = settled(xyz, None, inner, 2e-3)
    assert found is not None
    side = gap * (xyz[inner, 2] > gap / 2)
    assert np.sqrt(np.mean((found.xyz[:, 2] - side) ** 2)) < 0.75 * noise


def test_normals_keep_sheets_apart_that_noise_would_join() -> None:
    noise, gap = 5e-4, 1.2e-3
    rng = np.random.default_rng(2)
    count = 40_000
    top = rng.integers(0, 2, count)
    xyz = np.column_stack([rng.uniform(-0.05, 0.05, (count, 2)), gap * top])
    xyz += noise * rng.standard_normal(xyz.shape)
    normals = np.column_stack([np.zeros((count, 2)), 2.0 * top - 1])
    inner = np.flatnonzero(np.abs(xyz[:, :2]).max(1) < 0.04)
    found = settled(xyz, normals, inner, 2e-3)
    assert found is not None
    assert np.sqrt(np.mean((found.xyz[:, 2] - gap * top[inner]) ** 2)) < 0.5 * noise


@pytest.mark.parametrize("noise", [0.5e-3, 1e-3])
@pytest.mark.parametrize("known", [False, True], ids=["points", "normals"])
def test_a_dense_noisy_cloud_gives_its_volume(noise: float, known: bool) -> None:
    xyz, out = ball(60_000, noise)
    solid = enclose(Cloud(xyz, normals=out if known else None))
    assert solid.mesh.volume == pytest.approx(BALL_M3, rel=0.02)
    assert codes(solid) == {"cloud-thinned", "cloud-noisy"}
    (found,) = (f for f in solid.findings if f.code == "cloud-noisy")
    told = float(found.message.split("about ")[1].split(" mm")[0])
    assert told == pytest.approx(1e3 * noise, rel=0.25)


@pytest.mark.parametrize(("points", "noise"), [(4000, 8e-4), (20_000, 1e-3), (48_000, 7e-4)])
def test_a_thick_body_in_noise_is_told_by_fewer_points_without_doubt(points: int, noise: float) -> None:
    xyz, _ = ball(points, noise)
    solid = enclose(Cloud(xyz))
    assert solid.mesh.volume == pytest.approx(BALL_M3, rel=0.03)  # half of it as they are given
    assert "cloud-noisy" in codes(solid)
    assert "thin-thickened" not in codes(solid)
    assert solid.volume_std < 0.05


def test_walls_as_thin_as_the_noise_are_never_silent() -> None:
    plate = next(one for one in sheets(12, seed=3, points=200) if one.name.startswith("plate"))
    xyz = spread_evenly(plate.mesh, np.random.default_rng(5), 40_000)[0]
    xyz = xyz + 6e-4 * np.random.default_rng(6).standard_normal(xyz.shape)
    solid = enclose(Cloud(xyz))
    assert {"thin-thickened", "surface-open"} & codes(solid)


@pytest.mark.parametrize("wrong", [0.1, 0.2, 0.5])
def test_normals_whose_signs_are_by_chance_are_found_anew(wrong: float) -> None:
    xyz, out = ball(4000, 1e-4)
    sign = np.where(np.random.default_rng(3).random(len(xyz)) < wrong, -1.0, 1.0)
    solid = enclose(Cloud(xyz, normals=out * sign[:, None]))
    assert solid.mesh.volume == pytest.approx(BALL_M3, rel=0.02)
    assert codes(solid) == {"normals-flipped"}


def noisy_channel(points: int, noise: float, seed: int) -> tuple[Solid, float]:
    """Return the solid of a square channel with walls of 2 mm, and its true volume."""
    body = block((0, 100), (0, 15), (0, 15)) - block((-1, 101), (2, 13), (2, 16))
    made = sheet_of("channel", body, np.random.default_rng(seed), points)
    moved = made.cloud.xyz + noise * np.random.default_rng(seed).standard_normal((points, 3))
    return enclose(Cloud(moved)), made.volume


def test_points_as_given_stay_away_where_their_solid_is_in_more_doubt() -> None:
    """Neither is clear: as given, they fill a part of the channel."""
    solid, true = noisy_channel(8000, 6e-4, 0)
    assert solid.mesh.volume == pytest.approx(true, rel=0.1)
    assert "cloud-noisy" in codes(solid)


def test_doubt_about_settled_points_and_about_those_given_is_said_once() -> None:
    solid, _ = noisy_channel(1500, 1e-3, 1)
    assert [finding.code for finding in solid.findings] == ["cloud-noisy", "thin-thickened"]
