"""A shape that does not lie where its pose says: the log answers alone, unless the pose may be that far off."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import steelyard as sy
from steelyard.errors import CannotAnswer
from steelyard.identify.estimate import Estimate
from steelyard.inertia import InertialParameters
from steelyard.logs.log import MotionLog
from steelyard.logs.recording import KNOWN_PLACE
from steelyard.parts.parts import Parts
from steelyard.pipelines.held_object import identify_rows
from steelyard.pipelines.load import Load
from steelyard.pipelines.shape_in_parts import Shape, shape_of
from steelyard.shape.cloud import Cloud
from steelyard.simulate.handling import handling_log
from steelyard.spatial import Pose, Rotation
from steelyard.workshop.catalogue import build
from steelyard.workshop.sampling import surface_cloud

TOOL = build("hammer")
RIGHT = TOOL.X_OS.inverse()
# Of the world that the views of a table are told in, in the frame of the mesh.
VIEWS = Pose(Rotation.from_rpy([0.3, 1.2, -2.0]), np.array([0.1, 0.15, 0.02]))


def shifted(x: float, y: float, z: float) -> Pose:
    """The right pose moved by millimetres along the axes of S; y is along the handle."""
    return Pose(RIGHT.rotation, RIGHT.position + 1e-3 * np.array([x, y, z]))


WRONG = {
    "frame of the views": RIGHT @ VIEWS,
    "in mm": Pose(RIGHT.rotation, 1e3 * RIGHT.position),
    "20 mm across": shifted(20, 0, 0),
    "40 mm across": shifted(-40, 0, 0),
    "80 mm across": shifted(0, 0, -80),
    "140 mm across": shifted(0, 0, 140),
    "140 mm along": shifted(0, -140, 0),
}
FAR = ("frame of the views", "in mm", "140 mm across", "140 mm along")
NEAR = ((10, 0, 0), (20, 0, 0), (0, 0, 20), (0, 0, -40), (-40, 0, 0))


@pytest.fixture(scope="module")
def log() -> MotionLog:
    return handling_log(TOOL.truth_in_sensor, "paper", noise="moderate", seed=1)


@pytest.fixture(scope="module")
def alone(log: MotionLog) -> Estimate:
    return sy.identify(log)


@pytest.fixture(scope="module")
def scan() -> Shape:
    seen = surface_cloud(TOOL)
    return shape_of(Cloud(seen.xyz, seen.rgb))


def given(request: pytest.FixtureRequest, kind: str) -> Parts | Shape:
    return TOOL.parts if kind == "mesh" else request.getfixturevalue("scan")


@pytest.mark.parametrize("kind", ["mesh", "scan"])
@pytest.mark.parametrize("place", WRONG)
def test_a_shape_that_lies_elsewhere_does_not_pull_the_answer(
    log: MotionLog, alone: Estimate, request: pytest.FixtureRequest, kind: str, place: str
) -> None:
    found = identify_rows(log, parts=given(request, kind), pose=WRONG[place], pose_std=KNOWN_PLACE)
    assert_left_out(found, alone)


@pytest.mark.parametrize("kind", ["mesh", "scan"])
@pytest.mark.parametrize("place", FAR)
def test_nor_does_one_that_lies_farther_off_than_anyone_errs_of_which_nothing_is_said(
    log: MotionLog, alone: Estimate, request: pytest.FixtureRequest, kind: str, place: str
) -> None:
    assert_left_out(identify_rows(log, parts=given(request, kind), pose=WRONG[place]), alone)


def assert_left_out(found: Estimate, alone: Estimate) -> None:
    np.testing.assert_array_equal(found.parameters.vector, alone.parameters.vector)
    np.testing.assert_array_equal(found.covariance, alone.covariance)
    assert not found.parts
    first = found.findings[0]
    assert first.code == "part-not-homogeneous"
    assert "mm outside the object: pose_in_sensor is wrong" in first.message
    assert "The shape cannot follow this log, and was left out" in first.message
    assert "--pose-in-sensor FILE" in first.remedy
    assert "frame W of its views, not in that of a mesh" in first.remedy


@pytest.mark.parametrize("shift", [(10, 0, 0), (-10, 0, 0), (0, 0, 20), (0, 0, -40)])
def test_a_scan_that_no_density_explains_is_left_out_though_its_centre_lies_in_the_object(
    log: MotionLog, alone: Estimate, scan: Shape, shift: tuple[float, float, float]
) -> None:
    found = identify_rows(log, parts=scan, pose=shifted(*shift), pose_std=KNOWN_PLACE)
    np.testing.assert_array_equal(found.parameters.vector, alone.parameters.vector)
    assert "from where any masses of even parts would" in found.findings[0].message


@pytest.mark.parametrize("kind", ["mesh", "scan"])
@pytest.mark.parametrize("shift", NEAR)
def test_one_that_is_less_far_off_is_named_and_in_the_bars(
    log: MotionLog, request: pytest.FixtureRequest, kind: str, shift: tuple[float, float, float]
) -> None:
    found = identify_rows(log, parts=given(request, kind), pose=shifted(*shift))
    (named,) = [finding for finding in found.findings if finding.code == "part-not-homogeneous"]
    assert "mm from where any masses of even parts would" in named.message or "mm outside the object" in named.message
    assert "std_mm" in named.remedy
    truth = TOOL.truth_in_sensor
    off = np.abs(found.parameters.inertia_com - truth.inertia_com)[np.triu_indices(3)]
    assert found.parts
    assert (off < 3 * found.std[4:]).all()


def test_a_shape_is_kept_where_the_log_alone_has_no_answer() -> None:
    turns = Rotation.exp(np.array([[0.0, 0, 0], [1.5, 0, 0]]))
    poses = MotionLog.of_poses(np.zeros((2, 6)), turns.inverse().apply([0, 0, -9.81]))
    noise = np.random.default_rng(0).normal(size=(2, 6)) * np.repeat([2e-3, 3e-2], 3)
    poses = replace(poses, wrench=poses.predicted(TOOL.truth_in_sensor.vector) + noise)
    with pytest.raises(CannotAnswer):
        sy.identify(poses)
    found = identify_rows(poses, parts=TOOL.parts, pose=shifted(20, 0, 0), pose_std=KNOWN_PLACE)
    assert "part-not-homogeneous" in found.codes()
    assert abs(found.mass - TOOL.truth_in_sensor.mass) < 3 * found.std[0]


def test_a_gripper_in_the_log_is_no_place_of_the_object() -> None:
    gripper = InertialParameters.from_com(1.5, [0.0, 0.0, -0.15], np.diag([4e-3, 4e-3, 2e-3]))
    tool = sy.identify(handling_log(gripper, noise="moderate", seed=2))
    held = InertialParameters(TOOL.truth_in_sensor.vector + gripper.vector)
    log = handling_log(held, "paper", noise="moderate", seed=1)
    found = identify_rows(log, tool=tool, parts=TOOL.parts, pose=shifted(20, 0, 0))
    assert "part-not-homogeneous" in found.codes()
    assert found.parts


@pytest.mark.parametrize("kind", ["mesh", "scan"])
@pytest.mark.parametrize("wrong", [shifted(20, 0, 0), RIGHT @ Pose(Rotation.exp([0, 0, 0.1]), np.zeros(3))])
def test_a_shape_stays_where_its_pose_is_said_to_be_that_unsure(
    log: MotionLog, request: pytest.FixtureRequest, kind: str, wrong: Pose
) -> None:
    found = identify_rows(log, parts=given(request, kind), pose=wrong, pose_std=(0.015, 0.1))
    assert found.parts
    assert "part-not-homogeneous" not in found.codes()
    truth = TOOL.truth_in_sensor
    off = np.abs(found.parameters.inertia_com - truth.inertia_com)[np.triu_indices(3)]
    assert (off < 4 * found.std[4:]).all()


@pytest.mark.parametrize("kind", ["mesh", "scan"])
def test_a_shape_in_its_place_answers_as_it_did(
    log: MotionLog, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    shape = given(request, kind)
    found = identify_rows(log, parts=shape, pose=RIGHT)
    monkeypatch.setattr(Load, "_unless_elsewhere", lambda load, estimate: (load, estimate))
    before = identify_rows(log, parts=shape, pose=RIGHT)
    np.testing.assert_array_equal(found.parameters.vector, before.parameters.vector)
    np.testing.assert_array_equal(found.covariance, before.covariance)
    assert found.parts
