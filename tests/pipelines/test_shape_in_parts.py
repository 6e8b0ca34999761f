"""From a cloud to an estimate: the shape in parts, and the log that chooses among its cuts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import steelyard as sy
from steelyard.api import saved_parts
from steelyard.errors import BadValue
from steelyard.findings import Finding
from steelyard.inertia import InertialParameters
from steelyard.inertia.solids import box
from steelyard.parts.parts import Parts
from steelyard.pipelines.options import Options
from steelyard.pipelines.shape_in_parts import MOST_PARTS, Shape, shape_of
from steelyard.shape.cloud import Cloud
from steelyard.shape.scan import fuse
from steelyard.shape.scans.placement import Placement
from steelyard.simulate import hammer
from steelyard.simulate.handling import handling_log
from steelyard.spatial import Pose, Rotation
from steelyard.workshop.sampling import surface_cloud


@pytest.fixture(scope="module")
def made() -> hammer.Example:
    return hammer.recording(0)


@pytest.fixture(scope="module")
def cloud(made: hammer.Example) -> Cloud:
    seen = surface_cloud(made.tool)
    return Cloud(seen.xyz, seen.rgb)


@pytest.fixture(scope="module")
def shape(cloud: Cloud) -> Shape:
    return shape_of(cloud)


def test_a_cloud_becomes_the_solid_in_parts(made: hammer.Example, shape: Shape) -> None:
    assert shape.solid.mesh.volume == pytest.approx(made.tool.parts.volume.sum(), rel=0.1)
    assert shape.parts.volume.sum() == pytest.approx(shape.solid.mesh.volume, rel=1e-9)
    assert 2 <= len(shape.parts) <= 2 * len(made.tool.parts)


@pytest.mark.parametrize(
    ("lost", "said"),
    [(0, []), (1, ["1 of {} points of the cloud"]), (7, ["7 of {} points of the cloud"])],
)
def test_points_without_a_place_are_counted(
    made: hammer.Example, cloud: Cloud, tmp_path: Path, lost: int, said: list[str]
) -> None:
    xyz = np.concatenate([cloud.xyz, np.full((lost, 3), np.inf)])
    np.savez(tmp_path / "cloud.npz", xyz=xyz)
    found = sy.identify(made.recording, scan=tmp_path / "cloud.npz")
    notes = [note for note in found.notes if "points of the cloud" in note]
    assert notes == [f"{words.format(len(xyz))} left out: no finite place or normal" for words in said]
    np.testing.assert_array_equal(
        found.parameters.vector, sy.identify(made.recording, scan=Cloud(cloud.xyz)).parameters.vector
    )


def turned_round(pose: Pose) -> Pose:
    """A pose like that of another frame: far off, and turned."""
    return Pose(Rotation.exp(np.array([0.0, 2.0, 1.0])), pose.position + np.array([1.5, 0.0, 0.0]))


@pytest.mark.parametrize(
    "wrong", [turned_round, lambda pose: Pose(pose.rotation, pose.position + np.array([0.0, 0.0, 8.0]))]
)
def test_a_pose_that_no_shape_can_follow_is_named_and_the_answer_is_that_of_the_log(
    made: hammer.Example, shape: Shape, wrong: Callable[[Pose], Pose]
) -> None:
    assert made.recording.object_pose is not None
    away = replace(made.recording, object_pose=wrong(made.recording.object_pose))
    found, alone = sy.identify(away, scan=shape), sy.identify(made.recording)
    np.testing.assert_array_equal(found.parameters.vector, alone.parameters.vector)
    np.testing.assert_array_equal(found.covariance, alone.covariance)
    (named,) = [f for f in found.findings if f.code == "part-not-homogeneous"]
    assert "mm outside the object: pose_in_sensor is wrong by at least that much. The shape cannot" in named.message
    assert "not its inverse, and in the right unit (m, mm)" in named.remedy
    assert not any("std_mm" in note for note in found.notes)


def test_every_cut_is_the_whole_solid(shape: Shape) -> None:
    found = shape.cuts()
    numbers, cuts = found.numbers, found.parts
    assert found.prior.max() <= 0
    assert numbers[int(np.argmax(found.prior))] == len(shape.parts)
    assert numbers == tuple(sorted(set(numbers)))
    assert len(shape.parts) in numbers
    assert max(numbers) <= MOST_PARTS
    whole = shape.parts.moments.sum(0)
    for number, cut in zip(numbers, cuts, strict=True):
        assert len(cut) == number
        np.testing.assert_allclose(cut.moments.sum(0), whole, rtol=1e-9, atol=1e-12 * abs(whole).max())


def test_the_scan_gives_the_inertia_that_slow_motion_does_not(made: hammer.Example, shape: Shape) -> None:
    true = made.truth.inertia_com
    seen = sy.identify(made.recording, scan=shape)
    blind = sy.identify(made.recording)
    assert float(seen.mass) == pytest.approx(float(made.truth.mass), rel=2e-3)

    upper = np.triu_indices(3)
    off = np.abs(seen.parameters.inertia_com - true)[upper]
    assert (off < 3 * seen.std[4:]).all()
    assert off.max() < 0.1 * np.trace(true)
    assert np.linalg.norm(seen.std[4:]) < 0.7 * np.linalg.norm(blind.std[4:])
    assert any("part" in note for note in seen.notes)


def test_where_a_scan_lies_is_in_the_error_of_its_shape_and_not_in_the_grasp(shape: Shape) -> None:
    views = hammer.scanned(0, views=24).views
    scan = fuse(views)
    placed = replace(scan, placement=Placement(Pose.identity(), 1e-3, 0.01, None))
    exact, unsure = replace(shape, scan=scan).error, replace(shape, scan=placed).error
    assert exact == shape.error
    assert unsure.com_m == pytest.approx(np.hypot(exact.com_m, 1e-3))
    assert (unsure.turn_rad, unsure.grasp_m, unsure.grasp_rad) == (0.01, 0.0, 0.0)
    parts, kept = replace(shape, scan=placed).parts, saved_parts(replace(shape, scan=placed)).parts
    assert (parts.com_std, parts.stretch, parts.turn_std) == (unsure.com_m, unsure.stretch, unsure.turn_rad)
    assert (kept.com_std, kept.stretch, kept.turn_std) == (unsure.com_m, unsure.stretch, unsure.turn_rad)


def test_a_known_number_of_parts_is_kept(cloud: Cloud) -> None:
    assert len(shape_of(cloud, parts=2).parts) == 2


def test_what_a_log_decided_is_a_note_and_no_finding(made: hammer.Example, shape: Shape) -> None:
    unsure = Finding.of("parts-unsure", "The number of parts is in doubt.")
    assert "let a log" in unsure.remedy
    doubted = replace(shape, segmentation=replace(shape.segmentation, findings=(unsure,)))
    found = sy.identify(made.recording, scan=doubted)
    assert "parts-unsure" not in found.codes()
    assert "the number of parts is in doubt" in found.notes


def test_parts_and_scan_are_not_both_given(made: hammer.Example, shape: Shape) -> None:
    with pytest.raises(BadValue, match="give one of them"):
        sy.identify(made.recording, scan=shape, parts=made.tool.parts)


def test_a_scan_needs_its_place_in_the_sensor(made: hammer.Example, shape: Shape) -> None:
    with pytest.raises(BadValue, match="pose_in_sensor"):
        sy.identify(replace(made.recording, object_pose=None), scan=shape)


def test_a_mesh_in_millimetres_is_named(made: hammer.Example) -> None:
    scale = np.repeat([1e9, 1e12, 1e15], [1, 3, 6])
    huge = Parts(made.tool.parts.label, made.tool.parts.moments * scale)
    with pytest.raises(BadValue, match=r"in millimetres: scale it by 0\.001"):
        sy.identify(made.recording, parts=huge)


def two_blocks() -> Cloud:
    """Return the cloud of a bar of two colours, end to end."""
    rng = np.random.default_rng(0)
    sides = np.array([0.12, 0.03, 0.03])
    face = rng.choice(3, 3000, p=(1 / sides) / (1 / sides).sum())
    xyz = rng.uniform(-0.5, 0.5, (3000, 3))
    xyz[np.arange(3000), face] = rng.choice([-0.5, 0.5], 3000)
    red = (xyz[:, :1] > 0) * np.array([[200, 20, 20]]) + (xyz[:, :1] <= 0) * np.array([[20, 20, 200]])
    return Cloud(xyz * sides, red.astype(np.uint8))


def halves(side: float, low: float, seed: int) -> tuple[Cloud, InertialParameters]:
    """A cube, steel above a height and plastic below: points of its faces in two colours, and its parameters."""
    rng = np.random.default_rng(seed)
    xyz = rng.uniform(-side / 2, side / 2, (2000, 3))
    xyz[np.arange(2000), rng.choice(3, 2000)] = rng.choice([-side / 2, side / 2], 2000)
    rgb = np.where(xyz[:, 2:] > low, [[178, 176, 172]], [[186, 52, 38]]).astype(np.uint8)
    steel, plastic = side / 2 - low, side / 2 + low
    below = Pose(Rotation.identity(), np.array([0, 0, (low - side / 2) / 2]))
    above = Pose(Rotation.identity(), np.array([0, 0, (low + side / 2) / 2]))
    body = box(side, side, steel, 7850).in_frame(above) + box(side, side, plastic, 1150).in_frame(below)
    return Cloud(xyz, rgb), body


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_bars_hold_borders_that_nobody_sees_inside_a_thick_body(seed: int) -> None:
    cloud, body = halves(0.06, 0.0075, seed)
    shape = shape_of(cloud)
    assert shape.segmentation.border_share > 0.05
    assert shape_of(two_blocks()).segmentation.border_share < 0.05
    X_SO = Pose(Rotation.exp([0.3, -0.5, 0.4]), np.array([0.01, -0.02, 0.1]))
    true = body.in_frame(X_SO)
    found = sy.identify(handling_log(true, noise="low", seed=seed), scan=shape, pose_in_sensor=X_SO)
    off = np.abs(np.asarray(found.parameters.people).ravel() - np.asarray(true.people).ravel()) / found.std
    assert off.max() < 3.0


def test_a_ball_with_a_cap_of_steel_has_the_inertia_of_both() -> None:
    """Its cells reach from side to side; uncut, they make the cap twice as large, and the inertia 8 % wrong."""
    radius, low = 0.03, 0.0105
    xyz = np.random.default_rng(0).normal(size=(2000, 3))
    xyz *= radius / np.linalg.norm(xyz, axis=1)[:, None]
    cloud = Cloud(xyz, np.where(xyz[:, 2:] > low, [[178, 176, 172]], [[186, 52, 38]]).astype(np.uint8))
    step = radius / 5000
    z = np.arange(-radius + step / 2, radius, step)
    mass, square = step * np.where(z > low, 7850.0, 1150.0) * np.pi * (radius**2 - z**2), radius**2 - z**2
    second = np.diag([mass @ square / 4, mass @ square / 4, mass @ z**2])
    pseudo = np.block([[second, np.array([[0], [0], [mass @ z]])], [np.array([[0, 0, mass @ z, mass.sum()]])]])
    X_SO = Pose(Rotation.exp([0.3, -0.5, 0.4]), np.array([0.01, -0.02, 0.1]))
    true = InertialParameters.from_pseudo_inertia(pseudo).in_frame(X_SO)
    found = sy.identify(handling_log(true, noise="low", seed=0), scan=shape_of(cloud), pose_in_sensor=X_SO)
    off = np.linalg.norm(found.inertia_com - true.inertia_com) / np.linalg.norm(true.inertia_com)
    assert off < 0.015


def test_parts_that_were_asked_for_or_joined_by_hand_are_all_that_a_log_is_offered() -> None:
    free = shape_of(two_blocks())
    assert len(free.segmentation) == 2
    assert len(free.cuts().numbers) > 1
    assert shape_of(two_blocks(), parts=1).cuts().numbers == (1,)
    joined = replace(free, segmentation=free.segmentation.merged([[0, 1]]))
    assert joined.cuts().numbers == (1,)
    # What the solid does not know of itself goes with its parts; no border between them is left.
    assert 0 < joined.parts.stretch == joined.error.stretch < free.error.stretch
    assert joined.parts.com_std == free.error.com_m
    with pytest.raises(BadValue, match="none empty"):
        free.segmentation.merged([[0], []])


def test_normals_of_another_length_and_none() -> None:
    made = two_blocks()
    out = made.xyz / np.linalg.norm(made.xyz, axis=1, keepdims=True)
    assert np.linalg.norm(replace(made, normals=0.01 * out).normals, axis=1) == pytest.approx(1.0)
    out[7] = np.nan
    assert replace(made, normals=out).normals is None


@pytest.mark.parametrize("wrong", [{"gravity": "maybe"}, {"drift": "no"}, {"bias": "some"}])
def test_options_that_are_none(wrong: dict[str, str]) -> None:
    with pytest.raises(BadValue, match=f"{next(iter(wrong))} must be one of"):
        Options(**wrong)  # type: ignore[arg-type]
