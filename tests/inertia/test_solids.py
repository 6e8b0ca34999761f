"""Solids against sampling, against each other and against exact point masses."""

from __future__ import annotations

from itertools import pairwise, permutations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from steelyard.errors import BadValue
from steelyard.inertia import InertialParameters, solids
from steelyard.spatial import Pose, Rotation
from strategies import numbers, poses

SIZES = st.floats(0.01, 1.0)
DENSITY = 1200.0


def at(x: float, y: float, z: float) -> Pose:
    return Pose(Rotation.identity(), [x, y, z])


def same(a: InertialParameters, b: InertialParameters, tolerance: float = 1e-9) -> None:
    """Compare pseudo-inertias, each entry on the scale of its row and column."""
    root = np.sqrt(np.diag(b.pseudo_inertia))
    assert_allclose((a.pseudo_inertia - b.pseudo_inertia) / np.outer(root, root), 0, atol=tolerance)


def cone_wall(z: np.ndarray) -> np.ndarray:
    """Radius of cone(0.2, 0.5) at height z above its centroid."""
    return 0.2 * (1 - (z + 0.5 / 4) / 0.5)


SOLIDS = {
    "box": (
        solids.box(0.3, 0.2, 0.5, DENSITY),
        lambda x, y, z: (abs(x) < 0.15) & (abs(y) < 0.1) & (abs(z) < 0.25),
    ),
    "ellipsoid": (
        solids.ellipsoid(0.1, 0.2, 0.4, DENSITY),
        lambda x, y, z: (x / 0.1) ** 2 + (y / 0.2) ** 2 + (z / 0.4) ** 2 < 1,
    ),
    "sphere": (solids.sphere(0.3, DENSITY), lambda x, y, z: x * x + y * y + z * z < 0.09),
    "cylinder": (solids.cylinder(0.2, 0.6, DENSITY), lambda x, y, z: (np.hypot(x, y) < 0.2) & (abs(z) < 0.3)),
    "tube": (
        solids.tube(0.2, 0.15, 0.6, DENSITY),
        lambda x, y, z: (np.hypot(x, y) < 0.2) & (np.hypot(x, y) > 0.15) & (abs(z) < 0.3),
    ),
    "cone": (
        solids.cone(0.2, 0.5, DENSITY),
        lambda x, y, z: (z > -0.125) & (z < 0.375) & (np.hypot(x, y) < cone_wall(z)),
    ),
    "capsule": (
        solids.capsule(0.15, 0.4, DENSITY),
        lambda x, y, z: x * x + y * y + np.maximum(abs(z) - 0.2, 0) ** 2 < 0.15**2,
    ),
    "tetrahedron": (
        solids.tetrahedron(np.vstack([np.zeros(3), 0.8 * np.eye(3)]) - 0.4, DENSITY),
        lambda x, y, z: (x > -0.4) & (y > -0.4) & (z > -0.4) & (x + y + z < -0.4),
    ),
}


@pytest.mark.parametrize("name", SOLIDS)
def test_solid_against_sampling(name: str) -> None:
    solid, inside = SOLIDS[name]
    points = np.random.default_rng(1).uniform(-0.41, 0.41, (400_000, 3))
    kept = points[inside(*points.T)]
    masses = np.full(len(kept), DENSITY * 0.82**3 / len(points))
    same(InertialParameters.from_point_masses(masses, kept), solid, 0.03)


@pytest.mark.parametrize("name", SOLIDS)
def test_every_solid_is_consistent(name: str) -> None:
    assert SOLIDS[name][0].validity().consistent


@given(SIZES, SIZES, SIZES)
def test_a_box_is_six_tetrahedra(x: float, y: float, z: float) -> None:
    total = InertialParameters(np.zeros(10))
    for order in permutations(range(3)):  # one tetrahedron per monotone path between opposite corners
        corners = np.zeros((4, 3))
        for step, axis in enumerate(order):
            corners[step + 1 :, axis] = (x, y, z)[axis]
        total = total + solids.tetrahedron(corners - [x / 2, y / 2, z / 2], DENSITY)
    same(total, solids.box(x, y, z, DENSITY))


@given(SIZES, SIZES, SIZES)
def test_two_half_boxes_make_a_box(x: float, y: float, z: float) -> None:
    half = solids.box(x / 2, y, z, DENSITY)
    same(half.in_frame(at(x / 4, 0, 0)) + half.in_frame(at(-x / 4, 0, 0)), solids.box(x, y, z, DENSITY))


@given(numbers((4, 3)), poses())
def test_a_tetrahedron_is_four_vertices_and_its_centroid(noise: np.ndarray, pose: Pose) -> None:
    corners = np.vstack([np.zeros(3), np.eye(3)]) + 0.1 * noise
    body = solids.tetrahedron(corners, DENSITY)
    weights = float(body.mass) * np.array([1, 1, 1, 1, 16]) / 20  # exact to second order
    same(body, InertialParameters.from_point_masses(weights, np.vstack([corners, corners.mean(0)])))
    same(body.in_frame(pose), solids.tetrahedron(pose.apply(corners[[2, 0, 3, 1]]), DENSITY))


@given(SIZES, SIZES)
def test_a_ball_is_a_round_ellipsoid_and_a_capsule_of_no_length(r: float, length: float) -> None:
    same(solids.sphere(r, DENSITY), solids.ellipsoid(r, r, r, DENSITY))
    same(solids.capsule(r, 1e-12, DENSITY), solids.sphere(r, DENSITY))
    assert_allclose(
        solids.capsule(r, length, DENSITY).mass,
        solids.sphere(r, DENSITY).mass + solids.cylinder(r, length, DENSITY).mass,
    )


@given(SIZES, SIZES, st.floats(0.05, 0.95))
def test_a_tube_filled_with_its_core_is_a_cylinder(r: float, length: float, part: float) -> None:
    filled = solids.tube(r, part * r, length, DENSITY) + solids.cylinder(part * r, length, DENSITY)
    same(filled, solids.cylinder(r, length, DENSITY))


def stack_of_disks(radius, low: float, high: float) -> InertialParameters:
    """Thin disks of radius(z) between two heights, by the midpoint rule."""
    edges = np.linspace(low, high, 801)
    disks = [
        solids.cylinder(radius((a + b) / 2), b - a, DENSITY).in_frame(at(0, 0, (a + b) / 2)) for a, b in pairwise(edges)
    ]
    return InertialParameters(np.sum([d.vector for d in disks], axis=0))


def test_a_cone_and_a_capsule_are_stacks_of_disks() -> None:
    same(stack_of_disks(cone_wall, -0.125, 0.375), SOLIDS["cone"][0], 1e-4)
    wall = lambda z: np.sqrt(0.15**2 - max(abs(z) - 0.2, 0) ** 2)  # noqa: E731
    same(stack_of_disks(wall, -0.35, 0.35), SOLIDS["capsule"][0], 1e-4)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: solids.box(0.1, -0.2, 0.3, 1), "box edge y must be a finite number above zero; got -0.2."),
        (lambda: solids.sphere(0, 1), "semi-axis a must be a finite number above zero; got 0."),
        (lambda: solids.cylinder(1, 1, 0), "density must be a finite number above zero; got 0."),
        (lambda: solids.cylinder("wide", 1, 1), "radius must be a number; got 'wide'."),
        (lambda: solids.cone(1, float("nan"), 1), "height must be a finite number above zero; got nan."),
        (lambda: solids.capsule(1, 1, -5), "density must be a finite number above zero; got -5."),
        (lambda: solids.capsule(1, 0, 5), "length must be a finite number above zero; got 0."),
        (lambda: solids.tube(0.1, 0.2, 1, 1), "inner radius must be below the outer one; got 0.2 and 0.1 m."),
        (
            lambda: solids.tetrahedron(np.zeros((4, 3)), 1),
            "tetrahedron volume must be a finite number above zero; got 0.",
        ),
        (
            lambda: solids.tetrahedron(np.zeros((2, 4, 3)), 1),
            "vertices must have shape (4, 3); got (2, 4, 3).",
        ),
    ],
)
def test_bad_input_is_named(make, text: str) -> None:
    with pytest.raises(BadValue) as error:
        make()
    assert str(error.value) == text
