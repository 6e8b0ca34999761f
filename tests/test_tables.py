"""print(estimate) is the table of the command line; repr(estimate) is one line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from click.testing import CliRunner

import steelyard as sy
from steelyard.cli.main import cli
from steelyard.evidence import Evidence
from steelyard.team.estimate import GraspEstimate

BODY = sy.solids.box(0.1, 0.2, 0.3, 500)
SEEN = Evidence(10, 3.0, 100, 20, 0.01, 0.002)
KNOWN = {
    "parameters": BODY, "covariance": 1e-8 * np.eye(10), "method": "noise-aware", "evidence": SEEN,
    "identified": np.ones(10, bool), "findings": (sy.Finding.of("contact", "Touched."),),
}  # fmt: skip


def test_an_estimate_prints_as_the_command_does(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    turn = sy.Rotation.exp(2 * rng.normal(size=(24, 3)))
    force = 0.9 * turn.inverse().apply(np.tile([0, 0, 9.81], (24, 1))) + 0.01 * rng.normal(size=(24, 3))
    torque = np.cross([0, 0.01, 0.05], force) + 1e-3 * rng.normal(size=(24, 3))
    table = np.column_stack([force, torque, turn.quaternion_wxyz()])
    path = tmp_path / "log.csv"
    np.savetxt(path, table, delimiter=",", header="fx,fy,fz,tx,ty,tz,qw,qx,qy,qz", comments="", fmt="%.9g")
    shown = CliRunner().invoke(cli, ["identify", str(path)], color=False)
    assert shown.exit_code == 0, shown.output
    title, _, rest = str(sy.identify(path)).partition("\n")
    assert title == "What the robot holds, in the frame S"
    assert rest == shown.output.partition("\n")[2].rstrip("\n")


def test_a_team_prints_where_everybody_holds() -> None:
    grasps = {
        "left": GraspEstimate(sy.Pose.identity(), np.zeros((6, 6))),
        "right": GraspEstimate(sy.Pose(sy.Rotation.identity(), [0.5, 0, 0]), 1e-6 * np.eye(6)),
    }
    found = sy.TeamEstimate(**KNOWN, frame="left", reference="left", grasps=grasps)  # type: ignore[arg-type]
    lines = str(found).splitlines()
    assert lines[0] == "What the team carries, in the grasp frame of left"
    assert "  grasps, from the reference" in lines
    assert any(line.startswith("  right   500.0 ± 1.0 mm") for line in lines)


def test_a_table_of_an_estimate_is_plain_text() -> None:
    assert "\x1b" not in str(sy.Estimate(**KNOWN))  # type: ignore[arg-type]


def test_repr_is_one_line() -> None:
    assert repr(sy.Estimate(**KNOWN)) == (  # type: ignore[arg-type]
        "<Estimate 3.00000 ± 0.00010 kg, com 0.000 ± 0.033 mm, 0.000 ± 0.033 mm, 0.000 ± 0.033 mm in S, "
        "noise-aware: contact>"
    )
