"""Where the object sits in the sensor, given beside the description."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import steelyard as sy
from steelyard.errors import BadDescription, BadValue
from steelyard.io.object_pose import read_object_pose
from steelyard.io.ply_files import write_mesh
from steelyard.io.recording_files import write_recording
from steelyard.simulate import hammer

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
    "nowhere.toml": "No such file or directory: 'nowhere.toml'",
    "{ position = [0, 0, 0] }": 'give both "rotation" and "position"',
    "{ position = [0, 0 }": "pose in sensor: ",
}


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
