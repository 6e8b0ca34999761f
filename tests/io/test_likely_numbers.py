"""Numbers that no robot log holds are refused in one line that says where, before anything overflows."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from steelyard.errors import BadInput
from steelyard.io import read_recording

ROWS = np.column_stack(
    [np.arange(60) / 100, np.random.default_rng(0).normal(size=(60, 6)), np.tile([1, 0, 0, 0], (60, 1))]
)
STREAM = """[[stream]]
path = "log.csv"
time = { columns = ["t"], unit = "s" }
force = { columns = ["fx", "fy", "fz"] }
torque = { columns = ["tx", "ty", "tz"] }
rotation = { columns = ["qw", "qx", "qy", "qz"], form = "quaternion-wxyz" }
"""


def write(folder: Path, description: str, rows: np.ndarray = ROWS) -> Path:
    np.savetxt(folder / "log.csv", rows, "%.9g", ",", header="t,fx,fy,fz,tx,ty,tz,qw,qx,qy,qz", comments="")
    path = folder / "log.toml"
    path.write_text(description)
    return path


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('unit = "s"', 'unit = "ns"', "time: rows are 1e-11 s apart"),
        ('columns = ["t"], unit = "s"', "rate = 1e300", "time: rows are 1e-300 s apart"),
        ('columns = ["t"], unit = "s"', "rate = 1e-300", "time: rows are 1e+300 s apart"),
        ("[[stream]]", "[log]\ngravity = [0, 0, 1e300]\n[[stream]]", '"gravity" must be in m/s^2'),
        ("[[stream]]", "[log]\ngravity = [0, 0, 1e-300]\n[[stream]]", '"gravity" must be in m/s^2'),
        ("[[stream]]", "[noise]\nforce = 1e200\n[[stream]]", '"force" must be no larger than'),
        ("[[stream]]", "[[stream]]\ndelay = { value = 1e300 }", '"value" must be no larger than'),
        ("[[stream]]", "[[stream]]\nmount = { position = [70, 0, 0] }", '"position" must be no larger than 10; got 70'),
    ],
)
def test_descriptions(old: str, new: str, says: str, tmp_path: Path) -> None:
    with pytest.raises(BadInput) as caught:
        read_recording(write(tmp_path, STREAM.replace(old, new, 1)))
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_impossible_cell_is_named(tmp_path: Path) -> None:
    rows = ROWS.copy()
    rows[7, 2] = 1e300
    with pytest.raises(BadInput, match=r"force: 1 of 60 rows hold impossible numbers, up to 1e\+300: row 8\."):
        read_recording(write(tmp_path, STREAM, rows))


def test_angles_in_degrees_called_radians_are_named_with_the_key_to_set(tmp_path: Path) -> None:
    rows = ROWS.copy()
    rows[:, 7] = np.linspace(0, 90, 60)
    text = STREAM.replace('["qw", "qx", "qy", "qz"], form = "quaternion-wxyz"', '["qw", "qx", "qy"], form = "rpy"')
    with pytest.raises(BadInput, match=r'rotation: roll, pitch or yaw reaches 90 rad, .* degrees\. Set unit = "deg"\.'):
        read_recording(write(tmp_path, text, rows))
    read_recording(write(tmp_path, text.replace('form = "rpy"', 'form = "rpy", unit = "deg"'), rows))
