"""What a user of a bare data file is told: it has no description to be corrected, and said no sign."""

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


def test_a_sign_that_nobody_said_is_found_and_no_mistake(tmp_path: Path) -> None:
    """A bare file says no sign, so a note says which was found; a description that says the wrong one is told so."""
    turns = Rotation.exp(TURNS).matrix
    force = 2.1 * np.einsum("nji,j->ni", turns, [0.0, 0.0, -9.81])
    readings = np.column_stack([force, np.cross([0.01, -0.02, 0.08], force)])
    readings += np.random.default_rng(0).normal(0, 0.001, readings.shape)
    names = ["fx", "fy", "fz", "tx", "ty", "tz", *(f"r{i}{j}" for i in "123" for j in "123")]
    rows = np.column_stack([readings, turns.reshape(-1, 9)])
    np.savetxt(tmp_path / "data.csv", rows, delimiter=",", header=",".join(names), comments="")
    (tmp_path / "log.toml").write_text(HEAD + COLUMNS)
    bare, described = sy.identify(tmp_path / "data.csv"), sy.identify(tmp_path / "log.toml")
    note = (
        'the file does not say the sign of the wrench: it was found to be "on-sensor", z of the world taken as up '
        "(wrench in [log] of a description)"
    )
    assert note in bare.notes
    assert "wrench-sign-flipped" not in bare.codes()
    (flipped,) = (f for f in described.findings if f.code == "wrench-sign-flipped")
    assert flipped.remedy.startswith("Set wrench =")
    assert note not in described.notes
    assert bare.mass == described.mass > 0
