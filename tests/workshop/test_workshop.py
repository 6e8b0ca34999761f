"""The twenty tools: closed solids that only touch, exact truth, the masses of Table II, variants, clouds, the verb."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from columns import column_moments
from steelyard.cli.workshop import workshop
from steelyard.errors import BadValue
from steelyard.inertia import InertialParameters, forms, solids
from steelyard.io.object_folders import object_folders, read_object
from steelyard.shape.cloud import Cloud
from steelyard.shape.mesh import open_edges, part_moments
from steelyard.shape.nesting import body_of, overlaps, winding_number
from steelyard.simulate.workshop import known_object
from steelyard.spatial import Pose, Rotation
from steelyard.workshop import solids as shapes
from steelyard.workshop.catalogue import FAMILIES, build
from steelyard.workshop.draw import Draw
from steelyard.workshop.finish import painted
from steelyard.workshop.materials import BRASS, CARBON_STEEL
from steelyard.workshop.sampling import surface_cloud
from steelyard.workshop.tools import Grasp, Piece, Tool, make_tool

# Mass [kg] and number of parts of the published tools.
TABLE_II = {
    "allen-key": (0.128, 1), "box-wrench": (0.206, 1), "measuring-tape": (0.136, 1), "ruler": (0.009, 1),
    "screwdriver": (0.030, 2), "nut-screwdriver": (0.081, 2), "rubber-mallet": (0.237, 2),
    "bent-jaw-pliers": (0.255, 3), "machinist-hammer": (0.133, 2), "pliers": (0.633, 3), "c-clamp": (0.598, 5),
    "adjustable-wrench": (0.719, 4), "hammer": (0.690, 3), "file": (0.020, 3), "socket-wrench": (0.356, 5),
    "hacksaw": (0.658, 7), "clamp": (0.340, 7), "vise-grip": (0.387, 8), "electronic-caliper": (0.174, 14),
    "vise-clamp": (0.225, 9),
}  # fmt: skip


@cache
def tool(name: str, seed: int | None = None) -> Tool:
    return build(name, seed)


@cache
def cloud(name: str) -> Cloud:
    return surface_cloud(tool(name))


@pytest.mark.parametrize("name", FAMILIES)
@pytest.mark.parametrize("seed", [None, 1, 2])
def test_every_part_is_a_closed_solid_and_parts_only_touch(name: str, seed: int | None) -> None:
    made = tool(name, seed)
    assert not open_edges(made.mesh).any()
    assert (part_moments(made.mesh)[:, 0] > 1e-9).all()
    assert overlaps(made.mesh) == ()
    for k in range(len(made.parts)):
        assert made.truth.validity().consistent
        InertialParameters(made.parts.moments[k]).require_consistent()


@pytest.mark.parametrize("name", FAMILIES)
def test_no_part_floats(name: str) -> None:
    made = tool(name)
    bodies = [body_of(made.mesh, [k]) for k in range(len(made.parts))]
    reached, waiting = {0}, set(range(1, len(bodies)))
    while found := {k for k in waiting if any(bodies[k].min_gap(bodies[j], 1e-3) < 1e-9 for j in reached)}:
        reached |= found
        waiting -= found
    assert waiting == set()


@pytest.mark.parametrize("name", FAMILIES)
def test_mass_and_parts_are_about_those_of_table_ii(name: str) -> None:
    mass, parts = TABLE_II[name]
    assert float(tool(name).truth.mass) == pytest.approx(mass, rel=0.25)
    assert len(tool(name).parts) == parts == len(tool(name).materials) == len(set(tool(name).part_names))


def test_the_set_is_as_mixed_as_real_tools_are() -> None:
    tools = [tool(name) for name in FAMILIES]
    contrast = [made for made in tools if np.ptp(made.densities) > 0.3 * made.densities.max()]
    uniform = [made.parts.moments.sum(0) for made in tools]
    offset = [np.linalg.norm(u[1:4] / u[0] - made.truth.com) for u, made in zip(uniform, tools, strict=True)]
    single = [made for made in tools if len(made.parts) > 1 and len(np.unique(made.mesh.rgb, axis=0)) == 1]
    assert len(contrast) >= 12
    assert sum(distance > 0.5e-3 for distance in offset) >= 12
    assert [made.name for made in single] == ["bent-jaw-pliers", "pliers", "vise-grip"]
    assert sum(made.finish == "scuffed" for made in tools) >= 2
    assert sum(made.finish == "shaded" for made in tools) >= 2


@pytest.mark.parametrize("name", FAMILIES)
def test_moments_agree_with_monte_carlo(name: str) -> None:
    made = tool(name)
    assert set(made.mesh.part) == set(range(len(made.parts)))  # no surface is of none
    for k in range(len(made.parts)):
        assert_near(column_moments(made.mesh.of_part(k)), made.parts.moments[k])


def assert_near(found: np.ndarray, exact: np.ndarray, share: float = 5e-3) -> None:
    """Volume, centroid and inertia agree to `share`."""
    size = np.sqrt(np.trace(forms.inertia_com(exact)) / exact[0])
    assert found[0] == pytest.approx(exact[0], rel=share)
    assert np.abs(forms.com(found) - forms.com(exact)).max() < share * size
    inertia = forms.inertia_com(exact)
    assert np.abs(forms.inertia_com(found) - inertia).max() < share * np.diag(inertia).max()


@pytest.mark.parametrize("name", FAMILIES)
def test_parts_add_up_to_the_whole(name: str) -> None:
    made = tool(name)
    whole = InertialParameters.from_com(
        made.masses.sum(), made.masses @ made.parts.centroid / made.masses.sum(), made.truth.inertia_com
    )
    np.testing.assert_allclose(whole.vector, made.truth.vector, rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(made.parts.whole(made.masses).vector, made.truth.vector, rtol=1e-9, atol=1e-15)
    back = made.truth_in_sensor.in_frame(made.X_OS)
    np.testing.assert_allclose(back.vector, made.truth.vector, rtol=1e-9, atol=1e-12)


def test_a_tool_of_closed_forms_has_their_truth() -> None:
    ball = Piece("core", shapes.ball((0, 0, 0), 10, 200), BRASS)
    cube = Piece("case", shapes.block((-20, 20), (-20, 20), (-20, 20)), CARBON_STEEL)
    made = make_tool("nested", [ball, cube], Grasp((0, 0, 30)), Draw())
    core = solids.sphere(0.01, 1.0)
    expected = solids.box(0.04, 0.04, 0.04, 7850) - InertialParameters(7850 * core.vector)
    expected = expected + InertialParameters(8500 * core.vector)
    np.testing.assert_allclose(made.truth.vector, expected.vector, rtol=1e-4, atol=1e-12)
    assert cloud_labels(made) == {1}


def test_slivers_are_dropped_and_voids_kept() -> None:
    hollow = shapes.block((0, 40), (0, 40), (0, 40)) - shapes.block((10, 30), (10, 30), (10, 30))
    crumb = shapes.block((50, 51), (0, 1), (0, 1))
    pin_hole = shapes.block((5, 6), (5, 6), (5, 6))
    found = shapes.without_slivers((hollow + crumb) - pin_hole)
    assert found.volume() == pytest.approx(40**3 - 20**3)
    assert shapes.without_slivers(hollow).volume() == pytest.approx(40**3 - 20**3)


def cloud_labels(made: Tool) -> set[int]:
    return set(surface_cloud(made, points=200).label.tolist())


def test_a_part_that_is_cut_away_whole_is_an_error() -> None:
    cube = shapes.block((0, 1), (0, 1), (0, 1))
    with pytest.raises(BadValue) as caught:
        make_tool("odd", [Piece("a", cube, BRASS), Piece("b", cube, BRASS)], Grasp((0, 0, 0)), Draw())
    assert str(caught.value) == "odd: nothing is left of the part 'b' once the parts before it are cut out."


@pytest.mark.parametrize("name", FAMILIES)
def test_same_seed_same_tool_other_seed_another(name: str) -> None:
    again, other = build(name, 1), tool(name, 2)
    np.testing.assert_array_equal(again.mesh.vertices, tool(name, 1).mesh.vertices)
    np.testing.assert_array_equal(again.densities, tool(name, 1).densities)
    assert abs(float(other.truth.mass) / float(again.truth.mass) - 1) > 1e-4
    assert not np.allclose(np.ptp(other.mesh.bounds, axis=0), np.ptp(again.mesh.bounds, axis=0), rtol=1e-4)
    for material, density in zip(other.materials, other.densities, strict=True):
        assert abs(density / material.density - 1) <= material.tolerance


@pytest.mark.parametrize("name", FAMILIES)
def test_the_sensor_frame_sits_at_the_tool(name: str) -> None:
    made = tool(name)
    low, high = made.mesh.bounds
    assert (made.X_OS.position > low - 5e-3).all()
    assert (made.X_OS.position < high + 5e-3).all()
    assert 1e-3 < np.linalg.norm(made.truth_in_sensor.com) < 0.2


HIDDEN = {"electronic-caliper": {"board", "cell"}, "vise-clamp": {"nut"}}


@pytest.mark.parametrize("name", ["screwdriver", "electronic-caliper", "vise-clamp", "measuring-tape"])
def test_the_cloud_lies_on_the_visible_surface(name: str) -> None:
    made, points = tool(name), cloud(name)
    assert points.xyz.shape == (2000, 3)
    unseen = {made.part_names[k] for k in np.setdiff1d(made.parts.label, points.label)}
    assert unseen == HIDDEN.get(name, set())
    for k in range(0, 2000, 100):
        corners = made.mesh.corners[made.mesh.part == points.label[k]]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        distance = np.abs(((points.xyz[k] - corners[:, 0]) * normal).sum(1)).min()
        assert distance < 1e-9
    rng = np.random.default_rng(0)
    for xyz in points.xyz[rng.integers(2000, size=20)]:
        outside = made.truth.com + 20 * (xyz - made.truth.com)
        assert winding_number(made.mesh.corners, outside) == pytest.approx(0, abs=1e-6)


def test_points_are_spread_by_visible_area() -> None:
    made = tool("ruler")
    points = cloud("ruler")
    middle = made.mesh.bounds.mean(0)[0]
    assert (points.xyz[:, 0] < middle).mean() == pytest.approx(0.5, abs=0.04)


def test_clouds_are_made_again_alike() -> None:
    for name in ("screwdriver", "file"):
        np.testing.assert_array_equal(surface_cloud(tool(name)).xyz, cloud(name).xyz)
        np.testing.assert_array_equal(surface_cloud(tool(name)).rgb, cloud(name).rgb)
    assert not np.array_equal(surface_cloud(tool("file"), 1).xyz, cloud("file").xyz)


def test_finishes_change_colours_and_nothing_else() -> None:
    even, worn, shaded = cloud("screwdriver"), cloud("file"), cloud("box-wrench")
    assert len(np.unique(even.rgb, axis=0)) == 2
    assert len(np.unique(worn.rgb, axis=0)) > 100
    assert len(np.unique(shaded.rgb, axis=0)) > 20
    mesh = painted(tool("file"))
    np.testing.assert_array_equal(mesh.vertices, tool("file").mesh.vertices)
    assert mesh.rgb is not None
    assert not np.array_equal(mesh.rgb, tool("file").mesh.rgb)


def test_unknown_names_are_answered_with_the_list() -> None:
    with pytest.raises(BadValue, match="There is no tool 'spoon'; there are: allen-key, box-wrench"):
        build("spoon")


def test_a_known_object_is_seen_from_the_sensor() -> None:
    known = known_object(tool("hammer"))
    assert known.half == "mixed"
    whole = known.parts_in_sensor.whole(np.asarray(known.part_masses))
    np.testing.assert_allclose(whole.vector, known.truth.vector, rtol=1e-9, atol=1e-12)
    turned = Pose(Rotation(known.X_SO.rotation.matrix), np.zeros(3)).apply(known.cloud.xyz)
    np.testing.assert_allclose(known.box, np.ptp(turned, axis=0))


def test_the_verb_writes_folders_that_are_read(tmp_path: Path) -> None:
    arguments = ["build", str(tmp_path / "out"), "--tools", "ruler", "--tools", "file", "--json"]
    done = CliRunner().invoke(workshop, arguments)
    assert done.exit_code == 0, done.output
    summary = json.loads(done.stdout)
    assert [row["name"] for row in summary["objects"]] == ["ruler", "file"]
    read = [read_object(path) for path in object_folders(tmp_path / "out")]
    assert [known.name for known in read] == ["file", "ruler"]
    assert [float(known.truth.mass) for known in read] == pytest.approx(
        [row["mass_kg"] for row in summary["objects"]][::-1]
    )


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (("--tools", "rulr"), "There is no tool 'rulr'"),
        (("--tools", "rulr", "--variants", "2"), "There is no tool 'rulr'"),
        (("--graded",), "There is no graded tool 'ruler'"),
    ],
)
def test_the_verb_writes_nothing_where_a_name_is_wrong(tmp_path: Path, more: tuple[str, ...], words: str) -> None:
    first = "hammer" if "--graded" in more else "file"
    arguments = ["build", str(tmp_path / "out"), "--tools", first, "--tools", "ruler", *more]
    done = CliRunner().invoke(workshop, arguments)
    assert isinstance(done.exception, BadValue)
    assert words in str(done.exception)
    assert not (tmp_path / "out").exists()


def test_the_verb_wants_a_folder_and_each_tool_once(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("mine")
    done = CliRunner().invoke(workshop, ["build", str(tmp_path / "out"), "--tools", "ruler"])
    assert "this is a file" in str(done.exception)
    assert (tmp_path / "out").read_text() == "mine"
    done = CliRunner().invoke(workshop, ["build", str(tmp_path / "on"), "--tools", "ruler", "--tools", "ruler"])
    assert "1 object folder in" in done.stderr


def test_the_verb_makes_variants(tmp_path: Path) -> None:
    arguments = ["build", str(tmp_path), "--tools", "screwdriver", "--variants", "2", "--seed", "5"]
    done = CliRunner().invoke(workshop, arguments)
    assert done.exit_code == 0, done.output
    first, second = (read_object(path) for path in object_folders(tmp_path))
    assert (first.name, second.name) == ("screwdriver-s5-0", "screwdriver-s5-1")
    assert float(first.truth.mass) != pytest.approx(float(second.truth.mass), rel=1e-4)
    assert "2 object folders" in done.stderr
