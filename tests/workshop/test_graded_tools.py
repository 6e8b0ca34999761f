"""Graded tools: exact moments of uneven densities against Monte Carlo, layers and closed forms; folders that say so."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from steelyard.check import Array
from steelyard.cli.workshop import workshop
from steelyard.errors import BadValue
from steelyard.inertia import InertialParameters
from steelyard.io.object_folders import object_folders, read_object
from steelyard.shape.mesh import TriangleMesh, part_moments
from steelyard.shape.third_moments import third_moments
from steelyard.workshop.catalogue import FAMILIES, build, build_graded
from steelyard.workshop.graded import GRADED
from steelyard.workshop.grading import Fall, Grading, Layer, graded, gradient_of, layer_moments, linear_moments


def surface(name: str, part: str) -> TriangleMesh:
    made = build(name)
    return made.mesh.of_part(made.part_names.index(part))


def winding(corners: Array, points: Array) -> Array:
    """Winding number (N,) of a surface around points (N, 3)."""
    out = np.empty(len(points))
    for k in range(0, len(points), 500):
        a, b, c = (corners[None, :, i] - points[k : k + 500, None] for i in range(3))
        la, lb, lc = (np.linalg.norm(v, axis=-1) for v in (a, b, c))
        top = (a * np.cross(b, c)).sum(-1)
        rest = la * lb * lc + (a * b).sum(-1) * lc + (b * c).sum(-1) * la + (c * a).sum(-1) * lb
        out[k : k + 500] = np.arctan2(top, rest).sum(1) / (2 * np.pi)
    return out


def test_linear_moments_agree_with_monte_carlo() -> None:
    mesh = surface("rubber-mallet", "handle")
    gradient, centre = np.array([4.0, 3.0, -5.0]), part_moments(mesh)[0, 1:4] / part_moments(mesh)[0, 0]
    low, high = mesh.bounds
    points = low + (high - low) * np.random.default_rng(0).random((12_000, 3))
    points = points[winding(mesh.corners, points) > 0.5]
    cell = np.prod(high - low) / 12_000
    density = 1 + (points - centre) @ gradient
    found = InertialParameters.from_point_masses(density * cell, points)
    exact = InertialParameters(linear_moments(mesh, gradient))
    assert float(found.mass) == pytest.approx(float(exact.mass), rel=0.02)
    np.testing.assert_allclose(found.com, exact.com, atol=0.02 * np.ptp(points, axis=0).max())
    np.testing.assert_allclose(found.inertia_com, exact.inertia_com, atol=0.03 * np.diag(exact.inertia_com).max())


@pytest.mark.parametrize(("name", "part", "axis"), [("hammer", "head", 0), ("c-clamp", "frame", 1)])
def test_linear_moments_are_the_limit_of_layers(name: str, part: str, axis: int) -> None:
    mesh = surface(name, part)
    fall = Fall(tuple(np.eye(3)[axis]), 0.5)  # type: ignore[arg-type]
    exact = linear_moments(mesh, gradient_of(mesh, fall))
    even = part_moments(mesh)[0]
    low, high = mesh.bounds[:, axis]
    centre = even[1 + axis] / even[0]
    ends = np.linspace(0, 1, 81)
    middle = low + 0.5 * (ends[1:] + ends[:-1]) * (high - low) - centre
    density = 1 - 0.5 / (high - low) * middle
    stack = [Layer(axis, a, b, d) for a, b, d in zip(ends[:-1], ends[1:], density, strict=True)]
    layered = even + layer_moments(mesh, stack, 1.0)
    size = np.abs(exact - even).max()
    np.testing.assert_allclose(layered - even, exact - even, atol=2e-3 * size)


def test_third_moments_of_a_box_and_of_the_same_box_moved() -> None:
    mesh = surface("hammer", "head")
    centre = part_moments(mesh)[0, 1:4] / part_moments(mesh)[0, 0]
    about, moved = third_moments(mesh, centre[None])[0], third_moments(mesh, np.zeros((1, 3)))[0]
    # T about the origin = T about c + 3 c sym M2 + V c c c, along one axis.
    volume = part_moments(mesh)[0, 0]
    central = InertialParameters(part_moments(mesh)[0]).pseudo_inertia[:3, :3] - volume * np.outer(centre, centre)
    for i in range(3):
        expected = about[i, i, i] + 3 * centre[i] * central[i, i] + volume * centre[i] ** 3
        assert moved[i, i, i] == pytest.approx(expected, rel=1e-9, abs=1e-18)


@pytest.mark.parametrize("name", GRADED)
@pytest.mark.parametrize("seed", [None, 1])
def test_graded_tools_look_like_the_even_ones_and_weigh_otherwise(name: str, seed: int | None) -> None:
    made, even = build_graded(name, seed), build(name, seed)
    np.testing.assert_array_equal(made.mesh.vertices, even.mesh.vertices)
    np.testing.assert_array_equal(made.mesh.rgb, even.mesh.rgb)
    assert made.name == f"graded-{name}"
    assert made.truth.validity().consistent
    assert float(made.truth.mass) == pytest.approx(made.masses.sum(), rel=1e-12)
    assert np.linalg.norm(made.truth.com - even.truth.com) > 5e-4
    uneven = np.array([bool(words) for words in made.gradings])
    assert 1 <= uneven.sum() < 3
    assert made.graded_moments is not None
    own = made.densities[:, None] * made.parts.moments
    np.testing.assert_allclose(made.graded_moments[~uneven], own[~uneven], rtol=1e-12)
    assert (np.abs(made.graded_moments - own).max(1)[uneven] > 0).all()


def test_graded_families_are_at_least_six_and_seeded() -> None:
    assert len(GRADED) >= 6
    assert set(GRADED) <= set(FAMILIES)
    first, again, other = (build_graded("hammer", seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first.truth.vector, again.truth.vector)
    assert first.gradings == again.gradings != other.gradings


def test_impossible_gradings_are_refused() -> None:
    tool = build("hammer")
    with pytest.raises(BadValue, match="hammer has no part 'beak'; its parts are: shaft, head, grip"):
        graded(tool, [Grading("beak", Fall((1, 0, 0), 0.1), "")])
    with pytest.raises(BadValue, match="falls by 300 % of its mean ends below zero"):
        graded(tool, [Grading("head", Fall((1, 0, 0), 3.0), "")])
    with pytest.raises(BadValue, match="There is no graded tool 'ruler'; there are: box-wrench"):
        build_graded("ruler")


def test_the_verb_writes_graded_folders_that_say_so(tmp_path: Path) -> None:
    done = CliRunner().invoke(workshop, ["build", str(tmp_path), "--graded", "--tools", "machinist-hammer", "--json"])
    assert done.exit_code == 0, done.output
    (folder,) = object_folders(tmp_path)
    known = read_object(folder)
    assert known.name == "graded-machinist-hammer"
    assert known.gradings[0].startswith("uneven growth: density falls linearly along y")
    assert known.gradings[1] == ""
    facts = json.loads((folder / "truth.json").read_text())
    assert [row["homogeneous"] for row in facts["parts"]] == [False, True]
    assert "homogeneous is false" in facts["parts_note"]
    truth = build_graded("machinist-hammer").truth_in_sensor
    np.testing.assert_allclose(known.truth.vector, truth.vector, rtol=1e-9, atol=1e-12)
    homogeneous = known.parts_in_sensor.whole(np.asarray(known.part_masses))
    assert np.linalg.norm(homogeneous.com - truth.com) > 1e-3
