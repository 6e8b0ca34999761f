"""print(estimate) is the table of the command line; repr(estimate) is one line."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import steelyard as sy
from steelyard.cli.main import cli
from steelyard.evidence import Evidence, PartMass
from steelyard.report import Report, render
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


def held(mass: float, *stds: float) -> sy.Estimate:
    """A box of this mass in parts that weigh the same, each of a litre."""
    body = sy.InertialParameters.from_com(mass, [0.1, 0, 0], 0.01 * mass * np.eye(3))
    parts = tuple(PartMass(k, mass / len(stds), std, 1e-3, np.zeros(3)) for k, std in enumerate(stds))
    return sy.Estimate(**(KNOWN | {"parameters": body, "parts": parts}))  # type: ignore[arg-type]


def cells(table: str, start: str) -> list[str]:
    """The cells of the line that starts so."""
    return re.split(" {3,}", next(line for line in table.splitlines() if line.startswith(start)).strip())


@pytest.mark.parametrize(
    ("mass", "std", "said"),
    [
        (0.6, 0.0023, ["part 0", "300.0 ± 2.3 g", "300 kg/m³"]),
        (200.0, 9.5, ["part 0", "100.0 ± 9.5 kg", "100000 kg/m³"]),
        (3.074, 0.322, ["part 0", "1.54 ± 0.32 kg", "1540 kg/m³"]),
        (3.074, 0.0, ["part 0", "1.5370 kg", "1537 kg/m³"]),
    ],
)
def test_parts_are_told_in_the_unit_of_the_whole_and_as_finely_as_their_bars(
    mass: float, std: float, said: list[str]
) -> None:
    assert cells(str(held(mass, std, std)), "  part 0")[: len(said)] == said
    assert f"· {said[2]}" in render(Report("parts", held(mass, std, std)))


def test_the_bias_is_told_as_finely_as_it_is_known() -> None:
    stds = np.array([0.01, 0.01, 0.01, 0.3, 0.03, 0.003])
    bias = np.array([1.23456, -0.00001, 0.5, 12.3456, -12.3456, 1234.5678])
    found = sy.Estimate(**KNOWN, wrench_bias=bias, bias_covariance=np.diag(stds**2))  # type: ignore[arg-type]
    force, torque = "(12.35, -12.346, 1234.5678) N", "(1.235, 0.000, 0.500) N m"
    assert f"force {force}, torque {torque}" in str(found)
    assert f"{force}, {torque}".replace("-", "−") in render(Report("bias", found))


def test_what_is_not_identified_does_not_choose_the_unit() -> None:
    body = sy.InertialParameters.from_com(1.0, np.zeros(3), np.diag([0.01, 0.011, 0.2]))
    known = np.array([True] * 9 + [False])
    found = sy.Estimate(**(KNOWN | {"parameters": body, "identified": known}))  # type: ignore[arg-type]
    assert cells(str(found), "  Ixx")[1] == "10000 ± 100 kg mm²"
    assert "kg\xa0mm²" in render(Report("unit", found))
    assert "kg\xa0m²" not in render(Report("unit", found))
