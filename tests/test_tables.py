"""print(estimate) is the table of the command line; repr(estimate) is one line."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import steelyard as sy
from steelyard.cli.main import cli
from steelyard.evidence import Evidence, PartMass
from steelyard.report import Report, render
from steelyard.tables.estimate import estimate_table
from steelyard.tables.numbers import general, plus_minus
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
    assert "  left    reference" in lines
    assert "clock late by" not in str(found)
    assert "  principal moments of inertia" in lines
    late = replace(found, clock_offsets_s={"left": 0.0, "right": 0.0123}, clock_offset_std_s={"left": 0, "right": 1e-4})
    told = str(replace(late, identified=np.arange(10) < 4))
    assert "  left    reference\n" in told
    assert "12.30 ± 0.10 ms" in told
    assert "principal moments" not in told


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


EVERYTHING = """A thing
  mass    3.00000 ± 0.00010 kg   leave-one-out ± 0.0020
  com x   0.000 ± 0.033 mm       leave-one-out ± 3.0
  com y   0.000 ± 0.033 mm       leave-one-out ± 3.0
  com z   0.000 ± 0.033 mm       leave-one-out ± 3.0
  Ixx     32500 ± 100 kg mm²     leave-one-out ± 400
  Iyy     25000 ± 100 kg mm²     leave-one-out ± 400
  Izz     12500 ± 100 kg mm²     leave-one-out ± 400
  Ixy, Ixz, Iyz    not identified by these data

  part 1   1.000 ± 0.010 kg   7850 kg/m³   at (0, 12, -100) mm   steel

  ±          one standard deviation; leave-one-out: how much the answer moves when poses are left out, the shape staying as it is
  method     noise-aware, rank 7, 100 rows of which 20 at rest
  residual   0.01 N, 0.002 N m rms; chi² per degree of freedom 0.98
  left out   0.011 N, 0.0022 N m rms when predicted unseen
  bias       force (4.00, 5.00, 6.00) N, torque (1.00, -2.00, 3.00) N m (subtract from the wrench as logged, in S)
  delay      -6.30 ms  a.csv
  note       a note

  contact: Touched.
      -> """  # noqa: E501
LITTLE = """A thing
  mass    3.00000 ± 0.00010 kg
  com x   0.000 ± 0.033 mm
  com y   0.000 ± 0.033 mm
  com z   0.000 ± 0.033 mm
  inertia    not identified by these data

  ±          one standard deviation
  method     noise-aware, rank 10, 100 rows of which 20 at rest
  residual   0.01 N, 0.002 N m rms

  no findings"""


def test_the_table_tells_all_there_is_and_nothing_else() -> None:
    people = np.repeat([2e-3, 3e-3, 4e-4], [1, 3, 6])
    seen = replace(
        SEEN, rank=7, chi2_per_dof=0.98, holdout_force_N=0.011, holdout_torque_Nm=0.0022, jackknife_people=people
    )
    part = PartMass(1, 1.0, 0.01, 1 / 7850, np.array([-1e-7, 0.012, -0.1]), "steel")
    told = {
        "evidence": seen, "parts": (part,), "delays_s": {"a.csv": -0.0063, "b.csv": 0.0}, "notes": ("a note",),
        "identified": np.array([1, 1, 1, 1, 1, 0, 0, 1, 0, 1], bool), "wrench_bias": np.array([1.0, -2, 3, 4, 5, 6]),
        "bias_covariance": 1e-2 * np.eye(6),
    }  # fmt: skip
    full = sy.Estimate(**(KNOWN | told))  # type: ignore[arg-type]
    assert estimate_table(full, "A thing") == EVERYTHING + full.findings[0].remedy
    bare = sy.Estimate(**(KNOWN | {"identified": np.arange(10) < 4, "findings": ()}))  # type: ignore[arg-type]
    assert estimate_table(bare, "A thing") == LITTLE


@pytest.mark.parametrize(
    ("value", "said"),
    [
        (None, "–"),
        (np.nan, "–"),
        (0.0, "0"),
        (1.234e8, "1.23e+08"),
        (-2e-7, "−2e−07"),
        (1649.6, "1650"),
        (0.05, "0.0500"),
    ],
)
def test_a_number_has_its_figures_and_powers_of_ten_only_far_out(value: float | None, said: str) -> None:
    assert general(value) == said


@pytest.mark.parametrize(("value", "said"), [(1e-17, "0.0000 kg"), (0.0, "0.000 kg"), (2.5, "2.5000 kg")])
def test_what_rounding_leaves_of_an_exact_number_is_not_shown(value: float, said: str) -> None:
    assert plus_minus(value, 0.0, "kg") == said


def test_a_bar_that_is_none_is_said() -> None:
    assert plus_minus(1.23456, float("nan"), "kg") == plus_minus(1.23456, float("inf"), "kg") == "1.235 ± ? kg"
