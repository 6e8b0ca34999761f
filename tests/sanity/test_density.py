"""Densities that no material has: shapes of the wrong scale and masses that are not the object's alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import steelyard as sy
from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.evidence import PartMass
from steelyard.findings import Finding
from steelyard.identify.estimate import Estimate
from steelyard.inertia import InertialParameters
from steelyard.parts.parts import Parts
from steelyard.pipelines.held_object import identify_rows
from steelyard.pipelines.shape_in_parts import shape_of
from steelyard.sanity.fitted.no_body import LIGHT, impossible_density
from steelyard.shape.cloud import Cloud
from steelyard.simulate import hammer
from steelyard.simulate.handling import exact_log, handling_log
from steelyard.workshop import solids
from steelyard.workshop.draw import Draw
from steelyard.workshop.materials import ABS, STAINLESS_STEEL
from steelyard.workshop.sampling import surface_cloud
from steelyard.workshop.tools import Grasp, Piece, Tool, make_tool

VOLUME = 1e-4  # of 0.62 kg: 6200 kg/m^3


@pytest.fixture(scope="module")
def made() -> hammer.Example:
    return hammer.recording(0)


@pytest.fixture(scope="module")
def answer(made: hammer.Example) -> Estimate:
    return sy.identify(made.recording, parts=made.tool.parts)


def part(mass: float, std: float, density: float, label: int = 3) -> PartMass:
    return PartMass(label, mass, std, mass / density, np.zeros(3))


def named(estimate: Estimate) -> list[Finding]:
    return [f for f in estimate.findings if f.code == "materials-impossible"]


@pytest.mark.parametrize("density", [6.0, 12.0, 900.0, 7850.0, 19300.0, 22590.0])
def test_what_materials_have_is_not_named(answer: Estimate, density: float) -> None:
    assert impossible_density(answer, answer.mass / density, 0.025, [part(0.3, 0.001, density)]) == ()


@pytest.mark.parametrize(("density", "words"), [(2.0, "as light"), (60_000.0, "as dense")])
def test_what_none_has_is_named_unless_the_bar_reaches_one(answer: Estimate, density: float, words: str) -> None:
    (found,) = impossible_density(answer, answer.mass / density, 0.025)
    assert found.code == "materials-impossible"
    assert words in found.message
    assert "--tool" in found.remedy
    assert impossible_density(answer, answer.mass / density, 0.9) == ()


def test_a_part_is_named_by_its_label_where_its_own_bar_excludes_a_material(answer: Estimate) -> None:
    (found,) = impossible_density(answer, VOLUME, 0.025, [part(0.3, 0.01, 7850.0, 0), part(0.3, 0.01, 60_000.0)])
    assert found.message.startswith("Part 3, 0.3 kg in 5 cm^3, has a density of 6e+04 ± 2e+03 kg/m^3")
    assert "Part 0" not in found.message
    assert impossible_density(answer, VOLUME, 0.025, [part(0.3, 0.1, 60_000.0)]) == ()


@pytest.mark.parametrize(
    ("per_metre", "words"), [(100.0, "centimetres taken for millimetres"), (39.3701, "inches taken for millimetres")]
)
def test_a_cloud_in_other_units_is_named_with_them(made: hammer.Example, per_metre: float, words: str) -> None:
    seen = surface_cloud(made.tool)
    found = sy.identify(made.recording, scan=shape_of(Cloud(per_metre * seen.xyz, seen.rgb)))
    assert found.findings[0].code == "materials-impossible"
    assert words in found.findings[0].message
    assert "cloud-in-mm" in found.codes()


def test_a_mesh_of_a_tenth_of_its_size_is_named(made: hammer.Example) -> None:
    tenth = Parts(made.tool.parts.label, made.tool.parts.moments * np.repeat([1e-3, 1e-4, 1e-5], [1, 3, 6]))
    (found,) = named(sy.identify(made.recording, parts=tenth))
    assert found.message.startswith("The whole")
    assert "centimetres taken for millimetres" in found.message


def test_the_right_shape_is_not_named(made: hammer.Example, answer: Estimate) -> None:
    assert named(answer) == []
    moved = replace(made.recording, object_pose_std=(0.001, 0.01))
    assert named(sy.identify(moved, parts=made.tool.parts)) == []


def test_a_shape_so_far_off_that_its_parts_weigh_nothing_leaves_the_answer_to_the_log(made: hammer.Example) -> None:
    tenth = Parts(made.tool.parts.label, made.tool.parts.moments * np.repeat([1e-3, 1e-4, 1e-5], [1, 3, 6]))
    away = tenth.in_frame(sy.Pose(sy.Rotation.identity(), np.array([0.5, 0, 0])))
    found = sy.identify(made.recording, parts=away)
    np.testing.assert_array_equal(found.parameters.vector, sy.identify(made.recording).parameters.vector)
    dense, elsewhere = found.findings[:2]
    assert "centimetres taken for millimetres" in dense.message
    assert "mm outside the object: pose_in_sensor is wrong by at least that much. The shape cannot" in elsewhere.message


SIDES = np.array([0.12, 0.08, 0.06])


def box_cloud() -> Cloud:
    """Return the outside of a box, about its middle."""
    rng = np.random.default_rng(0)
    face = rng.choice(3, 3000, p=(1 / SIDES) / (1 / SIDES).sum())
    xyz = rng.uniform(-0.5, 0.5, (3000, 3))
    xyz[np.arange(3000), face] = rng.choice([-0.5, 0.5], 3000)
    return Cloud(xyz * SIDES, np.full((3000, 3), 128, np.uint8))


def box(wall: float | None) -> InertialParameters:
    """Return a box of plastic (1000 kg/m^3) about its middle, hollow but for its walls [m], or solid of 1.5 kg."""
    if wall is None:
        return InertialParameters.from_com(1.5, np.zeros(3), _inertia(1.5, SIDES))
    inner = SIDES - 2 * wall
    masses = 1000 * np.prod(SIDES), 1000 * np.prod(inner)
    return InertialParameters.from_com(
        masses[0] - masses[1], np.zeros(3), _inertia(masses[0], SIDES) - _inertia(masses[1], inner)
    )


def _inertia(mass: float, sides: Array) -> Array:
    square = sides**2
    return np.diag(mass / 12 * (square.sum() - square))


def weighed(body: InertialParameters) -> Estimate:
    time = np.arange(4200) / 100
    rng = np.random.default_rng(1)
    log = exact_log(hammer.motion().at(time), body)
    noisy = replace(log, wrench=log.wrench + rng.standard_normal((4200, 6)) * np.repeat([2e-3, 0.05], 3))
    return identify_rows(noisy, parts=shape_of(box_cloud()), pose=sy.Pose.identity())


def test_a_light_scan_is_trusted_less_about_inertia() -> None:
    """A box with walls of 4 mm: a third of the mass of a solid one, and 1.4 times the moments for it."""
    hollow, solid = box(0.004), box(None)
    found, sure = weighed(hollow), weighed(solid)
    assert any("is light for a solid" in note for note in found.notes)
    assert not any("is light for a solid" in note for note in sure.notes)
    for made, body in ((found, hollow), (sure, solid)):
        off = (made.parameters.inertia_com - body.inertia_com)[[0, 1, 2], [0, 1, 2]] / made.std[[4, 7, 9]]
        assert np.abs(off).max() < 3
    assert (sure.std[4:] < 0.2 * found.std[4:] * float(solid.mass / hollow.mass)).all()


def bottle(wall: float | None) -> Tool:
    """Return a closed plastic bottle on a foot of steel, hollow but for its walls [mm], or solid."""
    outside = solids.rod(38, 0, 190)
    inside = solids.rod(38 - (wall or 0), wall or 0, 190 - (wall or 0))
    body = outside - inside if wall else outside
    pieces = [Piece("bottle", body, ABS, (240, 190, 24)), Piece("foot", solids.rod(38, -14, 0), STAINLESS_STEEL)]
    return make_tool("bottle", pieces, Grasp((0, 0, 190), "x", "z"), Draw())


def scanned(tool: Tool) -> tuple[Estimate, InertialParameters]:
    """Return what a log and a scan of the outside of a tool give, and the truth."""
    truth = tool.parts.whole(tool.densities * tool.parts.volume).in_frame(tool.X_OS.inverse())
    scan = shape_of(surface_cloud(tool))
    return identify_rows(handling_log(truth, "slow", "moderate"), parts=scan, pose=tool.X_OS.inverse()), truth


def test_a_light_part_of_a_scan_is_trusted_less_in_its_own_inertia() -> None:
    """The whole is no lighter than wood, so that only the mass of the part tells."""
    for wall, light in ((2.5, True), (None, False)):
        found, truth = scanned(bottle(wall))
        assert found.mass / sum(part.volume for part in found.parts) > LIGHT
        assert any("such a part is trusted to 35 %" in note for note in found.notes) == light
        assert not any("the shape is trusted to 35 %" in note for note in found.notes)
        off = (found.parameters.inertia_com - truth.inertia_com)[[0, 1, 2], [0, 1, 2]] / found.std[[4, 7, 9]]
        assert np.abs(off).max() < 2.5


def test_a_mesh_of_light_parts_is_taken_to_be_solid() -> None:
    tool = bottle(2.5)
    truth = tool.parts.whole(tool.densities * tool.parts.volume)
    solid = bottle(None).parts
    found = identify_rows(handling_log(truth, "slow", "moderate"), parts=solid, pose=sy.Pose.identity())
    assert not any("light for a solid" in note for note in found.notes)


def test_a_shape_alone_weighs_nothing(made: hammer.Example) -> None:
    streams = made.recording.streams
    i = next(k for k, stream in enumerate(streams) if "rotation" in stream.channels)
    mixed = np.random.default_rng(0).permutation(len(streams[i].channels["rotation"]))
    channels = {**streams[i].channels, "rotation": streams[i].channels["rotation"][mixed]}
    lost = replace(made.recording, streams=(*streams[:i], replace(streams[i], channels=channels), *streams[i + 1 :]))
    with pytest.raises(CannotAnswer):
        sy.identify(lost, parts=made.tool.parts)
