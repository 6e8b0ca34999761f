"""What robots and simulators are told of an answer: their own order of the inertia, in the frame that they ask for."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from steelyard.errors import BadDescription, BadValue, CannotAnswer
from steelyard.identify.estimate import Estimate, known_body
from steelyard.inertia import InertialParameters
from steelyard.io.inertial_texts import TARGETS, inertial_text
from steelyard.io.recordings.description import read_pose
from steelyard.spatial import Pose, Rotation

INERTIA = np.array([[0.004, 0.0001, 0.0002], [0.0001, 0.005, 0.0003], [0.0002, 0.0003, 0.006]])
COM = [0.01, -0.02, 0.03]
BODY = known_body(InertialParameters.from_com(1.5, COM, INERTIA))
DIAGONAL_FIRST = [0.004, 0.005, 0.006, 0.0001, 0.0002, 0.0003]
ROWS = [0.004, 0.0001, 0.0002, 0.005, 0.0003, 0.006]
# Target -> the inertia in the order of its numbers, and zeros that stand among them: angles of a pose.
ORDERS = {
    "urdf": ([*COM, 0, 0, 0, 1.5], ROWS),
    "sdf": ([*COM, 0, 0, 0, 1.5], ROWS),
    "mjcf": ([*COM, 1.5], DIAGONAL_FIRST),
    "drake": ([1.5, *COM], DIAGONAL_FIRST),
    "ur": ([1.5, *COM], DIAGONAL_FIRST),
    "franka": ([1.5, *COM], INERTIA.T.ravel().tolist()),
}


def numbers(text: str) -> list[float]:
    return [float(found) for found in re.findall(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e-?\d+)?", text)]


def open_inertia() -> Estimate:
    return replace(BODY, identified=np.arange(10) < 7)


@pytest.mark.parametrize("target", TARGETS)
def test_numbers_stand_in_the_order_of_the_target(target: str) -> None:
    before, inertia = ORDERS[target]
    np.testing.assert_allclose(numbers(inertial_text(BODY, target)), [*before, *inertia], rtol=1e-8)


def test_mass_and_inertia_are_those_of_the_frame_that_is_asked_for() -> None:
    X = Pose(Rotation.exp([0, 0, np.pi / 2]), [0, 0, 0.05])
    told = numbers(inertial_text(BODY, "mjcf", X))
    np.testing.assert_allclose(told, [0.02, 0.01, 0.08, 1.5, 0.005, 0.004, 0.006, -0.0001, -0.0003, 0.0002], rtol=1e-8)


def test_a_simulator_is_told_no_inertia_that_is_open_unless_a_guess_is_wanted() -> None:
    for target in ("urdf", "sdf", "mjcf", "drake"):
        with pytest.raises(CannotAnswer, match="--guess"):
            inertial_text(open_inertia(), target)
        assert inertial_text(open_inertia(), target, guess=True) == inertial_text(BODY, target)
    assert numbers(inertial_text(open_inertia(), "ur")) == pytest.approx([1.5, *COM])
    assert numbers(inertial_text(open_inertia(), "franka")) == pytest.approx([1.5, *COM, *[0.0] * 9])


def test_no_body_is_refused_by_simulators_alone() -> None:
    impossible = replace(BODY, parameters=InertialParameters.from_com(1.5, COM, np.diag([0.001, 0.001, 0.01])))
    with pytest.raises(BadValue, match="not those of a rigid body"):
        inertial_text(impossible, "urdf")
    assert inertial_text(impossible, "ur").startswith("set_target_payload(1.5, ")
    with pytest.raises(BadValue, match="one of urdf, sdf"):
        inertial_text(BODY, "xml")


def test_a_pose_in_quotes_may_leave_out_its_turn() -> None:
    pose = read_pose('{ position = [0, 0, 50], unit = "mm" }', "--pose-of-sensor")
    np.testing.assert_allclose(pose.position, [0, 0, 0.05])
    np.testing.assert_array_equal(pose.rotation.matrix, np.eye(3))
    for text in ("0 0 1", "{ positon = [0, 0, 1] }"):
        with pytest.raises(BadDescription, match=r"--pose-of-sensor.* Give a table in quotes, such as"):
            read_pose(text, "--pose-of-sensor")
