"""Noise of points whose normals are known: seen, said and averaged out, however clear their solid looks."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from steelyard.shape.cloud import Cloud
from steelyard.shape.points.known_sides import settled_along
from steelyard.shape.volume import enclose

RADIUS = 0.035
BOX = np.array([0.12, 0.03, 0.03])


def ball(points: int) -> tuple[np.ndarray, np.ndarray]:
    """Return points on a ball and their normals, at random."""
    out = np.random.default_rng(1).standard_normal((points, 3))
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    return RADIUS * out, out


def box(points: int) -> tuple[np.ndarray, np.ndarray]:
    """Return points on a box and their normals, at random."""
    rng = np.random.default_rng(2)
    area = np.prod(BOX) / BOX
    axis = rng.choice(3, points, p=area / area.sum())
    side = rng.choice([-1.0, 1.0], points)
    xyz, out, rows = rng.uniform(-0.5, 0.5, (points, 3)) * BOX, np.zeros((points, 3)), np.arange(points)
    xyz[rows, axis], out[rows, axis] = 0.5 * side * BOX[axis], side
    return xyz, out


BODIES = {"ball": (ball, 4 / 3 * np.pi * RADIUS**3), "box": (box, float(np.prod(BOX)))}


def noisy(body: str, points: int, noise: float) -> Cloud:
    xyz, out = BODIES[body][0](points)
    return Cloud(xyz + noise * np.random.default_rng(3).standard_normal(xyz.shape), normals=out)


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("points", [4000, 20_000])
@pytest.mark.parametrize("noise", [1e-3, 3e-3])
def test_noise_beside_true_normals_is_said_and_put_right(body: str, points: int, noise: float) -> None:
    solid = enclose(noisy(body, points, noise))
    (found,) = (f for f in solid.findings if f.code == "cloud-noisy")
    assert float(found.message.split("about ")[1].split(" mm")[0]) == pytest.approx(1e3 * noise, rel=0.25)
    off = solid.mesh.volume / BODIES[body][1] - 1
    assert abs(off) < 0.04
    assert abs(off) < 2 * solid.volume_std < 0.15


def test_more_noise_is_a_wider_bar() -> None:
    stds = [enclose(noisy("box", 4000, noise)).volume_std for noise in (0.0, 1e-3, 3e-3)]
    assert stds == sorted(stds)
    assert stds[2] > 1.5 * stds[0]


def test_points_without_noise_stay_as_they_are() -> None:
    for body in BODIES:
        cloud = noisy(body, 4000, 0.0)
        assert np.array_equal(enclose(cloud).cloud.xyz, cloud.xyz)


def test_normals_fitted_to_neighbours_feign_no_noise() -> None:
    xyz, out = box(4000)
    near = xyz[cKDTree(xyz).query(xyz, 30)[1]]
    near -= near.mean(1, keepdims=True)
    fitted = np.linalg.eigh(np.einsum("nki,nkj->nij", near, near))[1][..., 0]
    fitted *= np.sign((fitted * out).sum(1))[:, None]
    assert settled_along(xyz, fitted, np.arange(4000), Cloud(xyz).near.spacing) is None


def test_points_past_an_edge_are_left_out_and_all_others_reach_their_face() -> None:
    cloud, noise = noisy("box", 20_000, 2e-3), 2e-3
    found = settled_along(cloud.xyz, np.asarray(cloud.normals), np.arange(20_000), 1.6e-3)
    assert found is not None
    assert found.noise == pytest.approx(noise, rel=0.1)
    over = np.abs(found.xyz) - BOX / 2
    across = (over * np.abs(np.asarray(cloud.normals)[found.rows])).sum(1)
    assert np.sqrt(np.mean(across**2)) < 0.4 * noise
    assert (over.max(1) > noise).mean() < 0.01  # a tenth of them as they were given
    assert len(found.rows) > 0.8 * 20_000
