"""Where the object sits in the sensor, given beside the description."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import steelyard as sy
from steelyard.api import shape_of
from steelyard.errors import BadDescription, BadValue
from steelyard.io.ply_files import write_mesh
from steelyard.io.recordings.description import read_object_pose
from steelyard.io.recordings.recording_files import write_recording
from steelyard.simulate import hammer
from steelyard.workshop.sampling import surface_cloud

TABLE = (
    '{ position = [1, 2, 120], unit = "mm", rotation = [0,-1,0, 1,0,0, 0,0,1], form = "matrix", '
    "std_mm = 2, std_deg = 1 }"
)


def test_table_and_file_say_the_same(tmp_path: Path) -> None:
    file = tmp_path / "place.toml"
    file.write_text(f"[object]\npose_in_sensor = {TABLE}\n")
    for text in (TABLE, str(file)):
        found = read_object_pose(text)
        np.testing.assert_allclose(found.pose.position, [0.001, 0.002, 0.12])
        np.testing.assert_allclose(found.pose.apply(np.array([1.0, 0, 0])), [0.001, 1.002, 0.12])
        assert found.std == pytest.approx((0.002, np.radians(1)))


BAD = {
    "nowhere.toml": "pose in sensor: nowhere.toml: cannot be read (No such file or directory). Give a TOML file",
    "{ position = [0, 0, 0] }": 'give both "rotation" and "position"',
    "{ position = [0, 0 }": "pose in sensor: the table given: not valid TOML: Unclosed array (at line 1, column 37). ",
}


WHERE = "pose in sensor, [object], pose_in_sensor: "
PLACE = "{ position = [0, 0, 0], rotation = [1,0,0, 0,1,0, 0,0,1]"
BAD_STD = {
    "std_mm = 2": '"std_deg" is missing beside "std_mm". Give both, 0 where the pose is exact, or neither.',
    "std_deg = 0": '"std_mm" is missing beside "std_deg". Give both, 0 where the pose is exact, or neither.',
    "std_mm = -1, std_deg = 1": '"std_mm" must be zero or more; got -1.',
    "std_mm = 1, std_deg = nan": '"std_deg" must be a finite number; got nan.',
}


@pytest.mark.parametrize("std", BAD_STD)
def test_what_is_wrong_with_a_spread_is_named(std: str) -> None:
    with pytest.raises(BadDescription) as caught:
        read_object_pose(f"{PLACE}, {std} }}")
    assert str(caught.value) == WHERE + BAD_STD[std]


@pytest.mark.parametrize(("mm", "deg"), [(0, 1), (2, 0)])
def test_position_or_turn_alone_may_be_uncertain(mm: float, deg: float) -> None:
    """Zero is what a very small spread comes to, for mesh and scan, and all that is said is finite."""
    made = hammer.recording(0)
    assert made.recording.object_pose is not None
    seen = shape_of(surface_cloud(made.tool))
    for given in ({"parts": made.tool.parts}, {"scan": seen}):
        found = []
        for least in (0.0, 1e-6):
            said = read_object_pose(f"{PLACE}, std_mm = {mm or least}, std_deg = {deg or least} }}").std
            recording = replace(made.recording, object_pose_std=said)
            found.append(sy.identify(recording, **given))
        zero, small = found
        assert np.isfinite(zero.parameters.vector).all()
        assert np.isfinite(zero.std).all()
        assert (zero.std > 0).all()
        assert (np.abs(zero.parameters.people - small.parameters.people) < 0.001 * zero.std).all()
        np.testing.assert_allclose(zero.std, small.std, rtol=1e-3)
        assert not any("std_mm" in note for note in zero.notes)


@pytest.mark.parametrize("text", BAD)
def test_what_cannot_be_read_is_named(text: str) -> None:
    with pytest.raises(BadDescription) as caught:
        read_object_pose(text)
    assert BAD[text] in str(caught.value)


def test_a_file_without_the_section_is_named(tmp_path: Path) -> None:
    file = tmp_path / "log.toml"
    file.write_text("[log]\n")
    with pytest.raises(BadDescription, match=r"log\.toml has no \[object\] pose_in_sensor"):
        read_object_pose(str(file))


def test_a_log_without_the_place_takes_it_from_beside(tmp_path: Path) -> None:
    made = hammer.recording(0)
    description = write_recording(made.recording, tmp_path)
    mesh = tmp_path / "hammer.ply"
    write_mesh(made.tool.mesh, mesh)
    there = sy.identify(description, parts=mesh)
    text = description.read_text()
    place = text[text.index("[object]") :].split("\n\n")[0].split("   #")[0]
    description.write_text(text.replace(place, "", 1))
    with pytest.raises(BadValue, match="pose_in_sensor"):
        sy.identify(description, parts=mesh)
    beside = sy.identify(description, parts=mesh, pose_in_sensor=place.split("=", 1)[1])
    np.testing.assert_array_equal(beside.parameters.vector, there.parameters.vector)
