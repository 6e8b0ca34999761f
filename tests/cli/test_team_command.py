"""`steelyard team`, `steelyard demo team`: the example's answer, the demo's page, one clear line for wrong calls."""

# ruff: noqa: E501  (the full text of an error stands on one line)

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from steelyard.cli.main import cli, main
from steelyard.io import read_result
from steelyard.team.estimate import TeamEstimate

EXAMPLE = Path(__file__).parents[2] / "examples" / "omnid_three.toml"


@cache
def answer(method: str) -> dict[str, Any]:
    done = CliRunner().invoke(cli, ["team", str(EXAMPLE), "--method", method, "--json"])
    assert done.exit_code == 0
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def test_the_example_is_answered() -> None:
    found = answer("joint")
    assert (found["frame"], found["method"]) == ("left", "joint")
    assert found["mass_kg"] == pytest.approx(12, abs=0.02)
    assert list(found["grasps"]) == ["left", "right", "rear"]
    assert found["clock_offsets_s"]["right"] == pytest.approx(0.013, abs=5e-4)
    np.testing.assert_allclose(found["principal_moments_kgm2"], [2.257, 3.451, 5.14], rtol=0.05)
    assert np.linalg.norm(np.array(found["com_m"]) - [-0.8656, 0.2591, -0.0179]) < 0.006
    frame = found["principal_frame"]["rear"]
    grasp = found["grasps"]["rear"]
    # The principal frame sits at the centre of mass, seen from any grasp.
    com = np.array(grasp["rotation"]) @ frame["position_m"] + grasp["position_m"]
    np.testing.assert_allclose(com, found["com_m"], atol=1e-9)


def test_the_paper_answers_too_and_the_late_clock_costs_it_more() -> None:
    ours, paper = answer("joint"), answer("paper")
    assert paper["method"] == "paper"
    assert paper["clock_offsets_s"] == {}
    assert paper["mass_kg"] == pytest.approx(12, abs=0.1)
    apart = [
        np.linalg.norm(np.subtract(ours["grasps"][n]["position_m"], paper["grasps"][n]["position_m"]))
        for n in ("right", "rear")
    ]
    assert max(apart) > 10 * max(ours["grasps"]["right"]["std_m"])


def test_the_table_and_the_file(tmp_path: Path) -> None:
    done = CliRunner().invoke(cli, ["team", str(EXAMPLE), "-o", str(tmp_path / "r.json")])
    assert done.exit_code == 0
    for said in (
        "in the grasp frame of left",
        "principal moments of inertia",
        "grasps, from the reference",
        "clock late by",
        "clock-offset",
    ):
        assert said in done.stdout, said
    found = read_result(tmp_path / "r.json")
    assert isinstance(found, TeamEstimate)
    assert found.mass == pytest.approx(answer("joint")["mass_kg"], rel=1e-12)


def test_a_page_about_a_result(tmp_path: Path) -> None:
    result, page = tmp_path / "r.json", tmp_path / "page.html"
    result.write_text(json.dumps(answer("joint")))
    for more, residuals in (([], False), (["--log", str(EXAMPLE)], True)):
        done = CliRunner().invoke(cli, ["report", str(result), *more, "-o", str(page), "--json"])
        assert done.exit_code == 0
        assert json.loads(done.stdout)["placed"]
        text = page.read_text()
        assert "Where the robots hold" in text
        assert ("What is left over" in text) == residuals
    refused = CliRunner().invoke(cli, ["report", str(result), "--parts", "p.npz", "-o", str(page)])
    assert "A team's result has no parts to draw" in str(refused.exception)


@pytest.mark.parametrize(
    ("arguments", "status", "said"),
    [
        (["team", "none.toml"], 2, '"none.toml" was not found.'),
        (["team", str(EXAMPLE.with_name("kuka_run1.toml"))], 2, "kuka_run1.toml: [log] and [[stream]] make this the log of one robot."),
        (["identify", str(EXAMPLE)], 2, "omnid_three.toml: [team] makes this a team description. Use it with: steelyard team"),
    ],
)  # fmt: skip
def test_wrong_calls(capsys: pytest.CaptureFixture[str], arguments: list[str], status: int, said: str) -> None:
    with pytest.raises(SystemExit) as end:
        main(arguments)
    seen = capsys.readouterr()
    assert (end.value.code, seen.out) == (status, "")
    assert seen.err.startswith(f"steelyard: {said}")


def test_the_demo_makes_files_answers_and_a_page(tmp_path: Path) -> None:
    page, kept = tmp_path / "page.html", tmp_path / "kept"
    done = CliRunner().invoke(cli, ["demo", "team", "--seed", "1", "-o", str(page), "--keep", str(kept), "--json"])
    assert done.exit_code == 0
    found = json.loads(done.stdout)
    assert found["errors"]["position_mm"] < 0.5 * found["paper"]["errors"]["position_mm"]
    again = CliRunner().invoke(cli, ["team", str(kept / "team.toml"), "--json"])
    assert json.loads(again.stdout)["mass_kg"] == found["mass_kg"]
    assert json.loads((kept / "result.json").read_text())["mass_kg"] == found["mass_kg"]
    text = page.read_text()
    for said in (
        "One payload, three robots",
        "Where the robots hold",
        'data-show="grasps"',
        "The paper&#x27;s steps",
        "left",
        "rear",
        "What is left over",
    ):
        assert said in text, said
    assert "http://" not in text.replace("http://www.w3.org", "")
