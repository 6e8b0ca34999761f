"""What a user of a bare data file is told: it has no description to be corrected."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import steelyard as sy
from steelyard.spatial import Rotation

TURNS = np.radians([[0, 0, 0], [90, 0, 0], [-90, 0, 0], [0, 90, 0], [180, 0, 0], [45, 45, 30]])
HEAD = '[log]\n[[stream]]\npath = "data.csv"\nkind = "poses"\n'
COLUMNS = """\
force = { columns = ["fx", "fy", "fz"], unit = "N" }
torque = { columns = ["tx", "ty", "tz"], unit = "N*m" }
rotation = { columns = ["r11", "r12", "r13", "r21", "r22", "r23", "r31", "r32", "r33"], form = "matrix" }
"""


def sign_remedy(path: Path) -> str:
    """The remedy of the wrong sign in a table of poses of a sensor that reads what the object does to it."""
    return next(f.remedy for f in sy.identify(path).findings if f.code == "wrench-sign-flipped")


def test_a_bare_file_is_not_told_to_correct_its_description(tmp_path: Path) -> None:
    turns = Rotation.exp(TURNS).matrix
    force = 2.1 * np.einsum("nji,j->ni", turns, [0.0, 0.0, -9.81])
    readings = np.column_stack([force, np.cross([0.01, -0.02, 0.08], force)])
    readings += np.random.default_rng(0).normal(0, 0.001, readings.shape)
    names = ["fx", "fy", "fz", "tx", "ty", "tz", *(f"r{i}{j}" for i in "123" for j in "123")]
    rows = np.column_stack([readings, turns.reshape(-1, 9)])
    np.savetxt(tmp_path / "data.csv", rows, delimiter=",", header=",".join(names), comments="")
    (tmp_path / "log.toml").write_text(HEAD + COLUMNS)
    bare, described = sign_remedy(tmp_path / "data.csv"), sign_remedy(tmp_path / "log.toml")
    assert "write a description" in bare
    assert described.startswith("Set wrench =")
